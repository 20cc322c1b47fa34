"""Surfaces and parts of cell.toml. The reference for users is docs/cells.md."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import coal
import msgspec
import numpy as np

from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Frame, Transform, Vector
from iiwa_sim.robot.description import Angle, Length
from iiwa_sim.settings import Name, Reader, between, expecting, require
from iiwa_sim.world.part import Mesh, Part

SIZES = {
    "box": ("size_mm",),
    "cylinder": ("radius_mm", "length_mm"),
    "sphere": ("radius_mm",),
    "mesh": ("mesh",),
}
"""The shapes of parts, and the keys of each; a mesh is the convex hull of an STL file (mm)."""
MOST_CORNERS = 5000
"""Corners of a mesh."""
Size = Annotated[float, between(0.01, 10_000.0, " mm")]
_Speed = Annotated[float, between(-10_000.0, 10_000.0, " mm/s")]
_Stiffness = Annotated[float, between(1.0, 1e7, " N/m")]
_Friction = Annotated[float, between(0.0, 10.0)]


class PoseSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A name and a pose in the world, the base of a single robot: mm, and rad about z, y and x."""

    name: Name
    x_mm: Length = 0.0
    y_mm: Length = 0.0
    z_mm: Length = 0.0
    alpha: Angle = 0.0
    beta: Angle = 0.0
    gamma: Angle = 0.0


class SurfaceSettings(PoseSettings, frozen=True, kw_only=True, tag_field="shape"):
    """The keys that all surfaces have."""

    stiffness_n_per_m: _Stiffness
    damping_s_per_m: Annotated[float, between(0.0, 100.0, " s/m")] = 0.0
    friction: _Friction = 0.0


class PlaneSettings(SurfaceSettings, frozen=True, kw_only=True, tag="plane"):
    """A plane to touch: x and y of its frame lie in it, z points out of the solid side."""


class BoxSettings(SurfaceSettings, frozen=True, kw_only=True, tag="box"):
    """A box to touch, with its middle at its frame and edges of `size_mm` along x, y and z."""

    size_mm: tuple[Size, Size, Size]
    surface_velocity_mm_per_s: tuple[_Speed, _Speed, _Speed] = (0.0, 0.0, 0.0)


class SphereSettings(SurfaceSettings, frozen=True, kw_only=True, tag="sphere"):
    """A sphere to touch, with its middle at its frame."""

    radius_mm: Size


class CylinderSettings(SurfaceSettings, frozen=True, kw_only=True, tag="cylinder"):
    """A cylinder to touch, with its middle at its frame and its axis along z."""

    radius_mm: Size
    length_mm: Size


AnySurface = PlaneSettings | BoxSettings | SphereSettings | CylinderSettings


class PartSettings(PoseSettings, frozen=True, kw_only=True):
    """A part. The pose is that of its middle."""

    shape: Annotated[Literal["box", "cylinder", "sphere", "mesh"], expecting(f"one of {', '.join(SIZES)}")]
    mass_kg: Annotated[float, between(0.001, 1000.0, " kg")]
    friction: _Friction = 0.5
    stiffness_n_per_m: _Stiffness = 1e5
    size_mm: tuple[Size, Size, Size] | None = None
    radius_mm: Size | None = None
    length_mm: Size | None = None
    mesh: str | None = None

    def __post_init__(self) -> None:
        for key in ("size_mm", "radius_mm", "length_mm", "mesh"):
            is_needed = key in SIZES[self.shape]
            expected = "this key" if is_needed else f"none for the shape {self.shape!r}"
            require((getattr(self, key) is not None) == is_needed, key, expected)


def pose_of(placed: Any) -> Transform:
    """Return the pose (m) of settings with the keys of a frame."""
    return Frame(*(getattr(placed, key) for key in Frame._fields)).to_transform()


def metres(place_mm: Vector) -> Vector:
    """Return a place (m) that is given in mm."""
    x, y, z = place_mm
    return 1e-3 * x, 1e-3 * y, 1e-3 * z


def surface_of(settings: AnySurface) -> Surface:
    """Return the surface of checked settings."""
    return Surface(
        settings.name,
        Plane() if isinstance(settings, PlaneSettings) else _solid(settings),
        pose_of(settings),
        settings.stiffness_n_per_m,
        settings.damping_s_per_m,
        settings.friction,
        metres(getattr(settings, "surface_velocity_mm_per_s", (0.0, 0.0, 0.0))),
    )


def part_of(settings: PartSettings, reader: Reader, folder: Path) -> tuple[Part, Transform]:
    """Return the part of checked settings and its pose; raise a fault for a mesh that cannot be used."""
    shape = _solid(settings) if settings.mesh is None else _mesh(settings.mesh, reader, folder)
    part = Part(settings.name, shape, settings.mass_kg, settings.friction, settings.stiffness_n_per_m)
    return part, pose_of(settings)


def _solid(sizes: Any) -> Box | Sphere | Cylinder:
    """Return the box, cylinder or sphere that has such sizes."""
    if (size_mm := getattr(sizes, "size_mm", None)) is not None:
        x, y, z = metres(size_mm)
        return Box(0.5 * x, 0.5 * y, 0.5 * z)
    length_mm = getattr(sizes, "length_mm", None)
    radius = 1e-3 * sizes.radius_mm
    return Sphere(radius) if length_mm is None else Cylinder(radius, 0.5e-3 * length_mm)


def _mesh(name: str, reader: Reader, folder: Path) -> Mesh:
    file = folder / name
    reader.check("mesh", name, file.is_file(), f"the path of an STL file in {folder}")
    try:
        found = coal.MeshLoader().load(str(file), np.full(3, 1e-3))
    except ValueError:
        raise reader.fault("mesh", name, "an STL file") from None
    triangles = map(found.tri_indices, range(found.num_tris))
    corners = found.vertices()[[each[k] for each in triangles for k in range(3)]]
    fits = 4 <= found.num_vertices <= MOST_CORNERS
    fits = fits and np.linalg.matrix_rank(corners - corners[0], rtol=1e-6) == 3
    reader.check("mesh", name, fits, f"a body with a volume, and 4 to {MOST_CORNERS} corners")
    return Mesh(tuple((x, y, z) for x, y, z in corners.tolist()))

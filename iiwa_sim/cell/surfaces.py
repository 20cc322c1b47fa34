"""The surfaces of cell.toml: their keys and ranges. The reference for users is docs/cells.md."""

from __future__ import annotations

from collections.abc import Mapping

from iiwa_sim.cell.placed import Placed, body_ranges, box, check_ranges, cylinder, sphere
from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Sphere
from iiwa_sim.settings import Reader

SURFACE_RANGES = body_ranges(
    (0.01, 10_000.0, " mm"),
    damping_s_per_m=(0.0, 100.0, " s/m"),
    surface_velocity_mm_per_s=(-10_000.0, 10_000.0, " mm/s"),
)
"""Range and unit of the keys of any surface, or of each value in them."""


class SurfaceSettings(Placed, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The keys that all surfaces have."""

    stiffness_n_per_m: float
    damping_s_per_m: float = 0.0
    friction: float = 0.0


class PlaneSettings(SurfaceSettings, frozen=True, kw_only=True, tag_field="shape", tag="plane"):
    """A plane to touch: x and y of its frame lie in it, z points out of what is solid."""

    def shape(self) -> Plane:
        """Return the shape (m), without pose and material."""
        return Plane()


class BoxSettings(SurfaceSettings, frozen=True, kw_only=True, tag_field="shape", tag="box"):
    """A box to touch, with its middle at its frame and edges of `size_mm` along x, y and z."""

    size_mm: tuple[float, float, float]
    surface_velocity_mm_per_s: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def shape(self) -> Box:
        """Return the shape (m), without pose and material."""
        return box(self.size_mm)


class SphereSettings(SurfaceSettings, frozen=True, kw_only=True, tag_field="shape", tag="sphere"):
    """A sphere to touch, with its middle at its frame."""

    radius_mm: float

    def shape(self) -> Sphere:
        """Return the shape (m), without pose and material."""
        return sphere(self.radius_mm)


class CylinderSettings(SurfaceSettings, frozen=True, kw_only=True, tag_field="shape", tag="cylinder"):
    """A cylinder to touch, with its middle at its frame and its axis along z."""

    radius_mm: float
    length_mm: float

    def shape(self) -> Cylinder:
        """Return the shape (m), without pose and material."""
        return cylinder(self.radius_mm, self.length_mm)


AnySurface = PlaneSettings | BoxSettings | SphereSettings | CylinderSettings


def check_surfaces(reader: Reader, surfaces: Mapping[str, AnySurface]) -> None:
    """Raises an error for a number out of range, and for a name that is used twice.

    Each surface comes with its key in the file.
    """
    names: dict[str, str] = {}
    for place, surface in surfaces.items():
        reader.check_name_in_lines(f"{place}.name", surface.name)
        taken = names.setdefault(surface.name, place)
        reader.check(f"{place}.name", surface.name, taken == place, f"another name than that of {taken}")
        check_ranges(reader, f"{place}.", surface, SURFACE_RANGES)

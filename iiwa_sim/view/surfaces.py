"""The surfaces of a cell in the scene, and where the TCP touches one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Frame, Vector
from iiwa_sim.view.drawing import Colour, wxyz

if TYPE_CHECKING:
    import viser

PLANE_M = 2.0
"""Edge of what is drawn of a plane."""
THIN_M = 0.002
COLOUR: Colour = (120, 150, 140)
OPACITY = 0.6
SAME_M = 1e-6

Described = Mapping[str, Any]
"""A surface with the keys of a cell.toml and `shape`, as the backdoor's `get cell` tells it."""


def surface_of(told: Described) -> Surface:
    """What is told as data, as a surface that knows how far a point is."""
    frame = Frame(*(float(told[key]) for key in Frame._fields))
    shape: Box | Sphere | Cylinder | Plane
    if told["shape"] == "box":
        x_mm, y_mm, z_mm = told["size_mm"]
        shape = Box(0.5e-3 * x_mm, 0.5e-3 * y_mm, 0.5e-3 * z_mm)
    elif told["shape"] == "sphere":
        shape = Sphere(1e-3 * told["radius_mm"])
    elif told["shape"] == "cylinder":
        shape = Cylinder(1e-3 * told["radius_mm"], 0.5e-3 * told["length_mm"])
    else:
        shape = Plane()
    return Surface(str(told["name"]), shape, frame.to_transform(), 0.0, 0.0, 0.0)


def touched(surfaces: Sequence[Surface], radius_m: float, tcp: Vector) -> list[Vector]:
    """Where the sphere of this radius round the TCP (m, in the base) touches surfaces."""
    found: list[Vector] = []
    x, y, z = tcp
    for surface in surfaces:
        distance, nx, ny, nz = surface.nearest(x, y, z)
        if distance <= radius_m + SAME_M:
            found.append((x - distance * nx, y - distance * ny, z - distance * nz))
    return found


class Surfaces:
    """Surfaces of one cell, below a node of the scene."""

    def __init__(self, scene: viser.SceneApi, root: str) -> None:
        self.surfaces: list[Surface] = []
        self._scene = scene
        self._root = root
        self._handles: dict[str, Any] = {}  # by the names of their surfaces
        self._told: dict[str, Described] = {}
        self._numbers = 0

    def show(self, told: Sequence[Described]) -> None:
        """Draw these, and no others."""
        now = {str(each["name"]): each for each in told}
        for name in [name for name in self._handles if name not in now]:
            self._handles.pop(name).remove()
        for name, each in now.items():
            before = self._told.get(name)
            if before == each and name in self._handles:
                continue
            surface = surface_of(each)
            if before is None or name not in self._handles or _size(before) != _size(each):
                if name in self._handles:
                    self._handles.pop(name).remove()
                self._handles[name] = self._added(surface)
            self._put(self._handles[name], surface)
        self._told = now
        self.surfaces = [surface_of(each) for each in now.values()]

    def _put(self, handle: Any, surface: Surface) -> None:
        handle.position = surface.pose.translation
        handle.wxyz = wxyz(surface.pose.rotation)

    def _added(self, surface: Surface) -> Any:
        scene, shape = self._scene, surface.shape
        self._numbers += 1
        path = f"{self._root}/{self._numbers}"  # names may have anything in them
        looks: dict[str, Any] = {"color": COLOUR, "opacity": OPACITY, "cast_shadow": False}
        if isinstance(shape, Box):
            edges = (2.0 * shape.half_x, 2.0 * shape.half_y, 2.0 * shape.half_z)
            return scene.add_box(path, dimensions=edges, **looks)
        if isinstance(shape, Sphere):
            return scene.add_icosphere(path, radius=shape.radius, **looks)
        if isinstance(shape, Cylinder):
            return scene.add_cylinder(path, radius=shape.radius, height=2.0 * shape.half_z, **looks)
        return scene.add_box(path, dimensions=(PLANE_M, PLANE_M, THIN_M), **looks)


def _size(told: Described) -> tuple[object, ...]:
    return tuple(str(told.get(key)) for key in ("shape", "size_mm", "radius_mm", "length_mm"))

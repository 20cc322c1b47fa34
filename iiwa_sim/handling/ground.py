"""What parts lie on: the level faces of surfaces, and of other parts."""

from __future__ import annotations

from collections.abc import Iterable
from math import inf
from typing import NamedTuple

from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Shape
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Transform
from iiwa_sim.handling.part import LEVEL, Part


class Ground(NamedTuple):
    """A level face, seen from above."""

    name: str
    """Name of the surface or part that the face belongs to."""
    top: float
    """Height of the face in the base (m)."""
    stiffness: float
    """N/m"""
    centre: tuple[float, float]
    """m, in the base."""
    along: tuple[float, float]
    """Unit vector in the base, along its first edge."""
    half: tuple[float, float]
    """Half its edges (m); the radius and 0 of a disc."""

    def has(self, x: float, y: float) -> bool:
        """Whether a place (m, in the base) is above or below it."""
        x, y = x - self.centre[0], y - self.centre[1]
        length, width = self.half
        if width == 0.0:
            return x * x + y * y <= length * length
        c, s = self.along
        return abs(c * x + s * y) <= length and abs(c * y - s * x) <= width

    def stiffness_below(self, part: Part) -> float:
        """Stiffness of the face and a part on it, one behind the other (N/m)."""
        return 1.0 / (1.0 / self.stiffness + 1.0 / part.stiffness)


def ground_of(name: str, shape: Shape, pose: Transform, stiffness: float) -> Ground | None:
    """The face of a shape that looks up; None where none is level."""
    rotation, (x, y, z) = pose
    up = rotation[6:9]
    if isinstance(shape, Plane):
        return Ground(name, z, stiffness, (x, y), (1.0, 0.0), (inf, inf)) if up[2] > 1.0 - LEVEL else None
    if isinstance(shape, Cylinder):
        if abs(up[2]) <= 1.0 - LEVEL:
            return None
        return Ground(name, z + shape.half_z, stiffness, (x, y), (1.0, 0.0), (shape.radius, 0.0))
    if not isinstance(shape, Box):
        return None
    axis = max((0, 1, 2), key=lambda each: abs(up[each]))
    if abs(up[axis]) <= 1.0 - LEVEL:
        return None
    first, second = (each for each in (0, 1, 2) if each != axis)
    along = (rotation[first], rotation[3 + first])
    return Ground(name, z + shape[axis], stiffness, (x, y), along, (shape[first], shape[second]))


def grounds_of(surfaces: Iterable[Surface]) -> list[Ground]:
    """The level faces, on which parts can lie, of all surfaces that have one."""
    found = (ground_of(each.name, each.shape, each.pose, each.stiffness) for each in surfaces)
    return [face for face in found if face is not None]

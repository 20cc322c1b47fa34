"""Parts: what they are, and how far they reach."""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

from iiwa_sim.contact.moments import Moments, body, seen_from
from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.frames import Rotation, Transform, Vector, multiply

X, Y, Z = 0, 1, 2
"""Axes of an outer frame."""


class Part(NamedTuple):
    """A rigid body of one material, its centre of mass at the middle of its shape."""

    name: str
    shape: Box | Cylinder | Sphere
    mass_kg: float
    friction: float
    """Coefficient of Coulomb friction, against all that it touches."""
    stiffness: float
    """N/m, in a row with that of what it lies on."""

    def moments(self, pose: Transform) -> Moments:
        """Weight and inertia of the part in a frame in which it is at `pose`."""
        mass, shape = self.mass_kg, self.shape
        if isinstance(shape, Box):
            x, y, z = (each * each for each in shape)
            inertia = [mass * each / 3.0 for each in (y + z, x + z, x + y)]
        elif isinstance(shape, Cylinder):
            across = mass * (shape.radius**2 / 4.0 + shape.half_z**2 / 3.0)
            inertia = [across, across, 0.5 * mass * shape.radius**2]
        else:
            inertia = [0.4 * mass * shape.radius**2] * 3
        return seen_from(body(mass, (0.0, 0.0, 0.0), (*inertia, 0.0, 0.0, 0.0)), pose)

    def reach(self, rotation: Rotation, axis: int) -> float:
        """How far (m) it reaches from its middle along an axis of an outer frame, turned in that."""
        a, b, c = rotation[3 * axis : 3 * axis + 3]
        shape = self.shape
        if isinstance(shape, Box):
            return abs(a) * shape.half_x + abs(b) * shape.half_y + abs(c) * shape.half_z
        if isinstance(shape, Cylinder):
            return abs(c) * shape.half_z + sqrt(max(0.0, 1.0 - c * c)) * shape.radius
        return shape.radius

    def laid(self, rotation: Rotation) -> Rotation:
        """How it lies, put down turned like that: on the face or the line that is nearest to below, of those
        on which its middle is not higher than it is turned like that."""
        shape = self.shape
        if isinstance(shape, Sphere):
            return rotation
        height = self.reach(rotation, Z) + 1e-12
        down = rotation[6:9]  # z of the base along the axes of the part
        if isinstance(shape, Box):
            fits = [axis for axis in (X, Y, Z) if shape[axis] <= height]
            axis = max(fits, key=lambda each: abs(down[each]))
            return _turned(rotation, axis, (0.0, 0.0, 1.0 if down[axis] > 0.0 else -1.0))
        upright = shape.half_z <= height and (shape.radius > height or abs(down[Z]) >= sqrt(0.5))
        if upright:
            return _turned(rotation, Z, (0.0, 0.0, 1.0 if down[Z] > 0.0 else -1.0))
        x, y = rotation[2], rotation[5]
        length = sqrt(x * x + y * y)
        along = (x / length, y / length, 0.0) if length > 0.0 else (1.0, 0.0, 0.0)
        return _turned(rotation, Z, along)

    def is_level(self, rotation: Rotation) -> bool:
        """Whether it lies on a face, or a cylinder on its side: as `laid` leaves it."""
        return all(abs(a - b) <= LEVEL for a, b in zip(self.laid(rotation), rotation, strict=True))


LEVEL = 1e-6
"""What is turned by less than this (rad) is level."""


def _turned(rotation: Rotation, axis: int, towards: Vector) -> Rotation:
    """Turned on by the least angle that brings an axis of the inner frame to a direction in the outer one,
    at most half a turn; without sines, which differ between machines."""
    v = (rotation[axis], rotation[3 + axis], rotation[6 + axis])
    x, y, z = (
        v[1] * towards[2] - v[2] * towards[1],
        v[2] * towards[0] - v[0] * towards[2],
        v[0] * towards[1] - v[1] * towards[0],
    )
    if x == y == z == 0.0:
        return rotation
    k = 1.0 / (1.0 + v[0] * towards[0] + v[1] * towards[1] + v[2] * towards[2])
    turn = (
        1.0 - k * (y * y + z * z), k * x * y - z, k * x * z + y,
        k * x * y + z, 1.0 - k * (x * x + z * z), k * y * z - x,
        k * x * z - y, k * y * z + x, 1.0 - k * (x * x + y * y),
    )  # fmt: skip
    return multiply(turn, rotation)

"""Where a part has room: bodies seen from above, and the shortest way out of those in which it would be.

What stands is seen as its outline between its lowest and its highest place: a rectangle, or a disc. Two of
them are apart where they are along one of the directions normal to an edge of either, or, of a disc, from its
middle to what of the other is nearest. The least depth of all these is how deep they are in each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot
from typing import NamedTuple

from iiwa_sim.contact.shapes import Box, Cylinder, Shape, Sphere
from iiwa_sim.frames import Transform
from iiwa_sim.handling.ground import Ground, ground_of
from iiwa_sim.handling.part import LEVEL

SLACK_M = 5e-4
"""What is less deep in each other stays so."""
CLEAR_M = 1e-5
"""What is moved out of another is so far from it then."""

Way = tuple[float, float]
"""m, along x and y of the base."""


class Outline(NamedTuple):
    """A body that stands or lies, seen from above."""

    name: str
    low: float
    """Height (m) of its lowest and of its highest place."""
    top: float
    centre: tuple[float, float]
    """m, in the base."""
    along: tuple[float, float]
    """Unit vector in the base, along its first edge."""
    half: tuple[float, float]
    """Half its edges (m); the radius and 0 of a disc."""
    face: Ground | None
    """Face of it on which something may lie."""
    is_part: bool = False

    def reach(self, x: float, y: float) -> float:
        """How far (m) it reaches from its middle along a direction."""
        length, width = self.half
        if width == 0.0:
            return length
        c, s = self.along
        return length * abs(c * x + s * y) + width * abs(c * y - s * x)

    def gone(self, way: Way) -> Outline:
        """This outline, moved along x and y."""
        return self._replace(centre=(self.centre[0] + way[0], self.centre[1] + way[1]))

    def nearest(self, x: float, y: float) -> Way:
        """The place of a rectangle, or the middle of a disc, nearest to a place."""
        (mx, my), (length, width), (c, s) = self.centre, self.half, self.along
        if width == 0.0:
            return self.centre
        u, v = c * (x - mx) + s * (y - my), c * (y - my) - s * (x - mx)
        u, v = max(-length, min(length, u)), max(-width, min(width, v))
        return mx + c * u - s * v, my + s * u + c * v

    def directions(self, other: Outline) -> list[Way]:
        """The directions along which it may be apart from another, as far as its own shape says."""
        c, s = self.along
        if self.half[1] > 0.0:
            return [(c, s), (-s, c)]
        x, y = other.nearest(*self.centre)
        x, y = self.centre[0] - x, self.centre[1] - y
        far = hypot(x, y)
        if far == 0.0:
            return [(1.0, 0.0)] if other.half[1] == 0.0 else []
        return [(x / far, y / far)]

    def ways_out(self, other: Outline) -> list[tuple[float, float, float]]:
        """Along each direction and back: how far (m) it is in another, and that direction."""
        x, y = self.centre[0] - other.centre[0], self.centre[1] - other.centre[1]
        found = []
        for a, b in self.directions(other) + other.directions(self):
            both, off = self.reach(a, b) + other.reach(a, b), a * x + b * y
            found += [(both - off, a, b), (both + off, -a, -b)]
        return found

    def depth(self, other: Outline) -> float:
        """How deep (m) both are in each other; less than 0 for not at all."""
        return min(depth for depth, _, _ in self.ways_out(other))

    def is_in(self, other: Outline) -> bool:
        """Whether both are in each other deeper than is left so."""
        far = hypot(*self.half) + hypot(*other.half)
        x, y = self.centre[0] - other.centre[0], self.centre[1] - other.centre[1]
        return x * x + y * y < far * far and self.depth(other) > SLACK_M


def outline_of(name: str, shape: Shape, pose: Transform, stiffness: float) -> Outline | None:
    """A body from above; None for what is neither level nor round there, and for a plane."""
    rotation, (x, y, z) = pose
    face = ground_of(name, shape, pose, stiffness)
    if isinstance(shape, Sphere):
        r = shape.radius
        return Outline(name, z - r, z + r, (x, y), (1.0, 0.0), (r, 0.0), None)
    if isinstance(shape, Box | Cylinder) and face is not None:
        return Outline(name, 2.0 * z - face.top, face.top, face.centre, face.along, face.half, face)
    if isinstance(shape, Cylinder) and abs(rotation[8]) <= LEVEL:
        r, along = shape.radius, (rotation[2], rotation[5])
        return Outline(name, z - r, z + r, (x, y), along, (shape.half_z, r), None)
    return None


def way_to_room(own: Outline, others: Sequence[Outline], *, lands: bool = False) -> Way | None:
    """The shortest way (m) to where it is in none of the others, straight out of one of them. It is no longer
    than its own half length, and None where there is no such place; of what lands it goes on out of all that
    is in the way.
    """
    near = [each for each in others if own.is_in(each)]
    if not near:
        return 0.0, 0.0
    ways = sorted(way for each in near for way in own.ways_out(each))
    for depth, a, b in ways:
        far = depth + CLEAR_M
        if depth <= max(own.half) and not any(own.gone((far * a, far * b)).is_in(each) for each in others):
            return far * a, far * b
    if not lands:
        return None
    far, a, b = min((_way_out_of_all(own, others, a, b), a, b) for _, a, b in ways)
    return far * a, far * b


def _way_out_of_all(own: Outline, others: Sequence[Outline], a: float, b: float) -> float:
    """How far (m) it goes along a direction until it is in none of the others."""
    far = 0.0
    while True:
        there = own.gone((far * a, far * b))
        into = next((each for each in others if there.is_in(each)), None)
        if into is None:
            return far
        # It is out where both are apart along its way, or along another direction.
        x, y = there.centre[0] - into.centre[0], there.centre[1] - into.centre[1]
        goes = [own.reach(a, b) + into.reach(a, b) - (a * x + b * y)]
        for depth, u, v in there.ways_out(into):
            if a * u + b * v > 0.0:
                goes.append(depth / (a * u + b * v))
        far += min(goes) + CLEAR_M


def between_heights(others: Sequence[Outline], low: float, high: float) -> list[Outline]:
    """The outlines of bodies that have something of themselves between two heights (m)."""
    return [each for each in others if each.top > low and each.low < high]

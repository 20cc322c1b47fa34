"""Where a part that lies meets what is beside it: walls, other parts, the arm, a held part.

A part is seen as its outline: of a box places at its corners, of a cylinder that stands, or a ball, what
is nearest, of a cylinder on its side its corners and the middles between at the height of its axis. What it
meets has points of its own that the part may come upon: edges that stand, and middles of what is round. What
is below a part, or less than `STEP_M` above the face on which it lies, it does not meet.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import dist, hypot, inf
from typing import NamedTuple

from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.ways_in_kernel import NOT_IN, way_out
from iiwa_sim.frames import Transform, Vector, apply, rotate
from iiwa_sim.handling.part import Part, Z
from iiwa_sim.robot.trigonometry_kernel import cosine, sine

STEP_M = 1e-3
"""A part goes over what is no higher than this."""
FORGETS_M = 5e-3
"""Of a place that has gone farther since it was seen last it is not known by which way it has come in."""
TALL_M = 10.0
_UPWARDS = 0.9  # of a direction: what pushes like that is below
_ROUND = (
    *((-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)),
    *((-1.0, -0.9), (-1.0, 0.9), (1.0, -0.9), (1.0, 0.9)),
    *((-0.9, -1.0), (-0.9, 1.0), (0.9, -1.0), (0.9, 1.0)),
)
"""Of a box seen from above: its corners, and near them, for one whose sides are flush with another's."""
_UPRIGHT = 1.0 - 1e-6

Way = tuple[float, float, float, float]
"""dx dy dz (m), and an angle about z (rad)."""
NOWHERE: Way = (0.0, 0.0, 0.0, 0.0)


class CameIn(NamedTuple):
    """By which way a place has come into a body."""

    way: Vector
    """As `ways_in_kernel` remembers it."""
    seen: Vector
    """Where the place was then, from the middle of the body (m, along the base)."""
    rubbed: Vector = (0.0, 0.0, 0.0)
    """How far friction's spring was wound (m, along the base)."""


NEVER_MET = CameIn(NOT_IN, (0.0, 0.0, 0.0))


class Touch(NamedTuple):
    """A part and one that presses on it, as they are."""

    depth: float
    """m; less than 0 where they are apart."""
    out: Vector
    """Unit vector out of the part."""
    lever: Vector
    """From its middle (m)."""
    came: CameIn = NEVER_MET
    """What is to be remembered of it."""


class Ball(NamedTuple):
    """A ball, perhaps of no size, that a part may come upon."""

    middle: Vector
    radius: float
    beside: bool = False
    """Whether it is beside the part, and no way out is up or down."""
    came: Vector = NOT_IN
    """By which way it has come into the part."""

    def touch(self, part: Surface, _way: Way) -> Touch:
        """Of the part where it is."""
        solid = tall(part) if self.beside else part
        (distance, *out), came = way_out(solid, self.radius, self.middle, self.came)
        lever = less(self.middle, part.pose.translation)
        return Touch(self.radius - distance, (out[0], out[1], out[2]), lever, CameIn(came, lever))


class Corner(NamedTuple):
    """A place of a part, from its middle in the base (m) before it goes a way, that may meet a surface."""

    place: Vector
    surface: Surface
    came: Vector = NOT_IN
    """By which way it has come into that."""

    def touch(self, part: Surface, way: Way) -> Touch:
        """Of the part where it is, after that way."""
        lever, (px, py, pz) = turned(self.place, way[3]), part.pose.translation
        here = (px + lever[0], py + lever[1], pz + lever[2])
        (distance, x, y, z), came = way_out(self.surface, 0.0, here, self.came)
        seen = less(here, self.surface.pose.translation)
        return Touch(-distance, (-x, -y, -z), lever, CameIn(came, seen))


class Rim(NamedTuple):
    """What of something round that stands is nearest to a surface, at a height from its middle (m)."""

    height: float
    radius: float
    surface: Surface
    came: Vector = NOT_IN
    """By which way it has come into that."""

    def touch(self, part: Surface, _way: Way) -> Touch:
        """Of the part where it is."""
        x, y, z = part.pose.translation
        here, r = (x, y, z + self.height), self.radius
        (distance, nx, ny, nz), came = way_out(self.surface, r, here, self.came)
        level = hypot(nx, ny)
        lever = (-r * nx / level, -r * ny / level, self.height) if level > 0.0 else (0.0, 0.0, self.height)
        seen = less(here, self.surface.pose.translation)
        return Touch(r * level - distance, (-nx, -ny, -nz), lever, CameIn(came, seen))


Meets = Ball | Corner | Rim


def remembering(each: Meets, part: Surface, came: CameIn | None) -> tuple[Meets, Vector]:
    """The same, that has come in like that, if it is still there; and how far friction's spring is wound."""
    if came is None or dist(each.touch(part, NOWHERE).came.seen, came.seen) > FORGETS_M:
        return each, NEVER_MET.rubbed
    return each._replace(came=came.way), came.rubbed


def tall(solid: Surface) -> Surface:
    """A box or a cylinder that stands, without end; anything else as it is."""
    shape, up = solid.shape, solid.pose.rotation[6:9]
    if isinstance(shape, Cylinder) and abs(up[2]) > _UPRIGHT:
        return solid._replace(shape=shape._replace(half_z=shape.half_z + TALL_M))
    if isinstance(shape, Box):
        axis = max((0, 1, 2), key=lambda each: abs(up[each]))
        if abs(up[axis]) > _UPRIGHT:
            half = [shape.half_x, shape.half_y, shape.half_z]
            half[axis] += TALL_M
            return solid._replace(shape=Box(*half))
    return solid


def span(solid: Surface) -> tuple[float, float]:
    """The lowest and the highest place (m, in the base) of something that stands; any for all else."""
    shape, up, z = solid.shape, solid.pose.rotation[6:9], solid.pose.translation[2]
    if isinstance(shape, Box | Cylinder):
        axis = 2 if isinstance(shape, Cylinder) else max((0, 1, 2), key=lambda each: abs(up[each]))
        half = shape.half_z if isinstance(shape, Cylinder) else shape[axis]
        if abs(up[axis]) > _UPRIGHT:
            return z - half, z + half
    return -inf, inf


def less(place: Vector, middle: Vector) -> Vector:
    """From a middle to a place."""
    return (place[0] - middle[0], place[1] - middle[1], place[2] - middle[2])


def turned(place: Vector, angle: float) -> Vector:
    """A place (m), turned about z (rad)."""
    if angle == 0.0:
        return place
    c, s = cosine(angle), sine(angle)
    x, y, z = place
    return (c * x - s * y, s * x + c * y, z)


def meets(part: Part, pose: Transform, lift_m: float, other: Surface, reach_m: float) -> Iterator[Meets]:
    """What of a part at a pose may press on something beside it, no farther away than `reach_m`; of the part
    the lowest `lift_m` do not count."""
    middle, shape = pose.translation, other.shape
    if other.nearest(*middle)[0] > part.shape.extent + reach_m:
        return
    yield from outline(part, pose, lift_m, other)
    low, high = -part.reach(pose.rotation, Z) + lift_m, part.reach(pose.rotation, Z) - STEP_M
    if isinstance(shape, Box | Cylinder | Sphere):
        yield from _stands(other, middle[2] + low, middle[2] + high)


def is_beside(touch: Touch) -> bool:
    """Whether what presses like that is not below the part."""
    return touch.out[2] > -_UPWARDS


def outline(part: Part, pose: Transform, lift_m: float, other: Surface) -> Iterator[Corner | Rim]:
    """Places of a part at a pose that may come upon something; the lowest `lift_m` do not count, nor the
    highest `STEP_M`. What stands is come upon from beside."""
    shape, rotation, height = part.shape, pose.rotation, pose.translation[2]
    low, high = -part.reach(rotation, Z) + lift_m, part.reach(rotation, Z) - STEP_M
    bottom, top = (each - height for each in span(other))
    levels = [each for each in (low, 0.5 * (low + high), high) if bottom < each < top]
    other = tall(other)
    if isinstance(shape, Sphere):
        yield Rim(0.0, shape.radius, other)
    elif isinstance(shape, Cylinder) and abs(rotation[8]) > _UPRIGHT:
        for level in levels:
            yield Rim(level, shape.radius, other)
    elif isinstance(shape, Cylinder) and bottom < 0.0 < top:
        r, h = shape.radius, shape.half_z
        x, y = rotation[2], rotation[5]
        for along, across in ((-h, -r), (-h, 0.0), (-h, r), (0.0, r), (h, r), (h, 0.0), (h, -r), (0.0, -r)):
            yield Corner((along * x - across * y, along * y + across * x, 0.0), other)
    elif isinstance(shape, Box):
        upright = max((0, 1, 2), key=lambda each: abs(rotation[6 + each]))
        first, second = (each for each in (0, 1, 2) if each != upright)
        for number, (a, b) in enumerate(_ROUND):
            own = [0.0, 0.0, 0.0]
            own[first], own[second] = a * shape[first], b * shape[second]
            x, y, _ = rotate(rotation, (own[0], own[1], own[2]))
            for level in levels if number < 4 else levels[len(levels) // 2 :][:1]:
                yield Corner((x, y, level), other)


def _stands(other: Surface, low: float, high: float) -> Iterator[Meets]:
    """Places of something that a part between two heights (m, in the base) may come upon."""
    shape, rotation, (x, y, z) = other.shape, *other.pose
    if isinstance(shape, Sphere):
        yield Ball((x, y, z), shape.radius)
    elif isinstance(shape, Box):
        half = [shape[0], shape[1], shape[2]]
        upright = max((0, 1, 2), key=lambda each: abs(rotation[6 + each]))
        if abs(rotation[6 + upright]) < _UPRIGHT:
            for a in (-1.0, 1.0):
                for b in (-1.0, 1.0):
                    for c in (-1.0, 1.0):
                        yield Ball(apply(other.pose, (a * half[0], b * half[1], c * half[2])), 0.0)
            return
        bottom, top = max(low, z - half[upright]), min(high, z + half[upright])
        if bottom > top:
            return
        first, second = (each for each in (0, 1, 2) if each != upright)
        for a, b in _ROUND:
            own = [0.0, 0.0, 0.0]
            own[first], own[second] = a * half[first], b * half[second]
            px, py, _ = apply(other.pose, (own[0], own[1], own[2]))
            yield Ball((px, py, 0.5 * (bottom + top)), 0.0, beside=True)
    elif isinstance(shape, Cylinder) and abs(rotation[8]) > _UPRIGHT:
        bottom, top = max(low, z - shape.half_z), min(high, z + shape.half_z)
        if bottom <= top:
            yield Ball((x, y, 0.5 * (bottom + top)), shape.radius, beside=True)
    elif isinstance(shape, Cylinder):
        r, h = shape.radius, shape.half_z
        inner = max(0.0, h - r)
        for along in (-inner, -0.5 * inner, 0.0, 0.5 * inner, inner):
            yield Ball(apply(other.pose, (0.0, 0.0, along)), min(r, h))

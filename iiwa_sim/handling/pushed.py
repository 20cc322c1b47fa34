"""A part that lies and is pushed, in one tick: it slides, turns about the vertical, sinks in, or stays.

Where it goes is found by `contact.pushed_kernel`, with all that presses seen as planes. Then what is stored
at the end is counted as it really is: what would be too much there is taken from the part's speed, and if
that is not enough, from its way. So a part and all that presses on it have at no time more energy than was
put in.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import sqrt
from typing import NamedTuple

from iiwa_sim.contact.moments import GRAVITY_M_S2
from iiwa_sim.contact.pushed_kernel import Balance
from iiwa_sim.contact.pushers import Below, Pressing
from iiwa_sim.contact.shapes import Cylinder, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Rotation, Transform, Vector, multiply
from iiwa_sim.handling.falling import STILL, Body
from iiwa_sim.handling.ground import Ground
from iiwa_sim.handling.meeting import NOWHERE, CameIn, Meets, Touch, Way, is_beside
from iiwa_sim.handling.part import Part, X, Y
from iiwa_sim.robot.trigonometry_kernel import cosine, sine

UNWOUND = (0.0,) * 8
STILL_M = 1e-9
"""A part that would go a shorter way in a tick stays."""
SLOW_M_PER_S = 1e-3
"""What nothing pushes, and is slower than this, rests."""
_SHARE = sqrt(1.0 / 3.0)  # of half an edge: four points there have the moments of a face
_HALVINGS = 12

Key = tuple[str, int]
"""Name of what is met, and the number of a place of either."""


class Presser(NamedTuple):
    """One that presses on a part, or may."""

    meets: Meets
    stiffness: float
    """N/m, of both in a row."""
    friction: float = 0.0
    holding: float = 1.0
    """Stiffness (N/m) of friction's spring."""
    rubbed: Vector = (0.0, 0.0, 0.0)
    """How far it has gone along the part (m), as friction holds that."""
    key: Key | None = None
    """Under which the part remembers by which way it has come in, if it is not remembered elsewhere."""

    def after(self, before: Touch, touch: Touch, way: Way) -> CameIn:
        """What the part remembers of it after a way, on which the touch has become another."""
        if touch.depth <= 0.0 or self.friction == 0.0 or not is_beside(before):
            return touch.came
        left = _left(self.rubbed, before, way)
        length = sqrt(sum(each * each for each in left))
        longest = self.friction * self.stiffness * touch.depth / self.holding
        share = 1.0 if length <= longest else longest / length
        return touch.came._replace(rubbed=(share * left[0], share * left[1], share * left[2]))


class Stack(NamedTuple):
    """What lies on a part, and goes with it."""

    mass_kg: float = 0.0
    inertia_kgm2: float = 0.0
    """About the vertical through the middle of the part."""


def pushed(
    body: Body, face: Ground, stack: Stack, pressers: Sequence[Presser], balance: Balance, tick_s: float
) -> tuple[Body, Way]:
    """The part after a tick on a face, and the way that it has gone."""
    part, pose = body.part, body.pose
    solid = Surface(part.name, part.shape, pose, part.stiffness, 0.0, part.friction)
    touches = [each.meets.touch(solid, NOWHERE) for each in pressers]
    pressing = [
        _pressing(each, touch) for each, touch in zip(pressers, touches, strict=True) if is_beside(touch)
    ]
    mass = part.mass_kg + stack.mass_kg
    inertia = turning(part, pose.rotation) + stack.inertia_kgm2
    below = Below(
        face.stiffness_below(part),
        face.top - body.bottom,
        part.mass_kg * GRAVITY_M_S2,
        stack.mass_kg * GRAVITY_M_S2,
        part.friction,
        rubs_at(part, pose.rotation),
        body.wound or UNWOUND,
    )
    velocity = (*body.velocity, body.spin)
    way, wound = balance.way(mass, inertia, velocity, below, pressing, tick_s)
    if max(map(abs, way[:3])) < STILL_M and abs(way[3]) * part.shape.extent < STILL_M:
        return body._replace(velocity=STILL, spin=0.0), NOWHERE
    share, moving = 1.0, _energy(mass, inertia, velocity)
    for _ in range(_HALVINGS):
        gone: Way = (share * way[0], share * way[1], share * way[2], share * way[3])
        after = wound if share == 1.0 else below.wound
        now = tuple(each / tick_s for each in gone)
        left = moving - _gained(solid, below, after, pressers, gone)
        fast = _energy(mass, inertia, now)
        if left >= 0.0:
            slower = 1.0 if fast <= left else sqrt(left / fast)
            x, y, z, spin = (slower * each for each in now)
            there = gone_by(pose, gone)
            return body._replace(pose=there, velocity=(x, y, z), spin=spin, wound=after), gone
        share *= 0.5
    return body._replace(velocity=STILL, spin=0.0), NOWHERE


def gone_by(pose: Transform, way: Way) -> Transform:
    """A pose after a way."""
    (x, y, z), rotation = pose.translation, pose.rotation
    if way[3] != 0.0:
        c, s = cosine(way[3]), sine(way[3])
        rotation = multiply((c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0), rotation)
    return Transform(rotation, (x + way[0], y + way[1], z + way[2]))


def turning(part: Part, rotation: Rotation) -> float:
    """Moment of inertia (kg m^2) about the vertical through the middle."""
    moments = part.moments(Transform(rotation, (0.0, 0.0, 0.0)))
    return moments.xx + moments.yy


def rubs_at(part: Part, rotation: Rotation) -> tuple[tuple[float, float], ...]:
    """Four places from the middle (m) that stand for what a part lies on: with its moments of area."""
    shape = part.shape
    if isinstance(shape, Sphere):
        return ((0.0, 0.0),) * 4
    if isinstance(shape, Cylinder) and abs(rotation[8]) > 0.5:
        half = 0.5 * shape.radius
        return ((half, half), (-half, half), (-half, -half), (half, -half))
    if isinstance(shape, Cylinder):
        x, y = _SHARE * shape.half_z * rotation[2], _SHARE * shape.half_z * rotation[5]
        return ((x, y), (x, y), (-x, -y), (-x, -y))
    upright = max((0, 1, 2), key=lambda each: abs(rotation[6 + each]))
    first, second = (each for each in (0, 1, 2) if each != upright)
    ax, ay = (_SHARE * shape[first] * rotation[3 * axis + first] for axis in (X, Y))
    bx, by = (_SHARE * shape[second] * rotation[3 * axis + second] for axis in (X, Y))
    return ((ax + bx, ay + by), (bx - ax, by - ay), (-ax - bx, -ay - by), (ax - bx, ay - by))


def _pressing(each: Presser, touch: Touch) -> Pressing:
    """As the balance takes it."""
    (nx, ny, nz), (x, y, _) = touch.out, touch.lever
    along = (nx, ny, nz, x * ny - y * nx)
    return Pressing(
        along, touch.depth, each.stiffness, each.friction, each.holding, (x, y), touch.out, each.rubbed
    )


def _energy(mass_kg: float, inertia_kgm2: float, velocity: Sequence[float]) -> float:
    """Of motion (J)."""
    x, y, z, spin = velocity
    return 0.5 * mass_kg * (x * x + y * y + z * z) + 0.5 * inertia_kgm2 * spin * spin


def _gained(
    solid: Surface, below: Below, wound: Sequence[float], pressers: Sequence[Presser], way: Way
) -> float:
    """By how much more is stored after a way (J): by height, and in all springs; friction only takes."""
    there = solid._replace(pose=gone_by(solid.pose, way))
    total = below.weight_n * way[2]
    total += _spring(below.stiffness, below.depth - way[2]) - _spring(below.stiffness, below.depth)
    holding = 0.125 * below.stiffness
    total += holding * (sum(each * each for each in wound) - sum(each * each for each in below.wound))
    for each in pressers:
        before, after = each.meets.touch(solid, NOWHERE), each.meets.touch(there, way)
        if is_beside(before):
            total -= _spring(each.stiffness, before.depth)
        if is_beside(after):
            total += _spring(each.stiffness, after.depth)
        if is_beside(before) and each.friction > 0.0 and after.depth > 0.0:
            limit = each.friction * each.stiffness * after.depth
            left = _left(each.rubbed, before, way)
            total += _held(each.holding, limit, left) - _held(each.holding, limit, each.rubbed)
    return total


def _left(rubbed: Vector, before: Touch, way: Way) -> Vector:
    """How far (m) what rubs at a touch has gone along a part that goes a way, if friction holds all that."""
    x, y, _ = before.lever
    nx, ny, nz = before.out
    u, v, w = way[0] - way[3] * y, way[1] + way[3] * x, way[2]
    out = u * nx + v * ny + w * nz
    return (rubbed[0] - (u - out * nx), rubbed[1] - (v - out * ny), rubbed[2] - (w - out * nz))


def _spring(stiffness: float, depth: float) -> float:
    """What one that only presses stores (J)."""
    return 0.5 * stiffness * depth * depth if depth > 0.0 else 0.0


def _held(holding: float, limit: float, rubbed: Iterable[float]) -> float:
    """What friction's spring stores, and takes where it slips (J)."""
    length = sqrt(sum(each * each for each in rubbed))
    if holding * length <= limit:
        return 0.5 * holding * length * length
    return limit * length - 0.5 * limit * limit / holding

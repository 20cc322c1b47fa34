"""Contact gives nobody energy. Random scenes by a seed, on the bare core: cheap enough for thousands.

`tools/hunt.py` tries more of them. A hand moves the TCP through surfaces and turns it, and another hand
moves the surfaces. What both have put in by some time, less what they have got back, must at no time be less
than nothing; nor may what has been lost, that less what is stored in springs, ever come back. The work of a
tick is an integral over the way of the tick, with the memory of its beginning; where forces have a kink the
way is halved until the rest is rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import pi

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import (
    IDENTITY,
    Rotation,
    Transform,
    Vector,
    multiply,
    rotate,
    rotation_about,
    transform_from_euler,
)
from iiwa_sim.wrench import Touch
from tests.contact.materials import World
from tests.samples import some

TICK_S = 0.002
STILL: Vector = (0.0, 0.0, 0.0)
ROUNDING = 1e-6
"""Of the work that has been done: integrals are found to that."""
BENT = 0.05
"""So much of the work that was lost may come back where the normal turns by much in a tick, by friction."""
LEAST_J = 1e-9
HALVINGS = 40


def integral(
    rate: Callable[[float], float],
    rounding: float,
    a: float = 0.0,
    b: float = 1.0,
    at: tuple[float, float, float] | None = None,
    left: int = HALVINGS,
) -> float:
    """Of a rate from a to b, by Simpson's rule, halved where the halves say otherwise."""
    m = 0.5 * (a + b)
    at_a, at_m, at_b = at or (rate(a), rate(m), rate(b))
    whole = (b - a) / 6.0 * (at_a + 4.0 * at_m + at_b)
    at_low, at_high = rate(0.5 * (a + m)), rate(0.5 * (m + b))
    halves = (b - a) / 12.0 * (at_a + 4.0 * at_low + 2.0 * at_m + 4.0 * at_high + at_b)
    greatest = max(map(abs, (at_a, at_low, at_m, at_high, at_b)))
    if abs(halves - whole) <= max(rounding, 1e-11 * (b - a) * greatest) or not left:
        return halves + (halves - whole) / 15.0
    low = integral(rate, rounding, a, m, (at_a, at_low, at_m), left - 1)
    return low + integral(rate, rounding, m, b, (at_m, at_high, at_b), left - 1)


def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def along(start: Vector, share: float, step: Vector) -> Vector:
    return (start[0] + share * step[0], start[1] + share * step[1], start[2] + share * step[2])


def minus(a: Vector, b: Vector) -> Vector:
    return along(a, -1.0, b)


def turn(axis: Vector, angle: float, rotation: Rotation) -> Rotation:
    return multiply(rotation_about(axis, angle), rotation) if angle else rotation


def work(touch: Touch, arm: Vector, step: Vector, axis: Vector, angle: float) -> float:
    """Of what is touched on what goes by a step and turns; the point touched is so far from its middle."""
    (ax, ay, az), (x, y, z) = axis, arm
    swung = (ay * z - az * y, az * x - ax * z, ax * y - ay * x)
    return dot(touch[0], step) + angle * (dot(touch[0], swung) + dot(touch[1], axis))


class Ledger:
    """What has been put in, what of it is stored, and what is lost: that must never become less again."""

    def __init__(self) -> None:
        self._net_j = self._lost_j = 0.0
        self._done_j = LEAST_J
        self.gained = 0.0
        """The most that had been got back beyond what had been put in: as all here, a part of the most that
        had been put in by then."""
        self.returned = 0.0
        """The most that came back of what had been lost."""

    def does(self, rate: Callable[[float], float]) -> float:
        """The work at such a rate in one tick."""
        return integral(rate, 1e-2 * ROUNDING * self._done_j)

    def done(self, work_j: float, stored_j: float) -> None:
        """Somebody has done this, and so much is in springs now."""
        self._net_j += work_j
        self._done_j = max(self._done_j, self._net_j)
        lost_j = self._net_j - stored_j
        self.gained = max(self.gained, -self._net_j / self._done_j)
        self.returned = max(self.returned, (self._lost_j - lost_j) / self._done_j)
        self._lost_j = max(self._lost_j, lost_j)


class Worlds:
    """Surfaces that overlap. Each acts for itself, so each has a world of its own here, which tells what it
    stores."""

    def __init__(self, surfaces: list[Surface], radius_m: float) -> None:
        self.each = [World([surface], radius_m) for surface in surfaces]
        self._soft = [1.0 / (2.0 * surface.stiffness) for surface in surfaces]

    def feel(self, place: Vector, velocity: Vector, time_s: float) -> Touch:
        force = torque = STILL
        for world in self.each:
            touch = world.feel(place, velocity, time_s)
            force, torque = along(force, 1.0, touch[0]), along(torque, 1.0, touch[1])
        return Touch(force, torque)

    def roll(self, rotation: Rotation) -> None:
        for world in self.each:
            world.roll(rotation)

    def stored_j(self, place: Vector) -> float:
        """In the springs, along and across: of a TCP at rest both are half the square of the force over the
        stiffness."""
        forces = [world.feel(place, STILL, 0.0).force for world in self.each]
        return sum(soft * dot(force, force) for soft, force in zip(self._soft, forces, strict=True))


def drawn_axis(rng: np.random.Generator) -> Vector:
    x, y, z = rng.normal(size=3).tolist()
    length = (x * x + y * y + z * z) ** 0.5
    return (x / length, y / length, z / length)


def drawn_surface(rng: np.random.Generator, name: str) -> Surface:
    """Somewhere round the origin."""
    halves = (10.0 ** rng.uniform(-3.0, -1.0, 3)).tolist()
    shape = (Plane(), Box(*halves), Sphere(halves[0]), Cylinder(*halves[:2]))[rng.integers(4)]
    place = rng.normal(size=3) * (0.0 if isinstance(shape, Plane) else 0.02)
    angles = rng.normal(size=3) * rng.choice([0.0, 0.0, 0.2, 2.0])
    return Surface(
        name,
        shape,
        transform_from_euler(*place.tolist(), *angles.tolist()),
        stiffness=float(10.0 ** rng.uniform(3.0, 5.5)),
        damping=float(rng.choice([0.0, 0.0, 0.1, 5.0])),
        friction=float(rng.choice([0.0, 0.1, 0.3, 1.5, 10.0])),
    )


def drawn_way(
    rng: np.random.Generator, ticks: int, is_free: Callable[[Vector], bool], waves_m: float = 0.06
) -> list[Vector]:
    """From a place that is free through all of it and back, in waves large or small."""
    t = np.linspace(0.0, 1.0, ticks + 1)[:, None]
    size = 10.0 ** rng.uniform(-3.5, np.log10(waves_m))
    waves = sum(rng.normal(size=3) * np.sin(pi * n * t) / n for n in range(1, 12))
    deep = rng.uniform(0.6, 1.2)
    while True:
        out = np.array(drawn_axis(rng)) * 0.25
        way = out * (1.0 - deep * np.sin(pi * t)) + size * np.asarray(waves)
        if is_free(tuple(way[0].tolist())):
            return [(x, y, z) for x, y, z in way.tolist()]


def is_bent(shape: Shape, radius_m: float) -> bool:
    """Whether a sphere of this radius on it may find its normal turned as it goes on."""
    return isinstance(shape, Sphere | Cylinder) or (isinstance(shape, Box) and radius_m > 0.0)


class ContactScene:
    """One to three surfaces that overlap round the origin, and a TCP that wanders through them."""

    def __init__(self, seed: int) -> None:
        rng = self._rng = np.random.default_rng(seed)
        placed = [drawn_surface(rng, str(number)) for number in range(int(rng.integers(1, 4)))]
        radius_m = float(rng.choice([0.0, 0.001, 0.005, 0.02]))
        self.bent = any(each.friction and is_bent(each.shape, radius_m) for each in placed)
        """Whether any of the surfaces is that, or has edges to a sphere, and friction."""
        self.world = Worlds(placed, radius_m)
        self.ledger = Ledger()
        self._ticks = int(rng.integers(50, 300))
        self._moves_surfaces = bool(rng.random() < 0.4)
        self._turns = float(rng.choice([0.0, 0.002, 0.02, 0.1]))

    def run(self) -> Ledger:
        """What came of it."""
        rng, world = self._rng, self.world
        way = drawn_way(rng, self._ticks, lambda at: world.feel(at, STILL, 0.0) == (STILL, STILL))
        rotation = IDENTITY.rotation
        world.roll(rotation)
        world.feel(way[0], STILL, TICK_S)
        for start, end in pairwise(way):
            if self._moves_surfaces and rng.random() < 0.5:
                self._move_surfaces(start)
            self._go(start, end)
            if self._turns:
                rotation = self._turn(rotation, end)
        return self.ledger

    def _go(self, start: Vector, end: Vector) -> None:
        step = minus(end, start)
        velocity = (step[0] / TICK_S, step[1] / TICK_S, step[2] / TICK_S)
        work_j = self.ledger.does(
            lambda share: -dot(self.world.feel(along(start, share, step), velocity, 0.0).force, step)
        )
        self.world.feel(end, velocity, TICK_S)
        self._rests(end, work_j)  # else what is stored is more than the friction of a TCP at rest holds

    def _rests(self, place: Vector, work_j: float) -> None:
        self.world.feel(place, STILL, TICK_S)
        self.ledger.done(work_j, self.world.stored_j(place))

    def _turn(self, before: Rotation, place: Vector) -> Rotation:
        axis, angle = drawn_axis(self._rng), float(self._rng.normal() * self._turns)

        def rate(share: float) -> float:
            self.world.roll(turn(axis, share * angle, before))
            return -dot(self.world.feel(place, STILL, 0.0).torque, axis) * angle

        work_j = self.ledger.does(rate)
        after = turn(axis, angle, before)
        self.world.roll(after)
        self._rests(place, work_j)
        return after

    def _move_surfaces(self, tcp: Vector) -> None:
        """All of them as one, by a screw about a point; the TCP stays."""
        rng, worlds = self._rng, self.world.each
        axis, angle = drawn_axis(rng), float(rng.normal() * rng.choice([0.0, 0.002, 0.02]))
        step: Vector = tuple((rng.normal(size=3) * 10.0 ** rng.uniform(-5.0, -3.0)).tolist())
        centre: Vector = tuple((rng.normal(size=3) * 0.1).tolist())
        before = [surface for world in worlds for surface in world.surfaces.values()]

        def put(share: float) -> Vector:
            """Where the centre is then."""
            turned, middle = rotation_about(axis, share * angle), along(centre, share, step)
            for world, (name, _, pose, *_) in zip(worlds, before, strict=True):
                place = along(middle, 1.0, rotate(turned, minus(pose.translation, centre)))
                world.move(name, Transform(multiply(turned, pose.rotation), place))
            return middle

        def rate(share: float) -> float:
            arm = minus(tcp, put(share))
            return work(self.world.feel(tcp, STILL, 0.0), arm, step, axis, angle)

        work_j = self.ledger.does(rate)
        put(1.0)
        self._rests(tcp, work_j)


def contact(seed: int) -> dict[str, float]:
    """What of the work was gained and came back."""
    scene = ContactScene(seed)
    return checked(scene, scene.run())


def checked(scene: ContactScene, found: Ledger) -> dict[str, float]:
    assert found.gained <= ROUNDING, vars(found)
    assert found.returned <= (BENT if scene.bent else ROUNDING), vars(found)
    return {"gained": found.gained, f"returned, {'bent' if scene.bent else 'flat'}": found.returned}


@settings(max_examples=some(250), deadline=None)
@given(st.integers(0, 10**6))
def test_nobody_gets_back_more_than_was_put_in(seed: int) -> None:
    contact(seed)

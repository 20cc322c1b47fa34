"""Does contact give anybody energy? Random scenes by a seed, on the bare core: cheap enough for thousands.

`python -m tests.energy_hunting contact 0 10000` hunts. A hand moves the TCP, or a part that is held, through
surfaces and turns it, and another hand moves the surfaces. What both have put in by some time, less what
they have got back, must at no time be less than nothing; nor may what has been lost, that less what is
stored in springs, ever come back. The work of a tick is an integral over the way of the tick, with the memory
of its beginning; where forces have a kink the way is halved until the rest is rounding.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from itertools import pairwise
from math import pi

import numpy as np

from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.world_kernel import World
from iiwa_sim.frames import (
    IDENTITY,
    Rotation,
    Transform,
    Vector,
    apply,
    multiply,
    rotate,
    rotation_about,
    transform_from_euler,
)
from iiwa_sim.handling.part import Part
from iiwa_sim.handling.touching import Touching
from iiwa_sim.wrench import NO_TOUCH, Touch

TICK_S = 0.002
STILL: Vector = (0.0, 0.0, 0.0)
ROUNDING = 1e-6
"""Of the work that has been done: integrals are found to that."""
LEAST_J = 1e-9
_HALVINGS = 40


def integral(rate: Callable[[float], float], rounding: float) -> float:
    """Of a rate from 0 to 1, by Simpson's rule, halved where the halves say otherwise."""
    first, middle, last = rate(0.0), rate(0.5), rate(1.0)
    return _between(rate, 0.0, first, 0.5, middle, 1.0, last, rounding, _HALVINGS)


def _between(
    rate: Callable[[float], float],
    a: float,
    at_a: float,
    m: float,
    at_m: float,
    b: float,
    at_b: float,
    rounding: float,
    left: int,
) -> float:
    whole = (b - a) / 6.0 * (at_a + 4.0 * at_m + at_b)
    low, high = 0.5 * (a + m), 0.5 * (m + b)
    at_low, at_high = rate(low), rate(high)
    halves = (b - a) / 12.0 * (at_a + 4.0 * at_low + 2.0 * at_m + 4.0 * at_high + at_b)
    greatest = max(abs(at_a), abs(at_low), abs(at_m), abs(at_high), abs(at_b))
    if abs(halves - whole) <= max(rounding, 1e-11 * (b - a) * greatest) or not left:
        return halves + (halves - whole) / 15.0
    return _between(rate, a, at_a, low, at_low, m, at_m, rounding, left - 1) + _between(
        rate, m, at_m, high, at_high, b, at_b, rounding, left - 1
    )


def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def turn(axis: Vector, angle: float, rotation: Rotation) -> Rotation:
    return multiply(rotation_about(axis, angle), rotation) if angle else rotation


class Ledger:
    """What has been put in, what of it is stored, and what is lost: that must never become less again."""

    def __init__(self) -> None:
        self._net_j = 0.0
        self._done_j = LEAST_J
        self._lost_j = 0.0
        self.gained = 0.0
        """The most that had been got back beyond what had been put in: as all here, a part of the most that
        had been put in by then."""
        self.returned = 0.0
        """The most that came back of what had been lost."""

    @property
    def rounding_j(self) -> float:
        """To which the work of a tick is to be found."""
        return 1e-2 * ROUNDING * self._done_j

    def done(self, work_j: float, stored_j: float) -> None:
        """Somebody has done this, and so much is in springs now."""
        self._net_j += work_j
        self._done_j = max(self._done_j, self._net_j)
        lost_j = self._net_j - stored_j
        self.gained = max(self.gained, -self._net_j / self._done_j)
        self.returned = max(self.returned, (self._lost_j - lost_j) / self._done_j)
        self._lost_j = max(self._lost_j, lost_j)


def is_bent(shape: Shape, radius_m: float) -> bool:
    """Whether a sphere of this radius on it may find its normal turned as it goes on."""
    return isinstance(shape, Sphere | Cylinder) or (isinstance(shape, Box) and radius_m > 0.0)


class Worlds:
    """Surfaces that overlap. Each acts for itself, so each has a world of its own here, which tells what it
    stores."""

    def __init__(self, surfaces: list[Surface], radius_m: float) -> None:
        self.radius_m = radius_m
        self._worlds = [World([each], radius_m) for each in surfaces]
        self._soft = [1.0 / (2.0 * each.stiffness) for each in surfaces]

    @property
    def poses(self) -> list[Transform]:
        return [each.pose for world in self._worlds for each in world.surfaces.values()]

    def move(self, poses: list[Transform]) -> None:
        for world, pose in zip(self._worlds, poses, strict=True):
            (name,) = world.surfaces
            world.move(name, pose)

    def roll(self, rotation: Rotation) -> None:
        for world in self._worlds:
            world.roll(rotation)

    def feel(self, place: Vector, velocity: Vector, time_s: float) -> Touch:
        fx = fy = fz = tx = ty = tz = 0.0
        for world in self._worlds:
            touch = world.feel(place, velocity, time_s)
            if touch is not NO_TOUCH:
                (ax, ay, az), (bx, by, bz) = touch
                fx, fy, fz, tx, ty, tz = fx + ax, fy + ay, fz + az, tx + bx, ty + by, tz + bz
        return Touch((fx, fy, fz), (tx, ty, tz))

    def stored_j(self, place: Vector) -> float:
        """In the springs, along and across: of a TCP at rest both are half the square of the force over the
        stiffness."""
        forces = [world.feel(place, STILL, 0.0).force for world in self._worlds]
        return sum(soft * dot(force, force) for soft, force in zip(self._soft, forces, strict=True))


def drawn_axis(rng: np.random.Generator) -> Vector:
    x, y, z = rng.normal(size=3).tolist()
    length = (x * x + y * y + z * z) ** 0.5
    return (x / length, y / length, z / length)


def drawn_surface(rng: np.random.Generator, name: str) -> Surface:
    """Somewhere round the origin."""
    shape = drawn_shape(rng)
    place = rng.normal(size=3) * (0.0 if isinstance(shape, Plane) else 0.02)
    angles = rng.normal(size=3) * rng.choice([0.0, 0.0, 0.2, 2.0])
    return Surface(
        name,
        shape,
        transform_from_euler(*place.tolist(), *angles.tolist()),
        float(10.0 ** rng.uniform(3.0, 5.5)),
        float(rng.choice([0.0, 0.0, 0.1, 5.0])),
        float(rng.choice([0.0, 0.1, 0.3, 1.5, 10.0])),
    )


def drawn_shape(rng: np.random.Generator) -> Shape:
    halves = (10.0 ** rng.uniform(-3.0, -1.0, 3)).tolist()
    kind = rng.integers(4)
    if kind == 0:
        return Plane()
    if kind == 1:
        return Box(*halves)
    return Sphere(halves[0]) if kind == 2 else Cylinder(*halves[:2])


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


class ContactScene:
    """One to three surfaces that overlap round the origin, and a TCP that wanders through them."""

    def __init__(self, seed: int) -> None:
        rng = self._rng = np.random.default_rng(seed)
        self._placed = [drawn_surface(rng, str(number)) for number in range(int(rng.integers(1, 4)))]
        self.world = Worlds(self._placed, float(rng.choice([0.0, 0.001, 0.005, 0.02])))
        self.ledger = Ledger()
        self._ticks = int(rng.integers(50, 300))
        self._moves_surfaces = bool(rng.random() < 0.4)
        self._turns = float(rng.choice([0.0, 0.002, 0.02, 0.1]))

    @property
    def bent(self) -> bool:
        """Whether any of the surfaces is that, or has edges to a sphere, and friction."""
        radius_m = self.world.radius_m
        return any(each.friction and is_bent(each.shape, radius_m) for each in self._placed)

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
        world = self.world
        (ax, ay, az), (bx, by, bz) = start, end
        step = (bx - ax, by - ay, bz - az)
        velocity = (step[0] / TICK_S, step[1] / TICK_S, step[2] / TICK_S)

        def rate(share: float) -> float:
            place = (ax + share * step[0], ay + share * step[1], az + share * step[2])
            return -dot(world.feel(place, velocity, 0.0).force, step)

        work_j = integral(rate, self.ledger.rounding_j)
        world.feel(end, velocity, TICK_S)
        world.feel(end, STILL, TICK_S)  # else what is stored is more than the friction of a TCP at rest holds
        self.ledger.done(work_j, world.stored_j(end))

    def _turn(self, before: Rotation, place: Vector) -> Rotation:
        world, rng = self.world, self._rng
        axis, angle = drawn_axis(rng), float(rng.normal() * self._turns)

        def rate(share: float) -> float:
            world.roll(turn(axis, share * angle, before))
            return -dot(world.feel(place, STILL, 0.0).torque, axis) * angle

        work_j = integral(rate, self.ledger.rounding_j)
        after = turn(axis, angle, before)
        world.roll(after)
        world.feel(place, STILL, TICK_S)
        self.ledger.done(work_j, world.stored_j(place))
        return after

    def _move_surfaces(self, tcp: Vector) -> None:
        """All of them as one, by a screw about a point; the TCP stays."""
        rng, world = self._rng, self.world
        axis, angle = drawn_axis(rng), float(rng.normal() * rng.choice([0.0, 0.002, 0.02]))
        x, y, z = (rng.normal(size=3) * 10.0 ** rng.uniform(-5.0, -3.0)).tolist()
        cx, cy, cz = (rng.normal(size=3) * 0.1).tolist()
        before = world.poses
        ax, ay, az = axis

        def put(share: float) -> None:
            turned = rotation_about(axis, share * angle)
            after = []
            for pose in before:
                px, py, pz = pose.translation
                qx, qy, qz = rotate(turned, (px - cx, py - cy, pz - cz))
                place = (qx + cx + share * x, qy + cy + share * y, qz + cz + share * z)
                after.append(Transform(multiply(turned, pose.rotation), place))
            world.move(after)

        def rate(share: float) -> float:
            put(share)
            force, torque = world.feel(tcp, STILL, 0.0)
            lx, ly, lz = tcp[0] - cx - share * x, tcp[1] - cy - share * y, tcp[2] - cz - share * z
            goes = (x, y, z)
            swung = (ay * lz - az * ly, az * lx - ax * lz, ax * ly - ay * lx)
            return dot(force, goes) + angle * (dot(force, swung) + dot(torque, axis))

        work_j = integral(rate, self.ledger.rounding_j)
        put(1.0)
        world.feel(tcp, STILL, TICK_S)
        self.ledger.done(work_j, world.stored_j(tcp))


class HeldScene:
    """A part in jaws that do not give way, and what it touches at its corners, its rims, or as a ball."""

    def __init__(self, seed: int) -> None:
        rng = self._rng = np.random.default_rng(seed)
        halves = (10.0 ** rng.uniform(-2.3, -1.3, 3)).tolist()
        shape = (Box(*halves), Cylinder(*halves[:2]), Sphere(halves[0]))[rng.integers(3)]
        self.part = Part("it", shape, 1.0, float(rng.choice([0.0, 0.1, 0.5, 2.0])), 10.0 ** rng.uniform(4, 6))
        self._placed = drawn_surface(rng, "0")
        self._touching = Touching(self.part, upright=bool(rng.random() < 0.5))
        soft = 1.0 / (1.0 / self._placed.stiffness + 1.0 / self.part.stiffness)
        self._soft = 0.5 * self._touching._points.at_once / soft
        self._round = self._touching._points.radius_m > 0.0
        self.ledger = Ledger()
        self._turns = float(rng.choice([0.0, 0.002, 0.02]))

    @property
    def bent(self) -> bool:
        """Whether the surface is that, or has edges to the spheres of the part: where a point that is turned
        meets it is found on the straight line between two ticks."""
        return is_bent(self._placed.shape, self._touching._points.radius_m)

    def run(self) -> Ledger:
        """What came of it."""
        rng, touching = self._rng, self._touching
        ticks = int(rng.integers(200, 400))
        rotation = turn(drawn_axis(rng), float(rng.uniform(0.0, pi)) * rng.integers(2), IDENTITY.rotation)
        way = drawn_way(
            rng, ticks, lambda place: self._placed.nearest(*place)[0] > self.part.shape.extent, 0.03
        )
        before = Transform(rotation, way[0])
        touching.step(before, lambda: [self._placed], TICK_S)
        for place in way[1:]:
            axis, angle = drawn_axis(rng), float(rng.normal() * self._turns)
            before = self._go(before, place, axis, angle)
        return self.ledger

    def _go(self, before: Transform, end: Vector, axis: Vector, angle: float) -> Transform:
        touching = self._touching
        worlds, places = touching._worlds, touching._points.places
        start = before.translation
        step = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
        after = Transform(turn(axis, angle, before.rotation), end)

        def rate(share: float) -> float:
            rotation = turn(axis, share * angle, before.rotation)
            middle = (start[0] + share * step[0], start[1] + share * step[1], start[2] + share * step[2])
            work = 0.0
            for point, world in worlds.items():
                if self._round:
                    world.roll(rotation)
                x, y, z = rotate(rotation, places[point])
                place = (middle[0] + x, middle[1] + y, middle[2] + z)
                force, torque = world.feel(place, STILL, 0.0)
                ax, ay, az = axis
                swung = (ay * z - az * y, az * x - ax * z, ax * y - ay * x)
                work -= dot(force, step) + angle * (dot(force, swung) + dot(torque, axis))
            return work

        work_j = integral(rate, self.ledger.rounding_j) if worlds else 0.0
        touching.step(after, lambda: [self._placed], TICK_S)
        touching.step(after, lambda: [self._placed], TICK_S)  # at rest, as in contact scenes
        self.ledger.done(work_j, sum(self._stored(after)))
        return after

    def _stored(self, pose: Transform) -> Iterator[float]:
        for point, world in self._touching._worlds.items():
            force = world.feel(apply(pose, self._touching._points.places[point]), STILL, 0.0).force
            yield self._soft * dot(force, force)


SCENES = {"contact": ContactScene, "held": HeldScene}


def main() -> None:
    kind = SCENES[sys.argv[1]]
    first, count = map(int, sys.argv[2:4])
    most = {False: [0.0, 0.0], True: [0.0, 0.0]}
    for seed in range(first, first + count):
        scene = kind(seed)
        found = scene.run()
        if found.gained > ROUNDING or (found.returned > ROUNDING and not scene.bent):
            sys.stdout.write(f"{seed}: gained {found.gained:.1e}, returned {found.returned:.1e}\n")
        now = most[scene.bent]
        now[:] = [max(now[0], found.gained), max(now[1], found.returned)]
    for bent, (gained, returned) in most.items():
        kinds = "bent" if bent else "flat"
        sys.stdout.write(f"{kinds}: gained {gained:.1e}, returned {returned:.1e} of the work\n")


if __name__ == "__main__":
    main()

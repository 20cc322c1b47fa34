"""What surfaces do to a part that is held: at its corners, its rims, or as spheres."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cos, dist, pi, sin
from typing import Any, NamedTuple

from iiwa_sim.contact.at_tcp_kernel import farthest_way
from iiwa_sim.contact.shapes import Box, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.world_kernel import World, feel_all
from iiwa_sim.frames import Transform, Vector, apply
from iiwa_sim.handling.part import LEVEL, Part

NEAR_M = 0.05
"""Surfaces farther away are not looked at until the part has come so far."""
FAR_M = 0.02
"""Of surfaces farther away than this it is not asked how far which point is."""
CLOSE_M = 0.005
"""Points that are twice as far from all of them (m), and are pushed by none, come to them as if for the first
time."""
STILL: Vector = (0.0, 0.0, 0.0)
RIM = 8
"""Points on each rim of a cylinder."""
_RIM = [(cos(2.0 * pi * k / RIM), sin(2.0 * pi * k / RIM)) for k in range(RIM)]


class Points(NamedTuple):
    """Small spheres that stand for a part."""

    places: tuple[Vector, ...]
    """In the part (m)."""
    radius_m: float
    at_once: int
    """How many of them touch a face on which it lies: each has this part of the stiffness."""


def points_of(part: Part, upright: bool) -> Points:
    """The points at which a part touches: of a cylinder its rims where it is `upright`, else two spheres."""
    shape = part.shape
    if isinstance(shape, Sphere):
        return Points(((0.0, 0.0, 0.0),), shape.radius, 1)
    if isinstance(shape, Box):
        ends = ((-half, half) for half in shape)
        xs, ys, zs = ends
        return Points(tuple((x, y, z) for x in xs for y in ys for z in zs), 0.0, 4)
    r, h = shape
    if upright:
        return Points(tuple((r * c, r * s, z) for z in (-h, h) for c, s in _RIM), 0.0, RIM)
    end = max(0.0, h - r)
    return Points(((0.0, 0.0, -end), (0.0, 0.0, end)), r, 2)


class Touching:
    """What acts on one part, tick by tick: a force (N) and a torque (Nm) about its middle, in base axes."""

    def __init__(self, part: Part, upright: bool) -> None:
        """It has touched nothing before."""
        self._part = part
        self._points = points_of(part, upright)
        self._extent = part.shape.extent
        self._looked: Vector | None = None  # where its middle was when surfaces were looked for
        self._near: dict[str, Surface] = {}  # those found then, as it feels them
        self._measured: Transform | None = None  # where it was when the distances of points were measured
        self._known_m = 0.0  # so far points may go from there before that tells nothing any more
        self._free_m = 0.0  # so far points may go from where they are, and touch nothing for sure
        self._worlds: dict[int, World] = {}  # of the points that were close then
        self._places: dict[int, Vector] = {}  # of these, in the tick before
        self.force: Vector = STILL
        self.torque: Vector = STILL
        self.besides: tuple[Vector, Vector] | None = None
        """What else pushes it in this tick, at other places than its points: force and torque."""

    def look_again(self) -> None:
        """Surfaces may have come, moved or gone."""
        self._looked, self._free_m = None, 0.0

    def slides(self) -> None:
        """It goes some way that `passes` is not told of."""
        self._free_m = 0.0

    def forget(self) -> None:
        """It has been put somewhere else, and has touched nothing before."""
        self._looked = self._measured = None
        self._free_m = 0.0
        self._worlds, self._places = {}, {}
        self.force = self.torque = STILL

    def pressed_from_above(self, name: str) -> bool:
        """Whether a surface of this name pushes it straight up, where it has been last."""
        worlds = (each for each in self._worlds.values() if name in each.surfaces)
        return any(each.touched(name) and each.outward(name)[2] > 1.0 - LEVEL for each in worlds)

    def stored_j(self, pose: Transform) -> float:
        """What would be in its springs at a pose close to the last one; nothing remembers that."""
        soft = 0.0
        for point, world in self._worlds.items():
            (x, y, z), _ = world.feel(apply(pose, self._points.places[point]), STILL, 0.0)
            if x or y or z:
                least = min(each.stiffness for each in world.surfaces.values())
                soft += (x * x + y * y + z * z) / least
        return 0.5 * soft

    def memory(self) -> object:
        """What surfaces remember of it, to be compared."""
        return [world.memory() for world in self._worlds.values()]

    def kept(self) -> object:
        """All that it remembers, to be brought back."""
        worlds = {point: world.kept() for point, world in self._worlds.items()}
        places = dict(self._places), self._looked, self._measured, self._known_m
        return worlds, dict(self._near), places, self.force, self.torque

    def restore(self, kept: Any) -> None:
        """Remember that again, among the same surfaces."""
        worlds, near, places, self.force, self.torque = kept
        was, self._looked, self._measured, self._known_m = places
        self._near, self._places, self._worlds, self._free_m = dict(near), dict(was), {}, 0.0
        for point, memory in worlds.items():
            world = self._worlds[point] = World(self._near.values(), self._points.radius_m)
            world.restore(memory)

    @property
    def close(self) -> bool:
        """Whether it may touch something in the next tick."""
        return bool(self._worlds)

    @property
    def pushed(self) -> bool:
        """Whether anything has pushed it in the last tick."""
        return self.force != STILL

    def passes(self, way_m: float) -> bool:
        """A tick has brought no point of it farther than that: whether that is all, and `step` has nothing
        to do: it touches nothing, and nothing is to be looked for."""
        self._free_m -= way_m
        return self._free_m > 0.0 and self.besides is None

    def step(self, pose: Transform, surfaces: Callable[[], Sequence[Surface]], tick_s: float) -> None:
        """A tick has brought it to `pose`; the surfaces that there are are asked for now and then."""
        middle, looked, before = pose.translation, self._looked, self._measured
        gone_m = 0.0 if looked is None else dist(middle, looked)
        if looked is None or gone_m > NEAR_M:
            self._look(middle, surfaces())
            gone_m, before = 0.0, self._measured
        turned_m = 0.0 if before is None else farthest_way(before, pose, self._extent)
        if before is None or turned_m > self._known_m:
            self._measure(pose)
            turned_m = 0.0
        self._free_m = 0.0
        if not self._worlds:
            self.force, self.torque = (STILL, STILL) if self.besides is None else self.besides
            if self.besides is None:
                self._free_m = min(NEAR_M - gone_m, self._known_m - turned_m)
            return
        besides = self.besides or (STILL, STILL)
        places, own = self._places, self._points.places
        self.force, self.torque = feel_all(self._worlds, own, places, pose, tick_s, besides)

    def _look(self, middle: Vector, surfaces: Sequence[Surface]) -> None:
        """Find the surfaces that may be touched before it has gone `NEAR_M`."""
        self._looked = middle
        reach = self._extent + 2.0 * NEAR_M
        points, part = self._points, self._part
        pushing = {name for world in self._worlds.values() for name in _touched(world)}
        near = {
            each.name: each._replace(
                stiffness=1.0 / (1.0 / each.stiffness + 1.0 / part.stiffness) / points.at_once,
                friction=part.friction,
            )
            for each in surfaces
            if each.name in pushing
            or (
                dist(middle, each.pose.translation) - each.shape.extent <= reach
                and each.nearest(*middle)[0] <= reach
            )
        }
        if near != self._near:
            for world in self._worlds.values():
                _change(world, self._near, near)
            self._near, self._measured = near, None

    def _measure(self, pose: Transform) -> None:
        """Find which points are close to surfaces, and how far the others may go before that changes."""
        self._measured = pose
        radius, near = self._points.radius_m, self._near.values()
        middle, reach = pose.translation, radius + FAR_M
        away = [(each, each.nearest(*middle)[0] - self._extent) for each in near]
        close = [each for each, least_m in away if least_m <= reach]
        others_m = min((least_m for _, least_m in away if least_m > reach), default=2.0 * NEAR_M)
        self._known_m = NEAR_M
        for point, own in enumerate(self._points.places):
            place = apply(pose, own)
            away_m = min((each.nearest(*place)[0] for each in close), default=others_m)
            away_m = min(away_m, others_m) - radius
            world = self._worlds.get(point)
            if away_m > 2.0 * CLOSE_M and not (world is not None and _touched(world)):
                self._known_m = min(self._known_m, away_m - CLOSE_M)
                self._worlds.pop(point, None)
                self._places.pop(point, None)
            else:
                self._known_m = min(self._known_m, CLOSE_M)
                if world is None:
                    self._worlds[point] = World(near, radius)


def _touched(world: World) -> list[str]:
    """The names of those that push, also of one through which a point has been pressed."""
    return [name for name in world.surfaces if world.touched(name)]


def _change(world: World, before: dict[str, Surface], after: dict[str, Surface]) -> None:
    """Other surfaces are near; those that were so before remember what they do."""
    for name in before:
        if name not in after:
            world.remove(name)
    for name, now in after.items():
        was = before.get(name)
        if was is None or now != was._replace(pose=now.pose):
            world.put(now)
        elif now != was:
            world.move(name, now.pose)

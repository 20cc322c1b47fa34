"""What surfaces do to a part that is held: at its corners, its rims, or as spheres."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, dist, pi, sin
from typing import NamedTuple

from iiwa_sim.contact.at_tcp_kernel import velocity_between
from iiwa_sim.contact.shapes import Box, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.world_kernel import World
from iiwa_sim.frames import Transform, Vector, apply
from iiwa_sim.handling.part import Part
from iiwa_sim.wrench import NO_TOUCH

NEAR_M = 0.05
"""Surfaces farther away are not looked at until the part has come so far."""
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
    """Those of a part; a cylinder has rims where it is `upright`, and lies on two spheres where it is not."""
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

    def __init__(self, part: Part, upright: bool, pose: Transform) -> None:
        """It is at `pose`, and has touched nothing before."""
        self._part = part
        self._points = points_of(part, upright)
        self._extent = part.shape.extent
        self._looked: Vector | None = None  # where its middle was when surfaces were looked for
        self._near: list[Surface] = []
        self._worlds: list[World] = []
        self._places = self._at(pose)
        self.force: Vector = (0.0, 0.0, 0.0)
        self.torque: Vector = (0.0, 0.0, 0.0)

    def look_again(self) -> None:
        """Surfaces may have come, moved or gone."""
        self._looked = None

    def memory(self) -> object:
        """What surfaces remember of it, to be compared."""
        return [world.memory() for world in self._worlds]

    def step(self, pose: Transform, surfaces: Sequence[Surface], tick_s: float) -> None:
        """A tick has brought it to `pose`."""
        middle = pose.translation
        if self._looked is None or dist(middle, self._looked) > NEAR_M:
            self._look(middle, surfaces)
        if not self._worlds:
            self._places = ()
            self.force = self.torque = (0.0, 0.0, 0.0)
            return
        places = self._at(pose)
        before = self._places or places
        self._places = places
        fx = fy = fz = tx = ty = tz = 0.0
        for world, was, place in zip(self._worlds, before, places, strict=True):
            touch = world.feel(place, velocity_between(was, place, tick_s), tick_s)
            if touch is NO_TOUCH:
                continue
            (ax, ay, az), (bx, by, bz) = touch
            x, y, z = (a - b for a, b in zip(place, middle, strict=True))
            fx, fy, fz = fx + ax, fy + ay, fz + az
            tx += bx + y * az - z * ay
            ty += by + z * ax - x * az
            tz += bz + x * ay - y * ax
        self.force, self.torque = (fx, fy, fz), (tx, ty, tz)

    def _at(self, pose: Transform) -> tuple[Vector, ...]:
        return tuple(apply(pose, place) for place in self._points.places)

    def _look(self, middle: Vector, surfaces: Sequence[Surface]) -> None:
        """Find the surfaces that may be touched before it has gone `NEAR_M`."""
        self._looked = middle
        reach = self._extent + 2.0 * NEAR_M
        near = [each for each in surfaces if each.nearest(*middle)[0] <= reach]
        if near == self._near:
            return
        self._near = near
        points, part = self._points, self._part
        softened = [
            each._replace(
                stiffness=1.0 / (1.0 / each.stiffness + 1.0 / part.stiffness) / points.at_once,
                friction=part.friction,
            )
            for each in near
        ]
        self._worlds = [World(softened, points.radius_m) for _ in points.places] if near else []

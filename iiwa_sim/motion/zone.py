"""Where a move may leave its path to blend into the next one: a zone round its target."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from copy import copy
from math import dist
from typing import Self

from iiwa_sim.frames import Vector
from iiwa_sim.motion.sampled_path import Joints, Path

HALF = 0.49
"""A path is left to blends up to this part from either end, so that it is never all blends."""
STANDSTILL = 1e-7  # m or rad
_PLACES = 6  # looked at between a target and half of the way, to find where the path leaves the zone
_NARROWINGS = 5
AIM = 0.99  # of a radius: exactly at its border rounding would decide


class Zone(ABC):
    """A neighbourhood of a target: everything no farther from it than `radius`."""

    radius: float
    """In the unit of `distance`."""

    @abstractmethod
    def distance(self, joints: Sequence[float]) -> float:
        """How far joint positions (rad) are from the target."""

    def clipped(self, first: Path, second: Path) -> Self:
        """The zone, no larger than reaches to the half of the paths to and from its target."""
        halves = self.distance(first.joints(1.0 - HALF)), self.distance(second.joints(HALF))
        clipped = copy(self)
        # A line that turns on the spot goes nowhere: there half of the turn is the only bound.
        clipped.radius = min([self.radius, *(half for half in halves if half > STANDSTILL)])
        return clipped


class Sphere(Zone):
    """All places where the TCP is no farther than a radius from where it is at the target."""

    def __init__(self, radius_m: float, target: Joints, tcp: Callable[[Sequence[float]], Vector]) -> None:
        """`tcp` gives the position of the TCP (m) for joint positions (rad)."""
        self.radius = radius_m
        self._tcp = tcp
        self._centre = tcp(target)

    def distance(self, joints: Sequence[float]) -> float:
        """In m."""
        return dist(self._tcp(joints), self._centre)


class JointBall(Zone):
    """All places where no joint is farther from the target than a part of the largest way of a move."""

    def __init__(self, part: float, start: Joints, target: Joints) -> None:
        self.radius = part * max([abs(b - a) for a, b in zip(start, target, strict=True)])
        self._centre = target

    def distance(self, joints: Sequence[float]) -> float:
        """In rad."""
        return max([abs(b - a) for a, b in zip(joints, self._centre, strict=True)])


def way_inside(path: Path, zone: Zone, *, at_end: bool) -> float:
    """The part of a path, up to `HALF`, that lies in a zone round one of its ends without leaving it."""
    if isinstance(zone, Sphere) and path.tcp_length_m is not None:
        return HALF if zone.radius >= HALF * path.tcp_length_m else zone.radius / path.tcp_length_m

    def distance(part: float) -> float:
        return zone.distance(path.joints(1.0 - part if at_end else part))

    inside, near = 0.0, 0.0
    for k in range(1, _PLACES + 1):
        outside = HALF * k / _PLACES
        far = distance(outside)
        if far > zone.radius:
            break
        inside, near = outside, far
    else:
        return HALF
    for _ in range(_NARROWINGS):
        part = inside + (outside - inside) * max(AIM * zone.radius - near, 0.0) / (far - near)
        part = max(part, (9.0 * inside + outside) / 10.0)
        here = distance(part)
        if here > zone.radius:
            outside, far = part, here
        else:
            inside, near = part, here
    return inside

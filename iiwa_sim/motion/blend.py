"""Blends: the second of two moves sets out while the first one still goes to its target.

In a blend v goes from 0 to 1. The first move continues to its target as s = 1 - before F(1 - v), while the
second leaves it as s = after F(v). The displacement of the second is added to the joints of the first. F
grows with the third power of v up to v = rho, then with the second, up to F(1) = 1. A blend is a parabola
along which one velocity changes evenly into the other. Only for rho at either end the acceleration builds up.
The sum of two straight moves stays in any ball around the target that holds their ends, since
F(v) + F(1 - v) <= 1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import sqrt
from operator import truediv
from typing import NamedTuple

import numpy as np

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import Array, JointLimits
from iiwa_sim.motion.plan_kernel import Polynomial, shape
from iiwa_sim.robot.arm_kernel import Tcp

HALF = 0.49
"""A path is left to blends up to this part from either end, so that it is never all blends."""
_STANDSTILL = 1e-7  # m or rad
_PLACES = 12  # that are tried to find where a path first leaves a zone
_CLOSE = 1e-9  # in s
_INSIDE = [k / 8.0 for k in range(1, 8)]  # v at which a blend is checked
_ROUNDING = 1.000000001
SHARES = (1.0, 0.7, 0.4, 0.2)
"""Parts of what the zone allows, until the robot stays in it and within its position limits."""
SHORTEST_RAD = 1e-6
"""Least distance of the joints on either side of a blend; with less the robot stops at the target."""
SHORTEST_S = 0.004
"""A sharp blend that takes less on one side is a stop: so much is all that could be gained."""
SHORTEST_PART = 0.05
"""A blend whose one side takes less than this part of the other's time is a stop.
x would all but stand still where the sides meet, and the speed profile would not keep limits."""
LEAST_RHO = 0.1
GENTLE_RHO = 0.42
"""Largest rho at gentle turns, where speed hardly changes: with this the bend changes the least at once."""
LONGER = 0.5
"""Accelerations of a turn by less than a right angle build up longer by this times the cosine."""
SHARP = 0.5
"""Cosine of the sharpest turn with at most `GENTLE_RHO`.
From there to a right angle the largest rho grows to 1: one move then ends where the other begins."""


class Move(NamedTuple):
    """A move ready to run. Moves are numbered in the order in which they were accepted."""

    number: int
    path: Polynomial
    limits: JointLimits
    """Limits of the joints, velocities lowered to the speed of this move."""
    length_s: float
    """Time (s) that its path takes at the velocity limits of the joints; 0 if it goes nowhere."""
    zone: Zone | None
    """Region in which it may leave its path to blend into the next move; None to stop at its target."""
    again: Callable[[Joints], Move | None]
    """Plans a path to the same target from other joint positions (rad); gives None if there is none."""


class Blend(NamedTuple):
    """The sum of two moves around the target between them."""

    before: float
    """Part of the first move that is left when the second sets out."""
    after: float
    """Part of the second move that is done when the first ends."""
    rho: float
    """Part of the blend in which accelerations build up (0..1]."""


class Zone:
    """Everything no farther from a target than a radius."""

    def __init__(self, radius: float, centre: Sequence[float] | Array, tcp: Tcp | None) -> None:
        """The radius is a distance of the TCP (m), or of the farthest joint (rad) without a TCP."""
        self.radius = radius
        self._centre = np.array(centre)
        self._tcp = tcp

    def distances(self, joints: Array) -> Array:
        """Return the distances (m, or rad) of joint positions (m, n) from the target."""
        if self._tcp is None:
            farthest: Array = np.abs(joints - self._centre).max(axis=1)
            return farthest
        pose = self._tcp.pose
        off = np.array([pose(q).translation for q in joints.tolist()]) - self._centre
        distances: Array = np.sqrt((off * off).sum(axis=1))
        return distances

    def clipped(self, first: Polynomial, second: Polynomial) -> Zone:
        """Return this zone, reduced to end before the middle of the paths to and from its target."""
        halves = self.distances(np.array([first.joints(1.0 - HALF), second.joints(HALF)]))
        # A line that turns on the spot goes nowhere: half of its turn is the only bound.
        return Zone(min([self.radius, *halves[halves > _STANDSTILL].tolist()]), self._centre, self._tcp)

    def part_inside(self, path: Polynomial, *, at_end: bool) -> float:
        """Return the part of a path, up to `HALF`, from the target at one of its ends to the border."""
        if self._tcp is not None and path.tcp_length_m is not None:
            return HALF if self.radius >= HALF * path.tcp_length_m else self.radius / path.tcp_length_m

        def beyond(parts: Array) -> Array:
            joints = path.derivatives(1.0 - parts if at_end else parts)[0]
            return self.distances(joints) - self.radius

        parts = HALF * np.arange(1, _PLACES + 1) / _PLACES
        off = beyond(parts)
        if not (off > 0.0).any():
            return HALF
        k = int((off > 0.0).argmax())
        inside, outside = float(parts[k - 1]) if k else 0.0, float(parts[k])
        left, right = float(-off[k - 1]) if k else self.radius, float(off[k])
        while outside - inside > _CLOSE and left > _CLOSE * self.radius:
            # False position; a side that stays counts half.
            part = inside + (outside - inside) * left / (left + right)
            there = float(beyond(np.array([part]))[0])
            if there > 0.0:
                outside, right, left = part, there, 0.5 * left
            else:
                inside, left, right = part, -there, 0.5 * right
        return inside


def sphere(radius_m: float, target: Joints, tcp: Tcp) -> Zone:
    """Return all places where the TCP is within a radius (m) of its place at joint positions (rad)."""
    return Zone(radius_m, tcp.pose(target).translation, tcp)


def joint_ball(part: float, start: Joints, target: Joints) -> Zone:
    """Return all places where no joint is farther from the target than a part of the largest distance."""
    return Zone(part * max([abs(b - a) for a, b in zip(start, target, strict=True)]), target, None)


class _Side:
    """One end of a move, from or to which it goes as fast as its limits there allow."""

    def __init__(self, move: Move, *, at_end: bool) -> None:
        self.slope = move.path.derivatives(np.array([1.0 if at_end else 0.0]))[1, 0]  # dq/ds (n,)
        rates = list(map(abs, self.slope.tolist()))
        self.rate = max(rates)
        # Units of s per s, and so on.
        self.speed, self.acceleration, self.jerk = (
            1.0 / (max(map(truediv, rates, limit.tolist())) or 1e-300) for limit in move.limits
        )

    def time_s(self, part: float) -> float:
        """Return how long it takes to go a part of the path from rest."""
        building_s = self.acceleration / self.jerk
        # From rest to its full speed, then on evenly.
        rising_s = min(building_s, sqrt(2.0 * self.speed / self.jerk))
        gone = self.jerk * rising_s**3 / 6.0
        if part <= gone:
            return float((6.0 * part / self.jerk) ** (1.0 / 3.0))
        if rising_s < building_s:
            return rising_s + (part - gone) / self.speed
        # Then it has gone acceleration ((t - building / 2)^2 + building^2 / 12) / 2 after a time t.
        full_s = self.speed / self.acceleration
        gone = 0.5 * self.acceleration * (full_s * full_s + building_s * building_s / 12.0)
        if part <= gone:
            return 0.5 * building_s + sqrt(2.0 * part / self.acceleration - building_s * building_s / 12.0)
        return full_s + 0.5 * building_s + (part - gone) / self.speed


def half_times_s(move: Move) -> float:
    """Return how long both halves of a move take from and to rest, at the limits at its ends."""
    return _Side(move, at_end=False).time_s(0.5) + _Side(move, at_end=True).time_s(0.5)


def may_blend(first: Move, second: Move) -> bool:
    """Return whether the robot need not stop between two moves."""
    return first.zone is not None and second.length_s > 0.0


def blend(first: Move, second: Move, lowest: Array, highest: Array) -> Blend | None:
    """Return the blend between two moves; None if the robot has to stop at the target between them.

    `lowest` and `highest` are the position limits (rad, (n,)).
    """
    if first.zone is None or first.length_s == 0.0 or second.length_s == 0.0:
        return None
    zone = first.zone.clipped(first.path, second.path)
    before = zone.part_inside(first.path, at_end=True)
    after = zone.part_inside(second.path, at_end=False)
    ending, leaving = _Side(first, at_end=True), _Side(second, at_end=False)
    if ending.rate == 0.0 or leaving.rate == 0.0:
        return None
    start = second.path.derivatives(np.zeros(1))[0, 0]
    # The turn of the joints, each counted by its acceleration.
    one, other = ending.slope / first.limits.acceleration, leaving.slope / second.limits.acceleration
    cosine = float(one @ other) / sqrt(float(one @ one) * float(other @ other))
    for share in SHARES:
        found = Blend(
            share * before, share * after, _rho(ending, leaving, cosine, share * before, share * after)
        )
        if found.rho == 0.0:
            return None
        done = np.array([shape(v, found.rho, 0) for v in _INSIDE])
        q = first.path.derivatives(1.0 - found.before * done[::-1])[0]
        q += second.path.derivatives(found.after * done)[0] - start
        within = (q >= lowest).all() and (q <= highest).all()
        if within and (zone.distances(q) <= zone.radius * _ROUNDING).all():
            return found
    return None


def _rho(ending: _Side, leaving: _Side, cosine: float, before: float, after: float) -> float:
    """Return the rho that suits a blend between parts of two moves; 0 if these are too small for one."""
    if min(before * ending.rate, after * leaving.rate) < SHORTEST_RAD:
        return 0.0
    before_s, after_s = ending.time_s(before), leaving.time_s(after)
    if min(before_s, after_s) < SHORTEST_PART * max(before_s, after_s):
        return 0.0
    if cosine < SHARP and min(before_s, after_s) < SHORTEST_S:
        return 0.0
    wanted = ending.acceleration / ending.jerk * leaving.acceleration / leaving.jerk / (before_s * after_s)
    wanted = sqrt(wanted) * (1.0 + LONGER * max(cosine, 0.0))
    sharpness = min(max(1.0 - cosine / SHARP, 0.0), 1.0)
    return min(max(wanted, LEAST_RHO), GENTLE_RHO + (1.0 - GENTLE_RHO) * sharpness)

"""How a corner is rounded: the second of two moves sets out while the first one still goes to its end.

With v from 0 to 1 the first goes on to its target as s = 1 - before F(1 - v) while the second leaves it as
s = after F(v), and the joints are where the first is plus what the second has gone. F grows with the third
power of v up to v = rho, and then with the second, as far as F(1) = 1: F'' is v / rho, then even. So a corner
is a parabola along which one speed goes over evenly into the other, but for rho of it at either end, in which
the acceleration builds up. As F(v) + F(1 - v) <= 1, the sum of two straight ways stays in any ball around the
target that holds their ends.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.path.zone import Zone
from iiwa_sim.motion.queue.move import Move

SHARES = (1.0, 0.7, 0.4, 0.2)
"""Parts of what a zone allows that are tried, until the robot stays in it and within its position limits."""
PLACES = np.linspace(0.0, 1.0, 9)[1:-1]
"""v, where that is looked at; even, so that read backwards they are 1 - v."""
ROUNDING = 1.0 + 1e-9
SHORTEST_WAY_RAD = 1e-6
"""Of the joints on either side; to leave out less is to stop at the target."""
SHORTEST_S = 0.004
"""A sharp corner that takes less on one side is a stop: so much is all that could be gained."""
SHORTEST_PART = 0.05
"""A corner whose one side takes less than this part of the other's time is a stop: beside a way of
micrometres there is little to gain, and where the two sides meet, x would all but stand still, and clocks
would not hold limits.
"""
LEAST_RHO = 0.1
GENTLE_RHO = 0.35
"""The most at gentle turns: there speed hardly changes, and with this the bend changes the least at once."""
SHARP = 0.5
"""The cosine of a turn. Sharper ones, up to a right angle, are taken more and more as the end of one move and
the beginning of another, with as large a part of either as it takes to build up acceleration."""


_START, _END = np.zeros(1), np.ones(1)


class Corner(NamedTuple):
    """How two moves are added at the target between them."""

    before: float
    """The part of the first move that is left when the second sets out,"""
    after: float
    """the part of the second that is done when the first ends;"""
    rho: float
    """and the part of the corner in which accelerations build up (0..1]."""


def shape(v: Array, rho: Array | float) -> Array:
    """F at v from 0 to 1, where rho may differ (arrays of shapes that go together)."""
    height = 1.0 / (0.5 - 0.5 * rho + rho * rho / 6.0)
    beyond = np.maximum(v - rho, 0.0)
    within: Array = np.minimum(v, rho)
    f: Array = height * (within**3 / (6.0 * rho) + 0.5 * beyond * (rho + beyond))
    return f


def corner(
    first: Move, second: Move, lowest: Array, highest: Array, *, free: float = 1.0, share: float = 1.0
) -> Corner | None:
    """The corner between two moves; None where the robot has to stop at the target between them.

    `lowest` and `highest` are the position limits (rad, (n,)), `free` is the part of the first move that can
    still be changed, `share` the part of what the zone allows that is wanted.
    """
    if first.zone is None or first.length_s == 0.0 or second.length_s == 0.0:
        return None
    zone = first.zone.clipped(first.path, second.path)
    before = min(share * zone.part_inside(first.path, at_end=True), free)
    after = share * zone.part_inside(second.path, at_end=False)
    turn = _Turn.between(first, second)
    for smaller in SHARES:
        found = turn.rounded(smaller * before, smaller * after)
        if found is None or _keeps_inside(found, first, second, zone, lowest, highest):
            return found
    return None


class Setting(NamedTuple):
    """How a move sets out from a target, or comes to rest at it, as fast as its limits there allow."""

    way: float
    """Of the joint that goes farthest, rad per unit of s"""
    speed: float
    """Units of s per s, and so on"""
    acceleration: float
    jerk: float

    @classmethod
    def of(cls, move: Move, slope: Array) -> "Setting":
        """`slope` is dq/ds (n,) at the target."""
        way = np.abs(slope)
        return cls(float(way.max()), *(1.0 / (way / np.array(move.limits)).max(axis=1)).tolist())

    @property
    def building_s(self) -> float:
        """How long its acceleration takes to build up."""
        return self.acceleration / self.jerk

    def time_s(self, part: float) -> float:
        """How long it takes to go a part of the path from rest."""
        building_s = self.building_s
        # From rest to its full speed, then on evenly.
        rising_s = min(building_s, sqrt(2.0 * self.speed / self.jerk))
        gone = self.jerk * rising_s**3 / 6.0
        if part <= gone:
            return float((6.0 * part / self.jerk) ** (1.0 / 3.0))
        if rising_s < building_s:
            return rising_s + (part - gone) / self.speed
        # Then it has gone acceleration ((t - building / 2)^2 + building^2 / 12) / 2 after a time t.
        full_s = self.speed / self.acceleration + 0.5 * building_s
        gone = 0.5 * self.acceleration * ((full_s - 0.5 * building_s) ** 2 + building_s**2 / 12.0)
        if part <= gone:
            return 0.5 * building_s + sqrt(2.0 * part / self.acceleration - building_s**2 / 12.0)
        return full_s + (part - gone) / self.speed


class _Turn(NamedTuple):
    """What lies on either side of a target."""

    ending: Setting
    leaving: Setting
    cosine: float
    """of the angle by which the joints turn, each counted by its acceleration"""

    @classmethod
    def between(cls, first: Move, second: Move) -> "_Turn":
        end, start = first.path.derivatives(_END)[1][0], second.path.derivatives(_START)[1][0]
        one, other = end / first.limits.acceleration, start / second.limits.acceleration
        size = sqrt(float(one @ one) * float(other @ other))
        return cls(Setting.of(first, end), Setting.of(second, start), float(one @ other) / size)

    def rounded(self, before: float, after: float) -> Corner | None:
        """The corner with the rho that suits it; None where it is too small."""
        if min(before * self.ending.way, after * self.leaving.way) < SHORTEST_WAY_RAD:
            return None
        times_s = self.ending.time_s(before), self.leaving.time_s(after)
        if min(times_s) < SHORTEST_PART * max(times_s):
            return None
        if self.cosine < SHARP and min(times_s) < SHORTEST_S:
            return None
        wanted = min(self.ending.building_s / times_s[0], self.leaving.building_s / times_s[1])
        sharpness = min(max(1.0 - self.cosine / SHARP, 0.0), 1.0)
        most = GENTLE_RHO + (1.0 - GENTLE_RHO) * sharpness
        return Corner(before, after, min(max(wanted, LEAST_RHO), most))


def _keeps_inside(
    found: Corner, first: Move, second: Move, zone: Zone, lowest: Array, highest: Array
) -> bool:
    """Whether the robot stays in the zone and within its position limits, where that is looked at."""
    gone = shape(PLACES, found.rho)
    ending = first.path.derivatives(1.0 - found.before * gone[::-1])[0]
    leaving = second.path.derivatives(found.after * gone)[0]
    q = ending + (leaving - np.array(second.path.start))
    if (q < lowest).any() or (q > highest).any():
        return False
    return bool((zone.distances(q) <= zone.radius * ROUNDING).all())

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
from iiwa_sim.motion.path.polynomial import Polynomial
from iiwa_sim.motion.queue.move import Move
from iiwa_sim.motion.zone import Zone, way_inside

SHARES = (1.0, 0.7, 0.4, 0.2)
"""Parts of what a zone allows that are tried, until the robot stays in it and within its position limits."""
PLACES = np.linspace(0.0, 1.0, 9)[1:-1]
"""v, where that is looked at."""
ROUNDING = 1.0 + 1e-9
SHORTEST_WAY_RAD = 1e-6
"""Of the joints on either side; to leave out less is to stop at the target."""
SHORTEST_S = 0.004
"""A sharp corner that takes less on one side is a stop: so much is all that could be gained."""
LEAST_RHO = 0.1
GENTLE_RHO = 0.35
"""The most at gentle turns: there speed hardly changes, and with this the bend changes the least at once."""
SHARP = 0.5
"""The cosine of a turn. Sharper ones, up to a right angle, are taken more and more as the end of one move and
the beginning of another, with as large a part of either as it takes to build up acceleration."""


class Corner(NamedTuple):
    """How two moves are added at the target between them."""

    before: float
    """The part of the first move that is left when the second sets out,"""
    after: float
    """the part of the second that is done when the first ends;"""
    rho: float
    """and the part of the corner in which accelerations build up (0..1]."""


def shape(v: Array, rho: float) -> Array:
    """F at v (m,) from 0 to 1."""
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
    before = min(share * way_inside(first.path, zone, at_end=True), free)
    after = share * way_inside(second.path, zone, at_end=False)
    for smaller in SHARES:
        found = _rounded(first, second, smaller * before, smaller * after)
        if found is None or _keeps_inside(found, first, second, zone, lowest, highest):
            return found
    return None


def _rounded(first: Move, second: Move, before: float, after: float) -> Corner | None:
    """With the rho that suits it; None where it is too small."""
    end, start = _slope(first.path, 1.0), _slope(second.path, 0.0)
    if (
        before * float(np.abs(end).max()) < SHORTEST_WAY_RAD
        or after * float(np.abs(start).max()) < SHORTEST_WAY_RAD
    ):
        return None
    times_s = _time_s(first, end, before), _time_s(second, start, after)
    one, other = end / first.limits.acceleration, start / second.limits.acceleration
    cosine = float(one @ other) / sqrt(float(one @ one) * float(other @ other))
    if cosine < SHARP and min(times_s) < SHORTEST_S:
        return None
    most = GENTLE_RHO + (1.0 - GENTLE_RHO) * min(max(1.0 - cosine / SHARP, 0.0), 1.0)
    building_s = _building_s(first, end), _building_s(second, start)
    wanted = min(building / time for building, time in zip(building_s, times_s, strict=True))
    return Corner(before, after, min(max(wanted, LEAST_RHO), most))


def _slope(path: Polynomial, s: float) -> Array:
    """dq/ds (n,) at s."""
    slope: Array = path.derivatives(np.array([s]))[1][0]
    return slope


def _reach(limit: Array, slope: Array) -> float:
    """What a limit of the joints (n,) allows along a path."""
    return float(1.0 / (np.abs(slope) / limit).max())


def _building_s(move: Move, slope: Array) -> float:
    """How long acceleration takes to build up along a path."""
    return _reach(move.limits.acceleration, slope) / _reach(move.limits.jerk, slope)


def _time_s(move: Move, slope: Array, way: float) -> float:
    """How long the move takes from rest along a part of its path as straight as at its end, or to rest."""
    acceleration, jerk = _reach(move.limits.acceleration, slope), _reach(move.limits.jerk, slope)
    speed = _reach(move.limits.velocity, slope)
    building_s = acceleration / jerk
    # From rest to its full speed, then on evenly.
    rising_s = min(building_s, sqrt(2.0 * speed / jerk))
    gone = jerk * rising_s**3 / 6.0
    if way <= gone:
        return float((6.0 * way / jerk) ** (1.0 / 3.0))
    if rising_s < building_s:
        return rising_s + (way - gone) / speed
    # Then it has gone acceleration ((t - building / 2)^2 + building^2 / 12) / 2 after a time t.
    full_s = speed / acceleration + 0.5 * building_s
    gone = 0.5 * acceleration * ((full_s - 0.5 * building_s) ** 2 + building_s**2 / 12.0)
    if way <= gone:
        return 0.5 * building_s + sqrt(2.0 * way / acceleration - building_s**2 / 12.0)
    return full_s + (way - gone) / speed


def _keeps_inside(
    found: Corner, first: Move, second: Move, zone: Zone, lowest: Array, highest: Array
) -> bool:
    """Whether the robot stays in the zone and within its position limits, where that is looked at."""
    ending = first.path.derivatives(1.0 - found.before * shape(1.0 - PLACES, found.rho))[0]
    leaving = second.path.derivatives(found.after * shape(PLACES, found.rho))[0]
    q = ending + (leaving - np.array(second.path.start))
    if (q < lowest).any() or (q > highest).any():
        return False
    return all(zone.distance(joints) <= zone.radius * ROUNDING for joints in q.tolist())

"""What fits at a target between two moves, in loops; compiled by Cython. What a corner is: `corner.py`."""

# mypy: allow-untyped-decorators

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.path.piecewise_kernel import Polynomial
    from cython.cimports.iiwa_sim.motion.path.zone_kernel import Zone
    from cython.cimports.iiwa_sim.motion.queue.shapes_kernel import shape
    from cython.cimports.iiwa_sim.motion.timing.run_kernel import root
else:
    from iiwa_sim.motion.path.piecewise_kernel import Polynomial
    from iiwa_sim.motion.path.zone_kernel import Zone
    from iiwa_sim.motion.queue.shapes_kernel import shape
    from iiwa_sim.motion.timing.run_kernel import root

# Whether the robot stays in its zone is looked at between so many even parts of v.
PARTS = cython.declare(cython.int, 8)
ROUNDING = cython.declare(cython.double, 1.000000001)
# Of the joints (rad) on either side; to leave out less is to stop at the target.
SHORTEST_WAY_RAD = cython.declare(cython.double, 1e-6)
# A sharp corner that takes less on one side is a stop: so much is all that could be gained.
SHORTEST_S = cython.declare(cython.double, 0.004)
# A corner whose one side takes less than this part of the other's time is a stop: beside a way of micrometres
# there is little to gain, and where the two sides meet x would all but stand still, and clocks would not hold
# limits.
SHORTEST_PART = cython.declare(cython.double, 0.05)
LEAST_RHO = cython.declare(cython.double, 0.1)
# The most at gentle turns: there speed hardly changes, and with this the bend changes the least at once.
GENTLE_RHO = cython.declare(cython.double, 0.42)
# Times the cosine of a turn by less than a right angle: by such a part accelerations build up for longer.
LONGER = cython.declare(cython.double, 0.5)
# The cosine of a turn. Sharper ones, up to a right angle, are taken more and more as the end of one move and
# the beginning of another, with as large a part of either as it takes to build up acceleration.
SHARP = cython.declare(cython.double, 0.5)


@cython.cclass
class Side:
    """How a move sets out from a target, or comes to rest at it, as fast as its limits there allow."""

    path: Polynomial
    slope: cython.double[:, :, ::1]  # q, dq/ds (2, 1, n) at the target
    limit: cython.double[::1]  # of accelerations
    way: cython.double  # of the joint that goes farthest, rad per unit of s
    speed: cython.double  # units of s per s, and so on
    acceleration: cython.double
    jerk: cython.double

    def __init__(
        self,
        path: Polynomial,
        velocity: cython.double[::1],
        acceleration: cython.double[::1],
        jerk: cython.double[::1],
        at_end: cython.bint,
    ) -> None:
        """One side of a corner: a path, at its end or its beginning, and the limits (n,) of its move."""
        n: cython.Py_ssize_t = path.joint_count
        speed: cython.double = 0.0  # 1 over them
        building: cython.double = 0.0
        slowest: cython.double = 0.0
        self.path, self.limit = path, acceleration
        self.slope = np.empty((2, 1, n))
        self.way = 0.0
        rate = 1.0 if at_end else 0.0
        path.evaluate(rate, 1, self.slope, 0)
        for i in range(n):
            rate = fabs(self.slope[1, 0, i])
            self.way = max(self.way, rate)
            speed = max(speed, rate / velocity[i])
            building = max(building, rate / acceleration[i])
            slowest = max(slowest, rate / jerk[i])
        self.speed, self.acceleration, self.jerk = 1.0 / speed, 1.0 / building, 1.0 / slowest

    @cython.ccall
    def time_s(self, part: cython.double) -> cython.double:
        """How long it takes to go a part of the path from rest."""
        building_s: cython.double = self.acceleration / self.jerk
        # From rest to its full speed, then on evenly.
        rising_s: cython.double = min(building_s, sqrt(2.0 * self.speed / self.jerk))
        gone: cython.double = self.jerk * rising_s * rising_s * rising_s / 6.0
        if part <= gone:
            return root(6.0 * part / self.jerk)
        if rising_s < building_s:
            return rising_s + (part - gone) / self.speed
        # Then it has gone acceleration ((t - building / 2)^2 + building^2 / 12) / 2 after a time t.
        full_s = self.speed / self.acceleration
        gone = 0.5 * self.acceleration * (full_s * full_s + building_s * building_s / 12.0)
        if part <= gone:
            return 0.5 * building_s + sqrt(2.0 * part / self.acceleration - building_s * building_s / 12.0)
        return full_s + 0.5 * building_s + (part - gone) / self.speed


@cython.cfunc
@cython.exceptval(check=False)
def _cosine(ending: Side, leaving: Side) -> cython.double:
    """Cosine of the angle by which the joints turn, each counted by its acceleration."""
    product: cython.double = 0.0
    square: cython.double = 0.0
    other_square: cython.double = 0.0
    for i in range(ending.limit.shape[0]):
        one, other = ending.slope[1, 0, i] / ending.limit[i], leaving.slope[1, 0, i] / leaving.limit[i]
        product += one * other
        square += one * one
        other_square += other * other
    return product / sqrt(square * other_square)


@cython.cfunc
@cython.exceptval(check=False)
def _rho(
    ending: Side, leaving: Side, cosine: cython.double, before: cython.double, after: cython.double
) -> cython.double:
    """What suits a corner between parts of two moves; 0 where these are too small for one."""
    if min(before * ending.way, after * leaving.way) < SHORTEST_WAY_RAD:
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


def fitted(
    ending: Side,
    leaving: Side,
    before: cython.double,
    after: cython.double,
    zone: Zone,
    lowest: cython.double[::1],
    highest: cython.double[::1],
) -> tuple[float, float, float] | None:
    """`before`, `after` and rho of a corner; None where the robot has to stop.

    `before` and `after` are the parts of both moves that are in the zone. `lowest` and `highest` are the
    position limits (rad, (n,)).
    """
    n: cython.Py_ssize_t = lowest.shape[0]
    cosine: cython.double = _cosine(ending, leaving)
    q: cython.double[:, :, ::1] = np.empty((1, 2, n))
    # Parts of what the zone allows, until the robot stays in it and within its position limits.
    for share in (1.0, 0.7, 0.4, 0.2):
        rho = _rho(ending, leaving, cosine, share * before, share * after)
        if rho == 0.0:
            return None
        height = 1.0 / (rho * (3.0 - 3.0 * rho + rho * rho))
        inside = True
        for p in range(1, PARTS):
            v = p / (1.0 * PARTS)
            ending.path.place(1.0 - share * before * shape(1.0 - v, rho, height, 0), q, 0)
            leaving.path.place(share * after * shape(v, rho, height, 0), q, 1)
            for i in range(n):
                q[0, 0, i] += q[0, 1, i] - leaving.slope[0, 0, i]
                if q[0, 0, i] < lowest[i] or q[0, 0, i] > highest[i]:
                    inside = False
            if zone.distance_of(q[0], 0) > zone.radius * ROUNDING:
                inside = False
            if not inside:
                break
        if inside:
            return share * before, share * after, rho
    return None

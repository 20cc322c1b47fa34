"""How far joints may go in a tick so that no limit of position or velocity is ever passed."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt

from iiwa_sim.motion.joints import Joints

# Newton's method on a convex function, from above: it gets there long before.
_NEWTON_STEPS = cython.declare(cython.int, 60)
# Nearer to where there is just ample room a joint counts as having less.
_ROUNDING_RAD = cython.declare(cython.double, 1e-9)


@cython.cclass
class JointBounds:
    """The bounds of one robot; the attributes are declared in the .pxd.

    A joint goes no faster than its velocity limit, and towards a position limit only so fast that it comes
    to rest before it when it brakes from any tick on, from constant speed, with the limits of a stop.
    """

    def __init__(
        self,
        tick_s: float,
        position_min: Sequence[float],
        position_max: Sequence[float],
        velocity: Sequence[float],
        stop_acceleration: Sequence[float],
        stop_jerk: Sequence[float],
    ) -> None:
        """Limits of each joint, in rad and s."""
        self._tick_s = tick_s
        self._joint_count = len(position_min)
        self._low, self._high = np.array(position_min, float), np.array(position_max, float)
        self._acceleration, self._jerk = np.array(stop_acceleration, float), np.array(stop_jerk, float)
        self._full = np.array([v * tick_s for v in velocity])
        self._ample = np.array(
            [
                braking_way(v, a, j) + v * tick_s
                for v, a, j in zip(velocity, stop_acceleration, stop_jerk, strict=True)
            ]
        )

    def ways(self, joints: Joints) -> tuple[list[float], list[float]]:
        """The least and the greatest way (rad) that each joint may go in the next tick."""
        least, greatest = [], []
        q: cython.double
        for k in range(self._joint_count):
            q = joints[k]
            least.append(-self._way(q - self._low[k], k))
            greatest.append(self._way(self._high[k] - q, k))
        return least, greatest

    @cython.ccall
    @cython.exceptval(-1)
    def allow(self, joints: Joints, after: Joints) -> cython.bint:
        """Whether joints may go from one place to another (rad) in the next tick."""
        q: cython.double
        way: cython.double
        room: cython.double
        for k in range(self._joint_count):
            q = joints[k]
            way = after[k]
            way -= q
            room = self._high[k] - q
            if way < 0.0:
                way, room = -way, q - self._low[k]
            # Nearly always there is ample room: then that is all to be asked.
            if not way <= self._full[k] or (
                room < self._ample[k] + _ROUNDING_RAD and way > self._way(room, k)
            ):
                return False
        return True

    def within(self, joints: Joints) -> Joints:
        """The nearest joint positions within the limits: takes rounding away."""
        q: cython.double
        for k in range(self._joint_count):
            q = joints[k]
            if not self._low[k] <= q <= self._high[k]:
                break
        else:
            return joints
        nearest = []
        for k in range(self._joint_count):
            q = joints[k]
            nearest.append(min(max(q, self._low[k]), self._high[k]))
        return tuple(nearest)

    @cython.cfunc
    @cython.exceptval(check=False)
    def _way(self, room: cython.double, k: cython.Py_ssize_t) -> cython.double:
        """How far a joint may go with so much room before its limit."""
        if room >= self._ample[k]:
            return self._full[k]
        if room <= 0.0:
            return 0.0
        tick: cython.double = self._tick_s
        a: cython.double = self._acceleration[k]
        j: cython.double = self._jerk[k]
        v: cython.double = self._full[k] / tick
        for _ in range(_NEWTON_STEPS):
            excess = braking_way(v, a, j) + v * tick - room
            if excess <= 1e-15:
                break
            slope = (v / a + a / (2.0 * j) if v * j >= a * a else 1.5 * sqrt(v / j)) + tick
            v = max(v - excess / slope, 0.0)
        return min(v * tick, room)


@cython.ccall
@cython.exceptval(-1.0)
def largest_way(before: Joints, after: Joints) -> cython.double:
    """The way (rad) of the joint that goes farthest."""
    largest: cython.double = 0.0
    a: cython.double
    b: cython.double
    for k in range(len(before)):
        a, b = before[k], after[k]
        largest = max(largest, fabs(b - a))
    return largest


@cython.ccall
@cython.exceptval(check=False)
def braking_way(v: cython.double, a: cython.double, j: cython.double) -> cython.double:
    """How far a joint goes that brakes from a constant velocity v, with acceleration a and jerk j (rad,
    s)."""
    if v * j >= a * a:
        return 0.5 * v * (v / a + a / j)
    return v * sqrt(v / j)

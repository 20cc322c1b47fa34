"""How far joints may go in a tick so that no limit of position or velocity is ever passed."""

from collections.abc import Sequence
from math import sqrt

from iiwa_sim.motion.sampled_path import Joints

NEWTON_STEPS = 60
"""Newton's method on a convex function, from above: it gets there long before."""
ROUNDING_RAD = 1e-9
"""Nearer to where there is just ample room a joint counts as having less."""


class JointBounds:
    """The bounds of one robot.

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
        self._low, self._high = tuple(position_min), tuple(position_max)
        self._joints = [
            (low, high, v * tick_s, braking_way(v, a, j) + v * tick_s, a, j)
            for low, high, v, a, j in zip(
                position_min, position_max, velocity, stop_acceleration, stop_jerk, strict=True
            )
        ]
        # Where a joint has ample room, and how far it may go there: nearly always that is all to be asked.
        self._plain = [
            (low + ample + ROUNDING_RAD, high - ample - ROUNDING_RAD, -full, full)
            for low, high, full, ample, _, _ in self._joints
        ]

    def ways(self, joints: Joints) -> tuple[list[float], list[float]]:
        """The least and the greatest way (rad) that each joint may go in the next tick."""
        least, greatest = [], []
        for q, (low, high, full, ample, a, j) in zip(joints, self._joints, strict=True):
            least.append(-full if q - low >= ample else -self._way(q - low, full, a, j))
            greatest.append(full if high - q >= ample else self._way(high - q, full, a, j))
        return least, greatest

    def allow(self, joints: Joints, after: Joints) -> bool:
        """Whether joints may go from one place to another (rad) in the next tick."""
        for q, p, (near_low, near_high, least, most) in zip(joints, after, self._plain, strict=True):
            if not (near_low < q < near_high and least <= p - q <= most):
                break
        else:
            return True
        for q, p, (low, high, full, ample, a, j) in zip(joints, after, self._joints, strict=True):
            way = p - q
            if way > 0.0:
                if way > full or (high - q < ample and way > self._way(high - q, full, a, j)):
                    return False
            elif way < -full or (q - low < ample and -way > self._way(q - low, full, a, j)):
                return False
        return True

    def within(self, joints: Joints) -> Joints:
        """The nearest joint positions within the limits: takes rounding away."""
        for q, low, high in zip(joints, self._low, self._high, strict=True):
            if not low <= q <= high:
                break
        else:
            return joints
        return tuple(
            [min(max(q, low), high) for q, (low, high, *_) in zip(joints, self._joints, strict=True)]
        )

    def _way(self, room: float, full: float, a: float, j: float) -> float:
        """How far it may go with so much room before its limit."""
        if room <= 0.0:
            return 0.0
        tick = self._tick_s
        v = full / tick
        for _ in range(NEWTON_STEPS):
            excess = braking_way(v, a, j) + v * tick - room
            if excess <= 1e-15:
                break
            slope = (v / a + a / (2.0 * j) if v * j >= a * a else 1.5 * sqrt(v / j)) + tick
            v = max(v - excess / slope, 0.0)
        return min(v * tick, room)


def braking_way(v: float, a: float, j: float) -> float:
    """How far a joint goes that brakes from a constant velocity v, with acceleration a and jerk j (rad,
    s)."""
    if v * j >= a * a:
        return 0.5 * v * (v / a + a / j)
    return v * sqrt(v / j)

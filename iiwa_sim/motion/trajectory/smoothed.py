"""A reference as the robot follows it: averaged, so that it keeps the limits of acceleration and jerk.

Both averages together are one with the weights of a trapezoid, which rises over the narrower width. Between
the corners of the trapezoid and the knots of the reference, weight times position is a polynomial of the
sixth degree, of which four places tell the exact integral (Gauss and Legendre).
"""

import numpy as np

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.trajectory.reference import Reference
from iiwa_sim.motion.trajectory.windows import Windows

_PLACES = np.array([-0.8611363115940526, -0.33998104358485626, 0.33998104358485626, 0.8611363115940526])
_WEIGHTS = np.array([0.34785484513745385, 0.6521451548625461, 0.6521451548625461, 0.34785484513745385])


class Smoothed:
    """Joint positions (rad) over time (s). At rest at the reference's start until 0, and at its end from
    `end_s` on."""

    def __init__(self, reference: Reference, windows: Windows) -> None:
        self.end_s = reference.end_s + windows.width_s
        self._reference = reference
        self._narrow_s, self._wide_s = sorted(windows)

    def joints(self, time_s: float) -> Joints:
        """Joint positions (rad)."""
        if time_s >= self.end_s:
            return self._reference.end
        if not self._wide_s:
            return self._reference.at(time_s)[0]
        return tuple(self._averaged(0, time_s).tolist())

    def state(self, time_s: float) -> tuple[Joints, Joints, Joints]:
        """Positions (rad), velocities (rad/s) and accelerations (rad/s^2)."""
        at, narrow, wide = self._reference.at, self._narrow_s, self._wide_s
        if time_s >= self.end_s or not wide:
            return at(time_s)
        now = [np.array(each) for each in at(time_s)]
        before = [np.array(each) for each in at(time_s - wide)]
        if narrow:
            rise = now[0] - np.array(at(time_s - narrow)[0])
            fall = before[0] - np.array(at(time_s - wide - narrow)[0])
            acceleration = (rise - fall) / (narrow * wide)
        else:
            acceleration = (now[1] - before[1]) / wide
        position, velocity = self._averaged(0, time_s), self._averaged(1, time_s)
        return tuple(position.tolist()), tuple(velocity.tolist()), tuple(acceleration.tolist())

    def _averaged(self, order: int, time_s: float) -> Array:
        """The mean position (order 0) or velocity (order 1) over what lies just behind (n,)."""
        narrow, wide, reference = self._narrow_s, self._wide_s, self._reference
        begin = time_s - narrow - wide
        first, last = reference.times.searchsorted([begin, time_s])
        edges = np.sort([begin, begin + narrow, begin + wide, time_s, *reference.times[first:last]])
        half = 0.5 * np.diff(edges)[:, None]
        times = (edges[:-1, None] + half * (1.0 + _PLACES)).ravel()
        weights = (half * _WEIGHTS).ravel()
        if narrow:
            weights *= np.minimum(1.0, np.minimum(time_s - times, times - begin) / narrow)
        values = reference.curve.derivatives(times.clip(reference.times[0], reference.end_s))[order]
        if order:
            values[(times < reference.times[0]) | (times > reference.end_s)] = 0.0
        averaged: Array = (weights[:, None] * values).sum(axis=0) / weights.sum()
        return averaged

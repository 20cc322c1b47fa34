"""A reference as the robot follows it: averaged, so that it keeps the limits of acceleration and jerk."""

import numpy as np

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.trajectory.reference import Reference
from iiwa_sim.motion.trajectory.smoothed_kernel import Averaged
from iiwa_sim.motion.trajectory.windows import Windows


class Smoothed:
    """Joint positions (rad) over time (s). At rest at the reference's start until 0, and at its end from
    `end_s` on."""

    def __init__(self, reference: Reference, windows: Windows) -> None:
        self.end_s = reference.end_s + windows.width_s
        self._reference = reference
        self._narrow_s, self._wide_s = sorted(windows)
        self._averaged = Averaged(reference.curve, self._narrow_s, self._wide_s)

    def joints(self, time_s: float) -> Joints:
        """Joint positions (rad)."""
        if time_s >= self.end_s:
            return self._reference.end
        if not self._wide_s:
            return self._reference.at(time_s)[0]
        averaged: Joints = self._averaged.at(0, time_s)
        return averaged

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
        return self._averaged.at(0, time_s), self._averaged.at(1, time_s), tuple(acceleration.tolist())

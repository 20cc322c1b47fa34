"""PTP: straight in joint space, all joints starting and ending together."""

import numpy as np

from iiwa_sim.motion.limits import Array, JointLimits
from iiwa_sim.motion.path import Joints
from iiwa_sim.motion.timing import STANDSTILL_RAD, AtOnce, OptimalTiming, Timing


class JointLine:
    """The straight line between two joint positions (rad)."""

    def __init__(self, start: Joints, end: Joints) -> None:
        self.end = end
        self._start = start
        self._way = tuple(b - a for a, b in zip(start, end, strict=True))

    def joints(self, s: float) -> Joints:
        """See `Path`."""
        if s >= 1.0:
            return self.end
        return tuple([a + s * d for a, d in zip(self._start, self._way, strict=True)])

    def joints_along(self, s: Array) -> list[Joints]:
        """See `Path`."""
        return [self.joints(x) for x in s.tolist()]

    def timing(self, limits: JointLimits) -> Timing:
        """The fastest timing within limits."""
        way = np.abs(self._way)
        if way.max() < STANDSTILL_RAD:
            return AtOnce()
        return OptimalTiming(*(1.0 / float((way / limit).max()) for limit in limits))

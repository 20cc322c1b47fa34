"""PTP: straight in joint space, all joints starting and ending together."""

import numpy as np

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.path import Joints, PathSamples

SAMPLES = 6


class JointLine:
    """The straight line between two joint positions (rad)."""

    tcp_length_m = None

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

    @property
    def samples(self) -> PathSamples:
        """See `Path`."""
        s = np.linspace(0.0, 1.0, SAMPLES)
        way = np.array([self._way])
        none = np.zeros((SAMPLES, len(self._way)))
        return PathSamples(s, np.array(self._start) + s[:, None] * way, none + way, none, none)

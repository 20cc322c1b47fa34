"""PTP: straight in joint space, all joints starting and ending together."""

import numpy as np

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.sampled_path import Joints, PathSamples

SAMPLES = 6
EVENLY = np.linspace(0.0, 1.0, SAMPLES)
EVENLY.flags.writeable = False  # all paths share it


class JointLine:
    """The straight line between two joint positions (rad)."""

    tcp_length_m = None

    def __init__(self, start: Joints, end: Joints) -> None:
        self.end = end
        self._start = start
        self._way = tuple(b - a for a, b in zip(start, end, strict=True))
        self.samples = _samples(start, self._way)

    def joints(self, s: float) -> Joints:
        """See `Path`."""
        if s >= 1.0:
            return self.end
        return tuple([a + s * d for a, d in zip(self._start, self._way, strict=True)])

    def joints_along(self, s: Array) -> Array:
        """See `Path`."""
        joints: Array = np.array(self._start) + s[:, None] * np.array(self._way)
        joints[s >= 1.0] = self.end
        return joints


def _samples(start: Joints, way: Joints) -> PathSamples:
    none = np.zeros((SAMPLES, len(way)))
    q = np.array(start) + EVENLY[:, None] * np.array(way)
    return PathSamples(EVENLY, q, none + np.array(way), none, none)

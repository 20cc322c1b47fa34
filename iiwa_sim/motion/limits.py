"""Limits of the joints' motion for planners."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STANDSTILL_RAD = 2e-8
"""Joints nearer to the target are set to it at once: that keeps the limits even in a single tick."""


class JointLimits(NamedTuple):
    """Bounds on the magnitude of each joint's motion: arrays of shape (n,), in rad/s, rad/s^2 and rad/s^3."""

    velocity: Array
    acceleration: Array
    jerk: Array

    def at_speed(self, speed_rel: float | Sequence[float]) -> "JointLimits":
        """Return these limits with velocities scaled by a relative speed, one or one per joint."""
        return self._replace(velocity=self.velocity * np.asarray(speed_rel, dtype=np.float64))

"""What the joints may do, as the planners want it."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class JointLimits(NamedTuple):
    """Bounds on the magnitude of each joint's motion: arrays of shape (n,), in rad/s, rad/s^2 and rad/s^3."""

    velocity: Array
    acceleration: Array
    jerk: Array

    def at_speed(self, speed_rel: float | Sequence[float]) -> "JointLimits":
        """These limits with velocities scaled by one relative speed, or one per joint; accelerations stay."""
        return self._replace(velocity=self.velocity * np.asarray(speed_rel, dtype=np.float64))

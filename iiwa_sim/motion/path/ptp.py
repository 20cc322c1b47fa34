"""PTP: straight in joint space, all joints starting and ending together."""

import numpy as np

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.path.piecewise_kernel import Polynomial


def ptp(start: Joints, end: Joints) -> Polynomial:
    """The straight line between two joint positions (rad)."""
    a, b = np.array(start), np.array(end)
    return Polynomial((0.0, 1.0), [np.array([0.5 * (a + b), 0.5 * (b - a)])], start, end)

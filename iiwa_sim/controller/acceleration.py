"""The acceleration that a command asks for, as a cap on the limits of its move.

A cap only lowers: one above the robot's own limits changes nothing. Jerk limits stay the robot's.
"""

from collections.abc import Callable
from enum import Enum
from typing import NamedTuple

import numpy as np

from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.motion.limits import Array, JointLimits
from iiwa_sim.motion.plan_kernel import Polynomial

LOWEST_SHARE = 1e-6
"""The least part of the robot's limits: a lower acceleration is refused, as a lower speed is."""
PLACES = 129
"""Number of places of a line that are looked at."""
HALVINGS = 40
"""Halvings of the interval in which a share of the limits is searched: far below what floats tell apart."""


class AccelerationUnit(Enum):
    """Unit of the values of an acceleration cap."""

    RELATIVE = "relative"
    """Shares of the robot's joint acceleration limits, above 0 and up to 1."""
    RAD_S2 = "rad/s^2"
    """Acceleration of joints, in every kind of move."""
    TCP_M_S2 = "m/s^2"
    """Acceleration of the TCP along the line of a LIN."""


class AccelerationCap(NamedTuple):
    """The greatest acceleration of one move."""

    values: tuple[float, ...]
    """One, or one for each joint; all are above 0."""
    unit: AccelerationUnit


def capped_joints(limits: JointLimits, cap: AccelerationCap) -> JointLimits:
    """Limits (n,) whose accelerations are no higher than a cap in `RELATIVE` or `RAD_S2`.

    Raises `Refused` where the cap is below `LOWEST_SHARE` of a limit.
    """
    values = np.array(cap.values)
    acceleration = limits.acceleration * values if cap.unit is AccelerationUnit.RELATIVE else values
    if (acceleration < LOWEST_SHARE * limits.acceleration).any():
        reason = f"acceleration: expected at least {LOWEST_SHARE:g} of the robot's limits"
        raise Refused(EXECUTION, reason)
    return limits._replace(acceleration=np.minimum(limits.acceleration, acceleration))


def capped_line(limits: JointLimits, path: Polynomial, tcp_m_s2: float) -> JointLimits:
    """Limits (n,) within which the TCP nowhere accelerates along its line by more than `tcp_m_s2` (m/s^2).

    Accelerations of all joints are lowered by one share: the TCP comes to its acceleration where the line
    asks least of the joints. Where the line bends so much in joint space that its speed alone makes the TCP
    accelerate more, speeds are lowered by one share, too. Raises `Refused` where that takes less than
    `LOWEST_SHARE` of the limits. A line without a way of the TCP is not changed.
    """
    length_m = path.tcp_length_m
    if not length_m:
        return limits
    _, first, second, _ = path.derivatives(np.linspace(0.0, 1.0, PLACES))
    dq, ddq = np.abs(first).clip(min=1e-12), np.abs(second)
    # The greatest (ds/dt)^2 at each sample: by the speed limits, and by what half of the line allows.
    fastest = np.minimum((limits.velocity / dq).min(axis=1) ** 2, tcp_m_s2 / length_m)[:, None]
    from_limits, from_speed = limits.acceleration / dq, ddq * fastest / dq

    def largest_m_s2(share: float, speed_share: float) -> float:
        per_joint: Array = share * from_limits + speed_share**2 * from_speed
        return length_m * float(per_joint.min(axis=1).max())

    least = 0.5 * tcp_m_s2 / largest_m_s2(1.0, 0.0)
    speed_share = _largest(lambda x: largest_m_s2(min(least, 1.0), x) <= tcp_m_s2)
    share = _largest(lambda x: largest_m_s2(x, speed_share) <= tcp_m_s2)
    if min(share, speed_share) < LOWEST_SHARE:
        raise Refused(EXECUTION, f"acceleration {tcp_m_s2:g} m/s^2: lower than the robot can go")
    return limits._replace(velocity=speed_share * limits.velocity, acceleration=share * limits.acceleration)


def _largest(holds: Callable[[float], bool]) -> float:
    """The largest x from 0 to 1 for which something holds that holds for all smaller ones."""
    if holds(1.0):
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low

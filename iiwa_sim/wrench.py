"""Wrenches at the TCP, as motion and contact exchange them."""

Wrench = tuple[float, float, float, float, float, float]
"""Force (N) and torque (Nm) on the robot at the TCP, along the axes of the TCP unless stated otherwise."""

NO_WRENCH: Wrench = (0.0,) * 6


def add(a: Wrench, b: Wrench) -> Wrench:
    """Return the sum of two wrenches."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5])

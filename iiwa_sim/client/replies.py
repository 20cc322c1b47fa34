"""Types for replies of several values. Units are those of protocol/iiwa.toml, or named."""

from typing import NamedTuple


class Frame(NamedTuple):
    """A pose in the base frame: mm, and intrinsic Z-Y-X angles in rad."""

    x: float
    y: float
    z: float
    alpha: float
    beta: float
    gamma: float


class CartesianForce(NamedTuple):
    """Force (N) and torque (Nm) at the TCP, in TCP orientation, acting on the robot."""

    fx: float
    fy: float
    fz: float
    tx: float
    ty: float
    tz: float


class LastError(NamedTuple):
    """A result code of robot_movement_interface, and the reason in words."""

    code: int
    reason: str


class RobotStatus(NamedTuple):
    """The state, as industrial_msgs/RobotStatus: mode 2 is automatic, of the others 1 is true and 0 false."""

    mode: int
    e_stopped: int
    drives_powered: int
    motion_possible: int
    in_motion: int
    in_error: int
    error_code: int


class Krc4Frame(NamedTuple):
    """A pose in the base frame: mm, and degrees: rotations about Z by A, Y' by B and X'' by C."""

    x_mm: float
    y_mm: float
    z_mm: float
    a_deg: float
    b_deg: float
    c_deg: float

"""Types for replies of several values, in units of protocol/iiwa.toml or named, and exceptions of clients."""

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


class CommandError(Exception):
    """The robot rejected the command; the message quotes it, with code and reason."""

    def __init__(self, message: str, code: int = 0, reason: str = "") -> None:
        super().__init__(message)
        self.code = code
        """Result code of robot_movement_interface (docs/protocol.md); 0 if the server has none."""
        self.reason = reason
        """The reason in words; empty if the server has none, as with KRC4 messages."""


class UnknownCommandError(CommandError):
    """The robot answered `unknown command`: the server is older than this client, or of another kind."""


class Krc4Error(CommandError):
    """The robot rejected a KRC4 message."""


class ReplyError(Exception):
    """The reply does not fit the command: client and server are out of step, or the protocol is another."""

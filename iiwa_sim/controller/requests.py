"""The request of a move: one value, whichever protocol it comes from."""

from collections.abc import Sequence
from enum import Enum
from math import hypot, isfinite
from typing import NamedTuple

from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.frames import (
    Frame,
    Quaternion,
    Transform,
    Vector,
    compose,
    euler_from_rotation,
    multiply,
    rotation_from_quaternion,
)
from iiwa_sim.motion.springs import CartesianImpedance

QUATERNION_LENGTH_TOLERANCE = 0.01
"""Enough for four numbers with two decimals, such as 0.71 0 0 0.71."""
JOINT_BLENDING = 0.1
"""Default blending of PTP to joint positions, as published for the original: see `MoveRequest.blending`."""
Thresholds = tuple[float | None, float | None, float | None]
"""Thresholds of the force along x, y and z of the TCP (N); None where it is not watched."""


class Kind(Enum):
    """Kind of a move: the path of the robot to its target."""

    LIN = "LIN"
    """Straight at the TCP."""
    PTP = "PTP"
    """Straight in joint space."""
    SMART = "SMART"
    """A servo: it heads for the newest target from wherever the robot is."""
    DIRECT = "DIRECT"
    """A stiffer servo, for targets near the present positions."""
    HOLD = "HOLD"
    """Every joint is held by a spring where the robot is, or comes to rest."""

    @property
    def is_servo(self) -> bool:
        """True if such a move takes the place of the one before."""
        return self in (Kind.SMART, Kind.DIRECT)


class MoveRequest(NamedTuple):
    """A requested move. Protocols check the ranges of numbers, the planner checks the reach of the robot."""

    kind: Kind
    target: Frame | Sequence[float] = ()
    """A frame in the base (mm, rad), of the TCP, for servos of the flange; or joint positions (rad)."""
    speed: float = 1.0
    """Relative to the joints' limits, above 0 up to 1."""
    blending: float = 0.0
    """Radius (mm) around the target in which the TCP may blend into the next move; 0 stops at the target.
    A radius beyond the middle of either path is cut to that. For PTP to joint positions it is a part (0..1)
    of the largest joint distance: the blend begins where no joint is farther from its target."""
    speeds: Sequence[float] = ()
    """Speeds of each joint, in place of `speed`: for PTP and for servos to joint positions.
    A joint within 0.001 rad of its target accepts 0, too."""
    shift: Frame | None = None
    """Instead of a target: how far the TCP goes from where it will be when the moves that wait are done."""
    in_tool: bool = False
    """True for a shift along the axes of the tool, False for those of the base."""
    redundancy: float | None = None
    """The position (rad) of A3 at the target; without one it stays, if the target can then be reached."""
    thresholds: Thresholds | None = None
    """The move ends when a force at the TCP has changed by more since the command."""
    compliance: CartesianImpedance | None = None
    """The robot is compliant along the move, which replaces the running motion instead of waiting."""
    hold_nm_per_rad: float = 0.0
    """Stiffness of every joint in a hold, 0 to 5000."""
    tcp_speed_m_s: float | None = None
    """Greatest speed of the TCP of LIN to a frame, instead of a relative one."""
    accelerations: Sequence[float] = ()
    """Parts of the joints' acceleration limits, above 0 and up to 1: one, or one for each joint."""
    tcp_acceleration_m_s2: float | None = None
    """Greatest acceleration of the TCP along the line of a LIN, instead of these."""


def from_quaternion(position_mm: Vector, quaternion: Quaternion) -> Frame:
    """Return the frame of a position (mm) and a unit quaternion x, y, z, w; raises `Refused`."""
    length = hypot(*quaternion)
    if not (isfinite(length) and abs(length - 1.0) <= QUATERNION_LENGTH_TOLERANCE):
        expected = f"expected 1, within {QUATERNION_LENGTH_TOLERANCE:g}"
        raise Refused(EXECUTION, f"a quaternion of length {length:.7g}: {expected}")
    return Frame(*position_mm, *euler_from_rotation(rotation_from_quaternion(quaternion)))


def shifted(start: Transform, shift: Frame, *, in_tool: bool) -> Frame:
    """Return the frame of the TCP after a shift from `start`, in the axes of base or tool.

    The TCP goes by x, y, z and turns about itself by Rz(alpha) Ry(beta) Rx(gamma), both in those axes.
    """
    by = shift.to_transform()
    if in_tool:
        return Frame.from_transform(compose(start, by))
    x, y, z = (a + b for a, b in zip(start.translation, by.translation, strict=True))
    return Frame.from_transform(Transform(multiply(by.rotation, start.rotation), (x, y, z)))

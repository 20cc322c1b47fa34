"""The interface of a robot for the ROS side: the controller in this process, or one behind a connection."""

from collections.abc import Callable
from enum import Enum
from typing import NamedTuple, Protocol

from iiwa_sim.controller.acceleration import AccelerationCap
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.controller.requests import Kind
from iiwa_sim.controller.status import RobotStatus
from iiwa_sim.frames import Frame
from iiwa_sim.robot.description import RobotDescription

Joints = tuple[float, ...]


class SpeedUnit(Enum):
    """Unit of a speed."""

    RELATIVE = "relative"  # of the limits, 0 to 1
    RAD_S = "rad/s"
    M_S = "m/s"


class BlendingUnit(Enum):
    """Unit of the region round a target in which the next move may take over."""

    MM = "mm"
    RAD = "rad"
    RELATIVE = "relative"  # of the path of the move, 0 to 1


class Move(NamedTuple):
    """A move that a command asks for, checked as far as is possible without a robot."""

    kind: Kind
    target: Joints | Frame
    """Joint positions (rad), or a frame in the base: of the flange for servo moves, else of the TCP."""
    speeds: tuple[float, ...]
    """One speed, or one for each joint."""
    speed_unit: SpeedUnit
    blending: float = 0.0
    blending_unit: BlendingUnit = BlendingUnit.MM
    thresholds_n: tuple[float, float, float] | None = None
    """Thresholds of a force move (N): the change of the force at the TCP, along its axes, that ends it."""
    acceleration: AccelerationCap | None = None
    """Cap of the acceleration; None for the robot's own limit."""
    note: str = ""
    """A remark for its result on how the command was understood."""

    def joint_speeds_rel(self, robot: RobotDescription) -> tuple[float, ...]:
        """The speeds (0..1) of all joints, for joint positions; one speed is that of each of them.

        Raises `Refused` where one is above its limit.
        """
        speeds = self.speeds * len(robot.joints) if len(self.speeds) == 1 else self.speeds
        if self.speed_unit is SpeedUnit.RELATIVE:
            return speeds
        for name, speed, limit in zip(robot.joints, speeds, robot.velocity, strict=True):
            if speed > limit:
                raise Refused(EXECUTION, f"velocity {speed:g} rad/s: {name} goes up to {limit:.7g} rad/s")
        return tuple(speed / limit for speed, limit in zip(speeds, robot.velocity, strict=True))


class State(NamedTuple):
    """The published state of a robot. What the robot does not report is None."""

    joints: Joints
    """rad"""
    velocities: Joints | None
    """rad/s"""
    tool_frame: Frame
    """The TCP in the base: mm, rad."""
    override: float | None
    """0 to 1."""
    inputs: tuple[bool, ...] | None
    """From number 1 on."""
    outputs: tuple[bool, ...] | None
    """From number 1 on."""


class Failure(NamedTuple):
    """Why a request failed."""

    code: int
    """A result code, or one of `iiwa_sim.controller.io`."""
    reason: str


Done = Callable[[Failure | None], None]
"""Called with None when a request is done, or with the reason when it failed."""

Ended = Callable[[int, str], None]
"""Called when a move has ended, with its result code (0 for success) and a remark."""


class Robot(Protocol):
    """Calls return at once and take effect in their order.

    The outcome is reported by one call of `done` or `ended`, within the call or later.
    """

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Base first."""

    @property
    def ready(self) -> bool:
        """Whether a move may be sent: the move before it has been accepted or refused, and the override is
        not 0, at which the robot would not start it."""

    @property
    def state(self) -> State | None:
        """The newest known state; None if none is known."""

    @property
    def status(self) -> RobotStatus | None:
        """The newest status; it is also known of a robot that is out of reach."""

    def move(self, move: Move, ended: Ended) -> None:
        """Queue a move, or follow the target of a servo move at once."""

    def stop(self, done: Done) -> None:
        """Stop the robot and drop waiting moves, which end with a code other than 0."""

    def set_override(self, override: float, done: Done) -> None:
        """Run all moves at this part of their speed, 0 to 1."""

    def set_output(self, number: int, on: bool, done: Done) -> None:
        """Switch an output, numbered from 1."""

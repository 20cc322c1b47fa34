"""What the ROS side needs of a robot, be it the controller in this process or one behind a connection."""

from collections.abc import Callable
from enum import Enum
from typing import NamedTuple, Protocol

from iiwa_sim.controller.acceleration import AccelerationCap
from iiwa_sim.controller.requests import Kind
from iiwa_sim.controller.status import RobotStatus
from iiwa_sim.frames import Frame

Joints = tuple[float, ...]


class SpeedUnit(Enum):
    """Of speeds."""

    RELATIVE = "relative"  # to the limits, above 0 up to 1
    RAD_S = "rad/s"
    M_S = "m/s"


class BlendingUnit(Enum):
    """Of the neighbourhood of a target in which the next move may take over."""

    MM = "mm"
    RAD = "rad"
    RELATIVE = "relative"  # to the way of the move, 0 to 1


class Move(NamedTuple):
    """One movement as a command asks for it, checked as far as that goes without a robot."""

    kind: Kind
    target: Joints | Frame
    """Joint positions (rad), or a frame in the base: of the flange for servo moves, else of the TCP."""
    speeds: tuple[float, ...]
    """One, or one for each joint."""
    speed_unit: SpeedUnit
    blending: float = 0.0
    blending_unit: BlendingUnit = BlendingUnit.MM
    thresholds_n: tuple[float, float, float] | None = None
    """Of a move that ends when a force at the TCP, along its axes, has changed by more."""
    acceleration: AccelerationCap | None = None
    """The greatest that is asked for; without one the robot's own."""
    note: str = ""
    """What its result says beside success: how something in the command was understood."""


class State(NamedTuple):
    """What is published of a robot. What it does not tell of itself is None."""

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
    """Why something was not done."""

    code: int
    """A result code, or one of `iiwa_sim.controller.io`."""
    reason: str


Done = Callable[[Failure | None], None]
"""Hears of None when something has been done, else why it was not."""

Ended = Callable[[int, str], None]
"""Hears the result code with which a move has ended, 0 for success, and what is to be said of it."""


class Robot(Protocol):
    """All calls return at once, and are carried out in their order.

    What they lead to is told by a call of `done` or `ended`, once, within the call or later.
    """

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Base first."""

    @property
    def ready(self) -> bool:
        """Whether a move may be sent: the one before has been accepted or refused, and the override is not 0,
        at which the robot would keep it."""

    @property
    def state(self) -> State | None:
        """The newest that is known; None where nothing is."""

    @property
    def status(self) -> RobotStatus | None:
        """The newest that is known, also of a robot whose state is not: that it is out of reach."""

    def move(self, move: Move, ended: Ended) -> None:
        """Queue a move, or go for the target of a servo at once."""

    def stop(self, done: Done) -> None:
        """Bring the robot to rest and forget the moves that wait; these end with a code that is not 0."""

    def set_override(self, override: float, done: Done) -> None:
        """Run all moves at this part of their speed, 0 to 1."""

    def set_output(self, number: int, on: bool, done: Done) -> None:
        """Switch an output, numbered from 1."""

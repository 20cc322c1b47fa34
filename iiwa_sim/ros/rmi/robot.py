"""Moves in the units of Appendix A, and the controller that carries them out."""

from collections.abc import Callable
from enum import Enum
from math import dist
from typing import NamedTuple

from iiwa_sim.controller.acceleration import AccelerationCap
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.controller.requests import Kind, MoveRequest
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


Ended = Callable[[int, str], None]
"""Called when a move has ended, with its result code (0 for success) and a remark."""


class Robot:
    """A controller that carries out moves. A move ends in a tick, or in the call that stops it."""

    def __init__(self, controller: Controller) -> None:
        self._controller = controller

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Base first."""
        return self._controller.description.joints

    @property
    def ready(self) -> bool:
        """Whether a move would start: the override is not 0."""
        return self._controller.override > 0.0

    def move(self, move: Move, ended: Ended) -> None:
        """Queue a move, or follow the target of a servo move at once."""
        try:
            self._controller.move(self._request(move), lambda ending: ended(ending.code, ending.reason))
        except Refused as refused:
            self._controller.record_error(refused.code, refused.reason)
            ended(refused.code, refused.reason)

    def stop(self) -> None:
        """Stop the robot and drop waiting moves, which end with a code other than 0."""
        self._controller.stop()

    def _request(self, move: Move) -> MoveRequest:
        """The move in units of the controller. Raises `Refused`."""
        controller, target = self._controller, move.target
        asked = MoveRequest(move.kind, target, acceleration=move.acceleration)
        if isinstance(target, Frame):
            if move.kind.is_servo:
                return asked._replace(speed=move.speeds[0])
            asked = asked._replace(blending=self._blending_mm(move, target), thresholds=move.thresholds_n)
            if move.speed_unit is SpeedUnit.M_S:
                return asked._replace(tcp_speed_m_s=move.speeds[0])
            return asked._replace(speed=move.speeds[0])
        if move.kind is Kind.LIN:
            blending_mm = self._blending_mm(move, controller.tcp_frame_at(target))
            return asked._replace(speed=move.speeds[0], blending=blending_mm)
        speeds = move.joint_speeds_rel(controller.description)
        asked = asked._replace(speeds=speeds)
        return asked if move.kind.is_servo else asked._replace(blending=self._blending_rel(move, target))

    def _blending_mm(self, move: Move, target: Frame) -> float:
        """Blending radius in mm; a relative one is a part of the straight path of the TCP."""
        if move.blending_unit is BlendingUnit.MM:
            return move.blending
        start = self._controller.tcp_frame_at(self._controller.end_of_queue)
        return move.blending * dist(start[:3], target[:3])

    def _blending_rel(self, move: Move, joints: Joints) -> float:
        """Blending as a part of the path of the joints; one in rad is divided by the largest travel of a
        joint."""
        if move.blending_unit is not BlendingUnit.RAD:
            return move.blending
        start = self._controller.end_of_queue
        way = max(abs(b - a) for a, b in zip(start, joints, strict=True))
        return 1.0 if move.blending >= way else move.blending / way

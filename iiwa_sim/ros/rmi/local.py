"""The controller in this process as the `Robot` of the ROS side."""

from collections.abc import Callable
from math import dist

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import Refused
from iiwa_sim.controller.requests import Kind, MoveRequest
from iiwa_sim.controller.status import RobotStatus
from iiwa_sim.frames import Frame
from iiwa_sim.ros.rmi.robot import (
    BlendingUnit,
    Done,
    Ended,
    Failure,
    Joints,
    Move,
    SpeedUnit,
    State,
)


class LocalRobot:
    """The interface `Robot` for a controller in this process. Commands take effect within the call; moves
    end in a tick, or in the call that stops them."""

    def __init__(self, controller: Controller) -> None:
        self._controller = controller

    @property
    def joint_names(self) -> tuple[str, ...]:
        return self._controller.description.joints

    @property
    def ready(self) -> bool:
        return self._controller.override > 0.0

    @property
    def state(self) -> State:
        controller = self._controller
        return State(
            joints=controller.joints,
            velocities=controller.joint_velocity(),
            tool_frame=controller.tool_frame(),
            override=controller.override,
            inputs=controller.io.inputs,
            outputs=controller.io.outputs,
        )

    @property
    def status(self) -> RobotStatus:
        return self._controller.status()

    def move(self, move: Move, ended: Ended) -> None:
        try:
            self._controller.move(self._request(move), lambda ending: ended(ending.code, ending.reason))
        except Refused as refused:
            self._controller.record_error(refused.code, refused.reason)
            ended(refused.code, refused.reason)

    def stop(self, done: Done) -> None:
        self._controller.stop()
        done(None)

    def set_override(self, override: float, done: Done) -> None:
        self._controller.set_override(override)
        done(None)

    def set_output(self, number: int, on: bool, done: Done) -> None:
        self._tell(lambda: self._controller.io.set_output(number, on), done)

    @staticmethod
    def _tell(do: Callable[[], None], done: Done) -> None:
        """Do something at once, and tell how it went."""
        try:
            do()
        except Refused as refused:
            done(Failure(refused.code, refused.reason))
        else:
            done(None)

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

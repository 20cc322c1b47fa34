"""The controller in this process as the `Robot` of the ROS side."""

from math import dist

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.endings import Ending
from iiwa_sim.controller.errors import Refused
from iiwa_sim.controller.status import RobotStatus
from iiwa_sim.frames import Frame
from iiwa_sim.ros.rmi.robot import (
    BlendingUnit,
    Done,
    Ended,
    Failure,
    Joints,
    Kind,
    Move,
    SpeedUnit,
    State,
)
from iiwa_sim.ros.rmi.speeds import joint_speeds_rel


class LocalRobot:
    """Everything is done within the call. Moves end in ticks, or in the calls that stop them."""

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._ended: dict[int, Ended] = {}
        controller.endings.listeners.append(self._has_ended)

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
        target = move.target
        try:
            number = (
                self._to_frame(move, target) if isinstance(target, Frame) else self._to_joints(move, target)
            )
        except Refused as refused:
            self._controller.record_error(refused.code, refused.reason)
            ended(refused.code, refused.reason)
        else:
            self._ended[number] = ended

    def stop(self, done: Done) -> None:
        self._controller.stop()
        done(None)

    def set_override(self, override: float, done: Done) -> None:
        self._controller.set_override(override)
        done(None)

    def set_output(self, number: int, on: bool, done: Done) -> None:
        try:
            self._controller.io.set_output(number, on)
        except Refused as refused:
            done(Failure(refused.code, refused.reason))
        else:
            done(None)

    def _has_ended(self, ending: Ending) -> None:
        ended = self._ended.pop(ending.move, None)
        if ended is not None:  # else it is a move of another client
            ended(ending.code, ending.reason)

    def _to_joints(self, move: Move, joints: Joints) -> int:
        controller, cap = self._controller, move.acceleration
        if move.kind is Kind.LIN:
            blending_mm = self._blending_mm(move, controller.tcp_frame_at(joints))
            return controller.lin_joint_move(joints, move.speeds[0], blending_mm, acceleration=cap)
        speeds = joint_speeds_rel(move, self.joint_names, controller.description.velocity)
        if move.kind is Kind.SMART:
            return controller.smart_joint_move(joints, speeds, acceleration=cap)
        if move.kind is Kind.DIRECT:
            return controller.direct_joint_move(joints, speeds, acceleration=cap)
        return controller.joint_move(joints, speeds, self._blending_rel(move, joints), acceleration=cap)

    def _to_frame(self, move: Move, frame: Frame) -> int:
        controller, speed, cap = self._controller, move.speeds[0], move.acceleration
        if move.kind is Kind.SMART:
            return controller.smart_cartesian_move(frame, speed, acceleration=cap)
        if move.kind is Kind.DIRECT:
            return controller.direct_cartesian_move(frame, speed, acceleration=cap)
        blending_mm, thresholds = self._blending_mm(move, frame), move.thresholds_n
        if move.speed_unit is SpeedUnit.M_S:
            return controller.lin_move_at(frame, speed, blending_mm, thresholds, acceleration=cap)
        if move.kind is Kind.LIN:
            if thresholds is None:
                return controller.lin_move(frame, speed, blending_mm, acceleration=cap)
            return controller.lin_force_move(frame, speed, blending_mm, thresholds, acceleration=cap)
        if thresholds is None:
            return controller.ptp_move(frame, speed, blending_mm, acceleration=cap)
        return controller.ptp_force_move(frame, speed, blending_mm, thresholds, acceleration=cap)

    def _blending_mm(self, move: Move, target: Frame) -> float:
        """A relative one is a part of the straight way of the TCP."""
        if move.blending_unit is BlendingUnit.MM:
            return move.blending
        start = self._controller.tcp_frame_at(self._controller.end_of_queue)
        return move.blending * dist(start[:3], target[:3])

    def _blending_rel(self, move: Move, joints: Joints) -> float:
        """One in rad is a part of the largest way of a joint."""
        if move.blending_unit is not BlendingUnit.RAD:
            return move.blending
        start = self._controller.end_of_queue
        way = max(abs(b - a) for a, b in zip(start, joints, strict=True))
        return 1.0 if move.blending >= way else move.blending / way

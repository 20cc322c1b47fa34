"""The emulated controller, stepped: it takes commands between ticks and moves the robot in them."""

from collections.abc import Callable, Sequence
from math import isfinite

from iiwa_sim.contact.load import ExternalLoad, Wrench
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.controller.planner import Plan, Planner
from iiwa_sim.frames import Frame, compose
from iiwa_sim.motion.drive import Drive
from iiwa_sim.motion.move import Move
from iiwa_sim.motion.path import Joints
from iiwa_sim.motion.rate import PlannedTime
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.model import Model

LONGEST_QUEUE = 1000  # moves that wait; one more is refused


class Controller:
    """One robot. Moves are checked when they are accepted and run one after the other.

    Commands either take effect at once and return, or raise `Refused` and change nothing. Frames are in the
    base, those of moves are of the TCP. The same commands at the same ticks give the same motion.
    """

    def __init__(self, description: RobotDescription, tick_s: float) -> None:
        """At rest at home. Raises `RobotFault` where the robot's folder does not fit together."""
        self.description = description
        self.tick_s = tick_s
        self.tick = 0
        self.load = ExternalLoad(len(description.joints))
        """What pushes the robot from outside."""
        self._model = Model(description)
        self._planner = Planner(self._model)
        self._tool_in_flange = description.tool_in_flange
        time = PlannedTime(tick_s, description.stop_rate_per_s, description.stop_rate_change_per_s2)
        self._drive = Drive(description.home, time)
        self._accepted = 0

    def step(self) -> None:
        """One tick."""
        self.tick += 1
        self._drive.step()

    def joint_move(self, joints: Sequence[float], speeds_rel: Sequence[float]) -> int:
        """PTP to joint positions (rad), at a relative speed (0..1] of each joint; gives the move's number."""
        return self._accept(lambda start: self._planner.joint_line(start, joints, speeds_rel))

    def ptp_move(
        self, target: Frame, speed_rel: float, blending_mm: float, redundancy: float | None = None
    ) -> int:
        """PTP to a frame of the TCP, at a relative speed (0..1]; gives the move's number.

        The redundancy (rad) is the position of A3 at the target; without one it stays, if the target can then
        be reached. Blending is not done yet: each move stops at its target.
        """
        _check_blending(blending_mm)
        tool = self._tool_in_flange
        return self._accept(lambda start: self._planner.ptp(start, target, speed_rel, redundancy, tool))

    def lin_move(
        self, target: Frame, speed_rel: float, blending_mm: float, redundancy: float | None = None
    ) -> int:
        """LIN to a frame of the TCP; otherwise like `ptp_move`. The speed is that of the fastest joint."""
        _check_blending(blending_mm)
        tool = self._tool_in_flange
        return self._accept(lambda start: self._planner.lin(start, target, speed_rel, redundancy, tool))

    def lin_joint_move(self, joints: Sequence[float], speed_rel: float, blending_mm: float) -> int:
        """LIN to where the TCP is at joint positions (rad), which it ends in; otherwise like `lin_move`."""
        _check_blending(blending_mm)
        tool = self._tool_in_flange
        return self._accept(lambda start: self._planner.lin_to_joints(start, joints, speed_rel, tool))

    def stop(self) -> None:
        """Bring the robot to rest on its path, and forget the moves that wait."""
        self._drive.stop()

    @property
    def moving(self) -> bool:
        """Whether a move runs, is being stopped, or waits."""
        return self._drive.moving

    @property
    def joints(self) -> Joints:
        """Joint positions (rad)."""
        return self._drive.joints

    def is_pending(self, move: int) -> bool:
        """Whether a move of this number runs or waits, and has not been stopped."""
        return self._drive.is_pending(move)

    def flange_frame(self) -> Frame:
        """The flange in the base."""
        return Frame.from_transform(self._model.flange(self.joints))

    def tool_frame(self) -> Frame:
        """The TCP in the base."""
        return Frame.from_transform(compose(self._model.flange(self.joints), self._tool_in_flange))

    def cartesian_force(self) -> Wrench:
        """The wrench at the TCP in TCP orientation, acting on the robot (N, Nm)."""
        return self.load.wrench

    def joint_torque(self) -> tuple[float, ...]:
        """The external torque on each joint (Nm)."""
        return self.load.joint_torques(self._model, self.joints, self._tool_in_flange)

    def _accept(self, plan: Callable[[Joints], Plan]) -> int:
        """Plan a move from where the robot will come to rest, and queue it."""
        if self._drive.waiting >= LONGEST_QUEUE:
            raise Refused(EXECUTION, f"{LONGEST_QUEUE} moves are waiting already")
        path, timing = plan(self._drive.rest)
        self._accepted += 1
        self._drive.append(Move(self._accepted, path, timing))
        return self._accepted


def _check_blending(blending_mm: float) -> None:
    if not (isfinite(blending_mm) and blending_mm >= 0.0):
        raise Refused(EXECUTION, f"blending {blending_mm:g} mm: expected 0 or more")

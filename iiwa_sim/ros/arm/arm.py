"""An arm for the joint level of ROS 2: the controller in this process."""

from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import EMERGENCY_STOP, Refused
from iiwa_sim.controller.requests import Kind, MoveRequest
from iiwa_sim.controller.trajectories import Progress, TrajectoryEnd
from iiwa_sim.controller.trajectory_request import TrajectoryRequest
from iiwa_sim.frames import Transform
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.ros.rmi.local import LocalRobot
from iiwa_sim.ros.rmi.robot import Done, Failure, Robot

T = TypeVar("T")


class Arm(Robot, Protocol):
    """What the joint level asks of a robot. Outcomes are reported within the call or later.

    A robot behind a connection does not tell everything; what is not known is None.
    """

    @property
    def description(self) -> RobotDescription:
        """Names, limits and the URDF."""

    @property
    def time_s(self) -> float | None:
        """Simulated time since the start."""

    @property
    def joints(self) -> tuple[float, ...] | None:
        """rad"""

    @property
    def velocities(self) -> tuple[float, ...] | None:
        """rad/s"""

    @property
    def tool_in_flange(self) -> Transform | None:
        """The TCP in the flange."""

    @property
    def wrench(self) -> tuple[float, ...] | None:
        """What acts on the robot at the TCP, along its axes: N, Nm."""

    @property
    def fault(self) -> Failure | None:
        """The cause of the error state; None outside of it."""

    @property
    def progress(self) -> Progress | None:
        """How far the trajectory that is followed has come; None while there is none."""

    @property
    def output_count(self) -> int:
        """How many outputs it has, as far as is known."""

    def follow(
        self, request: TrajectoryRequest, when_ended: Callable[[TrajectoryEnd], None] | None
    ) -> tuple[int, str]:
        """Follow a trajectory; gives its number and a remark. Raises `Refused`."""

    def cancel(self, number: int) -> None:
        """Stop the trajectory of this number, if it is followed or waits."""

    def head_for(self, joints: Sequence[float], speeds: Sequence[float]) -> None:
        """Head for near joint positions (rad) as a direct move does, at parts of the joints' speeds. Raises
        `Refused`."""

    def reset_error(self, done: Done) -> None:
        """End the error state."""

    def emergency_stop(self, pressed: bool, done: Done) -> None:
        """Press or release it."""


class LocalArm(LocalRobot):
    """A controller in this process as an `Arm`."""

    def __init__(self, controller: Controller) -> None:
        super().__init__(controller)
        self.description = controller.description
        self.output_count = len(controller.io.output_names)

    @property
    def time_s(self) -> float:
        return self._controller.tick * self._controller.tick_s

    @property
    def joints(self) -> tuple[float, ...]:
        return self._controller.joints

    @property
    def velocities(self) -> tuple[float, ...]:
        return self._controller.joint_velocity()

    @property
    def tool_in_flange(self) -> Transform:
        return self._controller.tool_in_flange

    @property
    def wrench(self) -> tuple[float, ...]:
        return self._controller.cartesian_force()

    @property
    def fault(self) -> Failure | None:
        status, last = self._controller.status(), self._controller.last_error
        if not status.in_error:
            return None
        return Failure(status.error_code, "" if last is None else last.reason)

    @property
    def progress(self) -> Progress | None:
        return self._controller.trajectory

    def follow(
        self, request: TrajectoryRequest, when_ended: Callable[[TrajectoryEnd], None] | None
    ) -> tuple[int, str]:
        return self._recorded(lambda: self._controller.follow(request, when_ended))

    def cancel(self, number: int) -> None:
        self._controller.cancel_trajectory(number)

    def head_for(self, joints: Sequence[float], speeds: Sequence[float]) -> None:
        self._recorded(lambda: self._controller.move(MoveRequest(Kind.DIRECT, tuple(joints), speeds=speeds)))

    def reset_error(self, done: Done) -> None:
        self._tell(self._controller.reset_error, done)

    def emergency_stop(self, pressed: bool, done: Done) -> None:
        if pressed:
            self._controller.emergency_stop()
        elif self._controller.status().error_code == EMERGENCY_STOP:
            self._controller.release_emergency_stop()
        done(None)

    def _recorded(self, do: Callable[[], T]) -> T:
        """Do it; what is refused is the robot's last error, too."""
        try:
            return do()
        except Refused as refused:
            self._controller.record_error(refused.code, refused.reason)
            raise

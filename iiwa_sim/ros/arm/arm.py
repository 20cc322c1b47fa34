"""An arm for the joint level of ROS 2: the controller in this process."""

from collections.abc import Callable, Sequence
from typing import Protocol

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import EMERGENCY_STOP, Refused
from iiwa_sim.controller.requests import Kind, MoveRequest
from iiwa_sim.controller.trajectories import Progress, TrajectoryEnd
from iiwa_sim.controller.trajectory_request import TrajectoryRequest
from iiwa_sim.frames import Transform
from iiwa_sim.ros.rmi.robot import Failure

Done = Callable[[Failure | None], None]
"""Called with None when a request is done, or with the reason when it failed."""


class Arm(Protocol):
    """What the joint level asks of a robot. Everything takes effect within the call."""

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Base first."""

    @property
    def urdf(self) -> str:
        """The text of the URDF."""

    @property
    def flange(self) -> str:
        """The link of the URDF that is the flange."""

    @property
    def time_s(self) -> float:
        """Simulated time since the start."""

    @property
    def joints(self) -> tuple[float, ...]:
        """rad"""

    @property
    def velocities(self) -> tuple[float, ...]:
        """rad/s"""

    @property
    def tool_in_flange(self) -> Transform:
        """The TCP in the flange."""

    @property
    def wrench(self) -> tuple[float, ...]:
        """What acts on the robot at the TCP, along its axes: N, Nm."""

    @property
    def fault(self) -> Failure | None:
        """The cause of the state of error; None outside of it."""

    @property
    def progress(self) -> Progress | None:
        """Of the trajectory that is followed; None while there is none."""

    def follow(
        self, request: TrajectoryRequest, when_ended: Callable[[TrajectoryEnd], None] | None
    ) -> tuple[int, str]:
        """Follow a trajectory; gives its number and a remark. Raises `Refused`."""

    def cancel(self, number: int) -> None:
        """Stop the trajectory of this number, if it is followed or waits."""

    def head_for(self, joints: Sequence[float]) -> None:
        """Head for near joint positions (rad) as a direct move does. Raises `Refused`."""

    def stop(self) -> None:
        """Stop the robot, and forget what waits."""

    def reset_error(self) -> None:
        """End the state of error. Raises `Refused`."""

    def emergency_stop(self, pressed: bool) -> None:
        """Press or release it."""


class LocalArm:
    """A controller in this process as an `Arm`."""

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        description = controller.description
        self.joint_names = description.joints
        self.urdf = description.urdf
        self.flange = description.flange

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
        try:
            return self._controller.follow(request, when_ended)
        except Refused as refused:
            self._controller.record_error(refused.code, refused.reason)
            raise

    def cancel(self, number: int) -> None:
        self._controller.cancel_trajectory(number)

    def head_for(self, joints: Sequence[float]) -> None:
        request = MoveRequest(Kind.DIRECT, tuple(joints), speeds=(1.0,) * len(self.joint_names))
        try:
            self._controller.move(request)
        except Refused as refused:
            self._controller.record_error(refused.code, refused.reason)
            raise

    def stop(self) -> None:
        self._controller.stop()

    def reset_error(self) -> None:
        self._controller.reset_error()

    def emergency_stop(self, pressed: bool) -> None:
        if pressed:
            self._controller.emergency_stop()
        elif self._controller.status().error_code == EMERGENCY_STOP:
            self._controller.release_emergency_stop()

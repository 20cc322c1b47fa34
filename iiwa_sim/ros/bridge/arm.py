"""A robot behind a connection as the `Arm` of the joint level: what its text protocol can do, and no more."""

import logging
from collections.abc import Callable, Sequence

from iiwa_sim.client import AsyncIiwa
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.controller.trajectories import Progress, TrajectoryEnd
from iiwa_sim.controller.trajectory_request import TrajectoryRequest
from iiwa_sim.frames import Transform, compose, inverse
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.model import Model
from iiwa_sim.ros.bridge.remote import RemoteRobot
from iiwa_sim.ros.rmi.robot import Done, Failure

NO_TRAJECTORIES = "a robot behind a bridge follows no trajectories: the text protocol has none"
NO_EMERGENCY_STOP = "the text protocol has no emergency stop: /stop stops the robot"

logger = logging.getLogger(__name__)


class RemoteArm(RemoteRobot):
    """A robot behind a connection as an `Arm`. Requests are carried out in the bridge's next round."""

    time_s = None
    velocities = None
    wrench = None
    progress: Progress | None = None

    def __init__(self, client: AsyncIiwa, description: RobotDescription) -> None:
        super().__init__(client, description)
        self._model = Model(description)
        self._last_refusal = ""

    @property
    def joints(self) -> tuple[float, ...] | None:
        state = self.state
        return None if state is None else state.joints

    @property
    def tool_in_flange(self) -> Transform | None:
        state = self.state
        if state is None:
            return None
        return compose(inverse(self._model.flange(state.joints)), state.tool_frame.to_transform())

    @property
    def fault(self) -> Failure | None:
        status = self.status
        if status is None or status.in_error != 1:
            return None
        return Failure(status.error_code, "the robot is in an error state, or out of reach")

    @property
    def output_count(self) -> int:
        state = self.state
        return 0 if state is None or state.outputs is None else len(state.outputs)

    def follow(self, _: TrajectoryRequest, __: Callable[[TrajectoryEnd], None] | None) -> tuple[int, str]:
        raise Refused(EXECUTION, NO_TRAJECTORIES)

    def cancel(self, number: int) -> None:
        """Do nothing: there is none."""

    def head_for(self, joints: Sequence[float], speeds: Sequence[float]) -> None:
        self.send_target(tuple(joints), tuple(speeds), self._was_refused)

    def emergency_stop(self, _: bool, done: Done) -> None:
        done(Failure(EXECUTION, NO_EMERGENCY_STOP))

    def _was_refused(self, failure: Failure | None) -> None:
        """Tell why a target was not taken, once: the next one follows soon."""
        if failure is not None and failure.reason != self._last_refusal:
            self._last_refusal = failure.reason
            logger.warning("a direct move was refused: %s", failure.reason)

"""What the controller can be asked for."""

from math import dist

from iiwa_sim.controller.core import Core
from iiwa_sim.controller.errors import (
    ErrorRecord,
)
from iiwa_sim.controller.faults import NO_CODE
from iiwa_sim.controller.modes import (
    TRANSITIONS,
    Event,
)
from iiwa_sim.controller.status import AUTOMATIC, RobotStatus
from iiwa_sim.frames import Frame, Transform
from iiwa_sim.motion.joints import Joints


class Readings(Core):
    """The robot as it is now; nothing here changes anything."""

    def status(self) -> RobotStatus:
        """The state of the robot, as ROS-Industrial puts it."""
        faults = self._faults
        standing = faults.standing
        return RobotStatus(
            mode=AUTOMATIC,
            e_stopped=int(faults.e_stopped),
            drives_powered=int(faults.drives_powered),
            motion_possible=int(standing is None),
            in_motion=int(self.moving and not self._motions.pausing),
            in_error=int(standing is not None),
            error_code=NO_CODE if standing is None else standing.code,
        )

    @property
    def last_error(self) -> ErrorRecord | None:
        """What has stopped the robot and was not reset, else the last refused command since a reset."""
        return self._faults.last

    @property
    def under_way(self) -> bool:
        """Whether the robot moves, and will stop without another command.

        That is not so while an override of 0 pauses it, and in a gravity hold.
        """
        return self.moving and not self._motions.pausing and not self._motions.holding

    @property
    def accepted(self) -> int:
        """Moves accepted since the start: the number of the newest one."""
        return self._accepted

    @property
    def queue(self) -> int:
        """How many moves wait behind the one that runs, or begins in the next tick."""
        return self._motions.behind

    def joint_velocity(self) -> tuple[float, ...]:
        """Joint velocities (rad/s) in the last tick: the difference it made, over its time."""
        last = zip(self.joints, self._joints_before, strict=True)
        return tuple((now - before) / self.tick_s for now, before in last)

    @property
    def move_under_way(self) -> int:
        """The number of the normal move that runs and is not being stopped, 0 where there is none."""
        return self._motions.under_way

    def flange_frame(self) -> Frame:
        """The flange in the base."""
        return Frame.from_transform(self._model.flange(self.joints))

    @property
    def goal_joints(self) -> Joints:
        """Joint positions (rad) at the end of the move under way, not the last of the queue.

        In servo modes those of the target, during a stop those at which it ends, at rest the present ones.
        """
        return self._motions.goal

    def goal_frame(self) -> Frame:
        """The TCP in the base at `goal_joints`."""
        return self.tcp_frame_at(self.goal_joints)

    def distance_to_goal_mm(self) -> float:
        """How far the TCP is from there, in a straight line (mm)."""
        return 1e3 * dist(self._tcp(self.joints).translation, self._tcp(self.goal_joints).translation)

    def joint_torque(self) -> tuple[float, ...]:
        """The external torque on each joint (Nm)."""
        return self.load.joint_torques(self.joints)

    def tcp(self, joints: Joints | None = None) -> Transform:
        """The pose of the TCP in the base at joint positions (rad), None for the present ones."""
        return self._tcp(self.joints if joints is None else joints)

    @property
    def tool_in_flange(self) -> Transform:
        """The pose of the TCP in the flange."""
        return self._tool_in_flange

    @property
    def end_of_queue(self) -> Joints:
        """Joint positions (rad) at which the next normal move begins."""
        stops = TRANSITIONS[self.mode, Event.NORMAL_MOVE].stops
        return self._motions.rest_after_stop() if stops else self._motions.rest

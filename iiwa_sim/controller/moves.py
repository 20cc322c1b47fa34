"""The moves the controller takes: checked, planned from where the robot will be, and queued or headed for."""

from collections.abc import Callable, Sequence

from iiwa_sim.controller.acceleration import AccelerationCap, capped_joints
from iiwa_sim.controller.core import REPLACED
from iiwa_sim.controller.errors import (
    COMPONENT_NOT_READY,
    EXECUTION,
    STOP_TRIGGERED,
    Refused,
)
from iiwa_sim.controller.force_guard import ForceGuard, Thresholds, checked
from iiwa_sim.controller.modes import (
    TRANSITIONS,
    Event,
    Mode,
)
from iiwa_sim.controller.motions import Target
from iiwa_sim.controller.planner import JOINT_BLENDING, Plan
from iiwa_sim.controller.poses import shifted
from iiwa_sim.controller.readings import Readings
from iiwa_sim.controller.stiffness import check_joint_stiffness, manner_of
from iiwa_sim.frames import Frame
from iiwa_sim.motion.compliance_kernel import Manner
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.queue.move import Move

HOLD_ENDS = "a gravity hold is on: stop ends it"
LONGEST_QUEUE = 1000  # moves that wait; one more is refused


class Moves(Readings):
    """All kinds of moves. Each gives the number of the move, or raises `Refused` and changes nothing."""

    def joint_move(
        self,
        joints: Sequence[float],
        speeds_rel: Sequence[float],
        blending_rel: float = JOINT_BLENDING,
        *,
        acceleration: AccelerationCap | None = None,
    ) -> int:
        """PTP to joint positions (rad), at a relative speed (0..1] of each joint; gives the move's number.

        It blends into the next move where each joint has no more than that part (0..1) of the largest way to
        go, a tenth as published for the original; with 0 the robot stops at the target. An acceleration caps
        the robot's own.
        """
        return self._accept(
            lambda start: self._planner.joint_line(start, joints, speeds_rel, blending_rel),
            acceleration=acceleration,
        )

    def ptp_move(
        self,
        target: Frame,
        speed_rel: float,
        blending_mm: float,
        redundancy: float | None = None,
        *,
        acceleration: AccelerationCap | None = None,
    ) -> int:
        """PTP to a frame of the TCP, at a relative speed (0..1]; gives the move's number.

        The redundancy (rad) is the position of A3 at the target; without one it stays, if the target can then
        be reached. Blending is the radius of the sphere round the target in which the TCP may leave the path
        for that of the next move; with 0 the robot stops at the target. An acceleration caps the robot's own.
        """
        tool = self._tool_in_flange
        return self._accept(
            lambda start: self._planner.ptp(start, target, speed_rel, blending_mm, redundancy, tool),
            acceleration=acceleration,
        )

    def lin_move(
        self,
        target: Frame,
        speed_rel: float,
        blending_mm: float,
        redundancy: float | None = None,
        *,
        acceleration: AccelerationCap | None = None,
    ) -> int:
        """LIN to a frame of the TCP; otherwise like `ptp_move`. The speed is that of the fastest joint."""
        tool = self._tool_in_flange
        return self._accept(
            lambda start: self._planner.lin(start, target, speed_rel, blending_mm, redundancy, tool),
            acceleration=acceleration,
        )

    def lin_move_at(
        self,
        target: Frame,
        tcp_speed_m_s: float,
        blending_mm: float,
        thresholds: Thresholds | None = None,
        *,
        acceleration: AccelerationCap | None = None,
    ) -> int:
        """LIN to a frame of the TCP, which is nowhere faster than that; otherwise like `lin_move`.

        That is one relative speed for all of the line: the TCP comes to its speed where the joints have the
        least to do. With thresholds it ends as `lin_force_move` does.
        """
        tool = self._tool_in_flange
        return self._accept(
            lambda start: self._planner.lin_at(start, target, tcp_speed_m_s, blending_mm, tool),
            thresholds,
            acceleration,
        )

    def lin_joint_move(
        self,
        joints: Sequence[float],
        speed_rel: float,
        blending_mm: float,
        *,
        acceleration: AccelerationCap | None = None,
    ) -> int:
        """LIN to where the TCP is at joint positions (rad), which it ends in; otherwise like `lin_move`."""
        tool = self._tool_in_flange
        return self._accept(
            lambda start: self._planner.lin_to_joints(start, joints, speed_rel, blending_mm, tool),
            acceleration=acceleration,
        )

    def ptp_relative_move(self, shift: Frame, speed_rel: float, blending_mm: float, *, in_tool: bool) -> int:
        """PTP to where the TCP is when it has gone by a shift; otherwise like `ptp_move`.

        The shift is in the axes of the base or of the tool, from where the TCP will be when the moves that
        wait are done. The target is fixed now: what becomes of those moves does not change it.
        """
        return self.ptp_move(self._shifted(shift, in_tool=in_tool), speed_rel, blending_mm)

    def lin_relative_move(self, shift: Frame, speed_rel: float, blending_mm: float, *, in_tool: bool) -> int:
        """LIN; otherwise like `ptp_relative_move`."""
        return self.lin_move(self._shifted(shift, in_tool=in_tool), speed_rel, blending_mm)

    def check_reach(self, target: Frame, redundancy: float | None = None) -> None:
        """Raises `Refused` where `ptp_move` would, with the reason; changes nothing."""
        self._planner.ptp(self.end_of_queue, target, 1.0, 0.0, redundancy, self._tool_in_flange)

    def check_line(self, target: Frame, redundancy: float | None = None) -> None:
        """Raises `Refused` where `lin_move` would, with the reason; changes nothing."""
        self._planner.lin(self.end_of_queue, target, 1.0, 0.0, redundancy, self._tool_in_flange)

    def lin_force_move(
        self,
        target: Frame,
        speed_rel: float,
        blending_mm: float,
        thresholds: Thresholds,
        *,
        acceleration: AccelerationCap | None = None,
    ) -> int:
        """As `lin_move`, until a force at the TCP has changed by more than its threshold (N).

        It is compared with that at the command, in TCP axes. In the tick after one is beyond its threshold
        the robot begins to stop on its path, and then goes on with the next move. Forces are watched from the
        tick in which the move begins to the one before it ends; of two moves that blend into each other one
        ends and the other begins where `is_pending` of the first changes.
        """
        tool = self._tool_in_flange
        return self._accept(
            lambda start: self._planner.lin(start, target, speed_rel, blending_mm, None, tool),
            thresholds,
            acceleration,
        )

    def ptp_force_move(
        self,
        target: Frame,
        speed_rel: float,
        blending_mm: float,
        thresholds: Thresholds,
        *,
        acceleration: AccelerationCap | None = None,
    ) -> int:
        """As `ptp_move`, until a force has changed by more than its threshold: see `lin_force_move`."""
        tool = self._tool_in_flange
        return self._accept(
            lambda start: self._planner.ptp(start, target, speed_rel, blending_mm, None, tool),
            thresholds,
            acceleration,
        )

    def lin_stiff_move(
        self, target: Frame, speed_rel: float, stiffness_n_per_m: float, balanced: Sequence[float]
    ) -> int:
        """LIN to a frame of the TCP, around which the robot yields; gives the move's number.

        Translational stiffness is 0 to 5000 N/m. `balanced` are a force (N) and a torque (Nm) at the TCP,
        along its axes, that would push it off: the controller adds their negative.
        """
        tool = self._tool_in_flange
        manner = manner_of(stiffness_n_per_m, balanced)
        return self._yield(lambda start: self._planner.lin(start, target, speed_rel, 0.0, None, tool), manner)

    def ptp_stiff_move(
        self, target: Frame, speed_rel: float, stiffness_n_per_m: float, balanced: Sequence[float]
    ) -> int:
        """PTP to a frame of the TCP; otherwise like `lin_stiff_move`."""
        tool = self._tool_in_flange
        manner = manner_of(stiffness_n_per_m, balanced)
        return self._yield(lambda start: self._planner.ptp(start, target, speed_rel, 0.0, None, tool), manner)

    def start_gravity(self, stiffness_nm_per_rad: float) -> int:
        """Hold every joint by a spring where it then is; gives the hold's number.

        The stiffness is 0 to 5000 Nm/rad. What runs is cancelled: the hold begins where the robot has come to
        rest. It ends with a stop, a stiffness move, or another hold; moves of other modes are refused.
        """
        self._faults.check()
        check_joint_stiffness(stiffness_nm_per_rad)
        self._enter(TRANSITIONS[self.mode, Event.IMPEDANCE_MOVE])
        self._accepted += 1
        with self.endings.because(STOP_TRIGGERED, REPLACED):
            self._motions.hold(self._accepted, stiffness_nm_per_rad)
        self.endings.accepted(self._accepted)
        return self._accepted

    def smart_joint_move(
        self,
        joints: Sequence[float],
        speeds_rel: Sequence[float],
        *,
        acceleration: AccelerationCap | None = None,
    ) -> int:
        """Head for joint positions (rad) from wherever the robot is; gives the move's number.

        The relative speeds (0..1] are those of the joints. An acceleration caps that of the mode.
        """
        return self._servo(
            Event.SMART_MOVE,
            lambda mode, here, moving: self._targets.joints(mode, here, moving, joints, speeds_rel),
            acceleration,
        )

    def smart_cartesian_move(
        self, flange: Frame, speed_rel: float, *, acceleration: AccelerationCap | None = None
    ) -> int:
        """Head with the flange for a frame in the base; otherwise like `smart_joint_move`."""
        return self._servo(
            Event.SMART_MOVE,
            lambda mode, here, moving: self._targets.flange(mode, here, moving, flange, speed_rel),
            acceleration,
        )

    def direct_joint_move(
        self,
        joints: Sequence[float],
        speeds_rel: Sequence[float],
        *,
        acceleration: AccelerationCap | None = None,
    ) -> int:
        """Like `smart_joint_move`, stiffer, to joint positions near the present ones."""
        return self._servo(
            Event.DIRECT_MOVE,
            lambda mode, here, moving: self._targets.joints(mode, here, moving, joints, speeds_rel),
            acceleration,
        )

    def direct_cartesian_move(
        self, flange: Frame, speed_rel: float, *, acceleration: AccelerationCap | None = None
    ) -> int:
        """Like `smart_cartesian_move`, stiffer, to joint positions near the present ones."""
        return self._servo(
            Event.DIRECT_MOVE,
            lambda mode, here, moving: self._targets.flange(mode, here, moving, flange, speed_rel),
            acceleration,
        )

    def _accept(
        self,
        uncapped: Callable[[Joints], Plan],
        thresholds: Thresholds | None = None,
        acceleration: AccelerationCap | None = None,
    ) -> int:
        """Plan a normal move from where the robot will come to rest, and queue it."""

        def plan(start: Joints) -> Plan:
            return self._planner.with_acceleration(uncapped(start), acceleration)

        self._faults.check()
        motions, change = self._motions, TRANSITIONS[self.mode, Event.NORMAL_MOVE]
        self._check_hold()
        self._check_room()
        start = self.end_of_queue
        planned = plan(start)
        if thresholds is not None:
            checked(thresholds)
        self._enter(change)
        self._accepted += 1
        motions.append(self._move(self._accepted, plan, planned))
        self.endings.accepted(self._accepted)
        if thresholds is not None:
            self._guards.add(ForceGuard(self._accepted, thresholds, self.cartesian_force()))
        return self._accepted

    def _shifted(self, shift: Frame, *, in_tool: bool) -> Frame:
        return shifted(self._tcp(self.end_of_queue), shift, in_tool=in_tool)

    def _move(self, number: int, plan: Callable[[Joints], Plan], planned: Plan) -> Move:
        return Move(number, *planned, lambda start: self._plan_again(number, plan, start))

    def _plan_again(self, number: int, plan: Callable[[Joints], Plan], start: Joints) -> Move | None:
        """An accepted move, to begin elsewhere (rad). Where that is impossible, say so."""
        try:
            planned = plan(start)
        except Refused as refused:
            lost = f"move {number} and those behind it are forgotten, planned again after a move ended early"
            reason = f"{lost}: {refused.reason}"
            self.record_error(refused.code, reason)
            self._tell(refused.code, reason)
            self.endings.lost(number, refused.code, reason)
            return None
        return self._move(number, plan, planned)

    def _yield(self, plan: Callable[[Joints], Plan], manner: Manner) -> int:
        """Plan a stiffness move from where the nominal motion is, and carry it out in place of what runs."""
        self._faults.check()
        motions, change = self._motions, TRANSITIONS[self.mode, Event.IMPEDANCE_MOVE]
        start = motions.rest_after_stop() if change.stops else motions.rest
        planned = plan(start)
        if motions.moving and not change.stops:
            self._targets.check_way_back(planned.limits)
        self._enter(change)
        self._accepted += 1
        with self.endings.because(STOP_TRIGGERED, REPLACED):
            motions.head_yielding(self._move(self._accepted, plan, planned), manner)
        self.endings.accepted(self._accepted)
        return self._accepted

    def _check_hold(self) -> None:
        if self._motions.holding:
            raise Refused(COMPONENT_NOT_READY, HOLD_ENDS)

    def _check_room(self) -> None:
        if self._motions.waiting >= LONGEST_QUEUE:
            raise Refused(EXECUTION, f"{LONGEST_QUEUE} moves are waiting already")

    def _servo(
        self,
        event: Event,
        find: Callable[[Mode, Joints, bool], tuple[Joints, JointLimits]],
        acceleration: AccelerationCap | None,
    ) -> int:
        """Find the target of a servo from where that will set out, and head for it."""
        self._faults.check()
        motions, change = self._motions, TRANSITIONS[self.mode, event]
        self._check_hold()
        here = motions.rest_after_stop() if change.stops else motions.present
        joints, limits = find(change.mode, here, motions.moving and not change.stops)
        if acceleration is not None:
            limits = capped_joints(limits, acceleration)
        self._enter(change)
        self._accepted += 1
        with self.endings.because(STOP_TRIGGERED, REPLACED):
            motions.head_for(Target(self._accepted, joints, limits))
        self.endings.accepted(self._accepted)
        self._servo_heard = self.tick
        return self._accepted

"""The emulated controller, stepped: it takes commands between ticks and moves the robot in them."""

from collections.abc import Callable, Sequence
from math import dist

from iiwa_sim.contact.load import ExternalLoad
from iiwa_sim.contact.noise import Noise
from iiwa_sim.contact.world import World
from iiwa_sim.contact.wrench import Wrench
from iiwa_sim.controller.assembly import motions_of
from iiwa_sim.controller.endings import Endings
from iiwa_sim.controller.errors import (
    COMMUNICATION_FAILURE,
    COMPONENT_NOT_READY,
    EMERGENCY_STOP,
    EXECUTION,
    STOP_TRIGGERED,
    SUCCESS,
    ErrorRecord,
    Refused,
)
from iiwa_sim.controller.faults import DRIVES_OFF, NO_CODE, PRESSED, Faults
from iiwa_sim.controller.force_guard import Contact, ForceGuard, ForceGuards, Thresholds, checked
from iiwa_sim.controller.io import Io
from iiwa_sim.controller.modes import (
    LONGEST_SERVO_TIMEOUT_S,
    SERVO_MODES,
    TRANSITIONS,
    Event,
    Mode,
    Transition,
)
from iiwa_sim.controller.motions import Motions, Target
from iiwa_sim.controller.planner import JOINT_BLENDING, Plan, Planner
from iiwa_sim.controller.poses import shifted
from iiwa_sim.controller.status import AUTOMATIC, RobotStatus
from iiwa_sim.controller.stiffness import check_joint_stiffness, manner_of
from iiwa_sim.controller.targets import Targets
from iiwa_sim.frames import Frame, Transform, compose
from iiwa_sim.motion.compliance import Manner
from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.move import Move
from iiwa_sim.motion.path import Joints
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.model import Model

HOLD_ENDS = "a gravity hold is on, which ends with stop only"
LONGEST_QUEUE = 1000  # moves that wait; one more is refused
REPLACED = "replaced by a newer move, of a servo or in another mode"


class Controller:
    """One robot, in one of the modes of `iiwa_sim.controller.modes`.

    Normal moves are checked when they are accepted and run one after the other; a smart or direct move takes
    the place of the one before. Commands either take effect at once and return, or raise `Refused` and change
    nothing; what has to wait until the robot rests, since the mode changes, is planned from where that will
    be. Frames are in the base, those of normal moves are of the TCP, of smart and direct moves of the flange.
    The same commands at the same ticks give the same motion.
    """

    def __init__(
        self,
        description: RobotDescription,
        tick_s: float,
        *,
        start: Joints | None = None,
        tool_in_flange: Transform | None = None,
        world: World | None = None,
        noise: Noise | None = None,
        io: Io | None = None,
        servo_timeout_s: float | None = None,
        on_fault: Callable[[int, str], None] | None = None,
        on_contact: Callable[[Contact], None] | None = None,
    ) -> None:
        """At rest at `start` (rad, within the limits), None for home; the TCP is the robot's own for None.

        The TCP touches the surfaces of `world`; the robot goes where it is sent, however hard it presses.
        `noise` is added to the readings of forces and torques. There are the inputs and outputs of `io`, or
        16 of each. The robot stops by itself when a servo mode hears of no command for `servo_timeout_s`,
        None for never. `on_fault` is told the code and the reason of what goes wrong between commands,
        `on_contact` which force has ended a move. Raises `RobotFault` where the robot's folder does not fit
        together, and ValueError for a timeout out of range.
        """
        if servo_timeout_s is not None and not 0.0 < servo_timeout_s <= LONGEST_SERVO_TIMEOUT_S:
            limits = f"above 0 and up to {LONGEST_SERVO_TIMEOUT_S:g} s"
            raise ValueError(f"servo_timeout_s is {servo_timeout_s}, expected {limits}")
        self.description = description
        self.tick_s = tick_s
        self.servo_timeout_s = servo_timeout_s
        self.tick = 0
        self.mode = Mode.UNKNOWN
        """That of the last command: it changes with the command, also where the robot has to stop first."""
        self.io = Io() if io is None else io
        self._model = Model(description)
        self._planner = Planner(self._model)
        self._targets = Targets(self._planner, description)
        self._tool_in_flange = description.tool_in_flange if tool_in_flange is None else tool_in_flange
        start = description.home if start is None else start
        self.load = ExternalLoad(self._model, self._tool_in_flange, start, world, noise)
        """What pushes the robot from outside, and what it touches."""
        self._motions = self._motions_from(start)
        self._joints_before = self._motions.joints  # the last tick
        self.endings = Endings(self.is_pending)
        """Tells its listeners how each move ended."""
        self._faults = Faults()
        self._accepted = 0
        self._on_fault = on_fault
        self._on_contact = on_contact
        self._guards = ForceGuards()
        self._servo_heard = 0  # in this tick

    def step(self) -> None:
        """One tick: the robot moves, then feels the forces where it is now, then compares with thresholds.

        So a stop that a force asks for begins in the tick after the one in which its threshold is passed. A
        fault of ours in a tick stops the robot, is an error to be reset, and is raised.
        """
        self._watch_servo()
        self.tick += 1
        self._joints_before = self._motions.joints
        try:
            self._motions.step()
        except Exception as fault:
            reason = f"internal fault: {type(fault).__name__}, told in the log"
            self._faults.fail(EXECUTION, reason)
            self.endings.lost(0, EXECUTION, reason)
            self.stop()
            raise
        self.endings.after_tick()
        self.load.step(self._motions.joints, self.tick_s)
        if self._guards:
            self._watch_forces()

    def joint_move(
        self,
        joints: Sequence[float],
        speeds_rel: Sequence[float],
        blending_rel: float = JOINT_BLENDING,
    ) -> int:
        """PTP to joint positions (rad), at a relative speed (0..1] of each joint; gives the move's number.

        It blends into the next move where each joint has no more than that part (0..1) of the largest way to
        go, a tenth as published for the original; with 0 the robot stops at the target.
        """
        return self._accept(lambda start: self._planner.joint_line(start, joints, speeds_rel, blending_rel))

    def ptp_move(
        self, target: Frame, speed_rel: float, blending_mm: float, redundancy: float | None = None
    ) -> int:
        """PTP to a frame of the TCP, at a relative speed (0..1]; gives the move's number.

        The redundancy (rad) is the position of A3 at the target; without one it stays, if the target can then
        be reached. Blending is the radius of the sphere round the target in which the TCP may leave the path
        for that of the next move; with 0 the robot stops at the target.
        """
        tool = self._tool_in_flange
        return self._accept(
            lambda start: self._planner.ptp(start, target, speed_rel, blending_mm, redundancy, tool)
        )

    def lin_move(
        self, target: Frame, speed_rel: float, blending_mm: float, redundancy: float | None = None
    ) -> int:
        """LIN to a frame of the TCP; otherwise like `ptp_move`. The speed is that of the fastest joint."""
        tool = self._tool_in_flange
        return self._accept(
            lambda start: self._planner.lin(start, target, speed_rel, blending_mm, redundancy, tool)
        )

    def lin_move_at(
        self,
        target: Frame,
        tcp_speed_m_s: float,
        blending_mm: float,
        thresholds: Thresholds | None = None,
    ) -> int:
        """LIN to a frame of the TCP, which is nowhere faster than that; otherwise like `lin_move`.

        That is one relative speed for all of the line: the TCP comes to its speed where the joints have the
        least to do. With thresholds it ends as `lin_force_move` does.
        """
        tool = self._tool_in_flange
        return self._accept(
            lambda start: self._planner.lin_at(start, target, tcp_speed_m_s, blending_mm, tool), thresholds
        )

    def lin_joint_move(self, joints: Sequence[float], speed_rel: float, blending_mm: float) -> int:
        """LIN to where the TCP is at joint positions (rad), which it ends in; otherwise like `lin_move`."""
        tool = self._tool_in_flange
        return self._accept(
            lambda start: self._planner.lin_to_joints(start, joints, speed_rel, blending_mm, tool)
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
        self, target: Frame, speed_rel: float, blending_mm: float, thresholds: Thresholds
    ) -> int:
        """As `lin_move`, until a force at the TCP has changed by more than its threshold (N).

        It is compared with that at the command, in TCP axes. In the tick after one is beyond its threshold
        the robot begins to stop on its path, and then goes on with the next move. Forces are watched from the
        tick in which the move begins to the one before it ends; of two moves that blend into each other one
        ends and the other begins where `is_pending` of the first changes.
        """
        tool = self._tool_in_flange
        return self._accept(
            lambda start: self._planner.lin(start, target, speed_rel, blending_mm, None, tool), thresholds
        )

    def ptp_force_move(
        self, target: Frame, speed_rel: float, blending_mm: float, thresholds: Thresholds
    ) -> int:
        """As `ptp_move`, until a force has changed by more than its threshold: see `lin_force_move`."""
        tool = self._tool_in_flange
        return self._accept(
            lambda start: self._planner.ptp(start, target, speed_rel, blending_mm, None, tool), thresholds
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
        """Hold every joint by a spring where it then is, until a stop; gives the hold's number.

        The stiffness is 0 to 5000 Nm/rad. Stiffness moves before it are done first. Normal and stiffness
        moves behind it are checked from there, and wait; smart and direct moves are refused.
        """
        self._faults.check()
        check_joint_stiffness(stiffness_nm_per_rad)
        self._check_room()
        self._enter(TRANSITIONS[self.mode, Event.IMPEDANCE_MOVE])
        self._accepted += 1
        self._motions.hold(self._accepted, stiffness_nm_per_rad)
        self.endings.accepted(self._accepted)
        return self._accepted

    def smart_joint_move(self, joints: Sequence[float], speeds_rel: Sequence[float]) -> int:
        """Head for joint positions (rad) from wherever the robot is; gives the move's number.

        The relative speeds (0..1] are those of the joints.
        """
        return self._servo(
            Event.SMART_MOVE, lambda mode, here: self._targets.joints(mode, here, joints, speeds_rel)
        )

    def smart_cartesian_move(self, flange: Frame, speed_rel: float) -> int:
        """Head with the flange for a frame in the base; otherwise like `smart_joint_move`."""
        return self._servo(
            Event.SMART_MOVE, lambda mode, here: self._targets.flange(mode, here, flange, speed_rel)
        )

    def direct_joint_move(self, joints: Sequence[float], speeds_rel: Sequence[float]) -> int:
        """Like `smart_joint_move`, stiffer, to joint positions near the present ones."""
        return self._servo(
            Event.DIRECT_MOVE, lambda mode, here: self._targets.joints(mode, here, joints, speeds_rel)
        )

    def direct_cartesian_move(self, flange: Frame, speed_rel: float) -> int:
        """Like `smart_cartesian_move`, stiffer, to joint positions near the present ones."""
        return self._servo(
            Event.DIRECT_MOVE, lambda mode, here: self._targets.flange(mode, here, flange, speed_rel)
        )

    def stop(self) -> None:
        """Bring the robot to rest on its path, and forget the moves that wait."""
        self._halt(STOP_TRIGGERED, "stopped")

    def cancel_move(self) -> None:
        """End the move that runs: stop on its path, and go on with the next one from where the robot then is.

        In a servo mode that is the move to the present target; the mode stays. Where nothing runs, or the
        robot is being stopped, nothing changes.
        """
        if self._motions.hold_runs:
            raise Refused(COMPONENT_NOT_READY, HOLD_ENDS)
        with self.endings.because(STOP_TRIGGERED, "cancelled"):
            self._motions.cancel()

    def clear_queue(self) -> None:
        """Forget the moves that wait; the one that runs ends at its target.

        Where it has begun to blend into the next one, or is about to and too fast to rest at its target, the
        robot stops on its path.
        """
        with self.endings.because(STOP_TRIGGERED, "forgotten: the queue was cleared"):
            self._motions.clear()

    @property
    def queue(self) -> int:
        """How many moves wait behind the one that runs, or begins in the next tick."""
        return self._motions.behind

    @property
    def override(self) -> float:
        """The part of their planned speed at which all motions run or will run, 0..1."""
        return self._motions.override

    def set_override(self, override: float) -> None:
        """Run all motions at this part of their planned speed, from 0, a pause, to 1.

        What moves stays on its path and keeps the planned limits; so it takes up to a second. At rest the
        override is there at once. Raises `Refused` for a number out of range.
        """
        if not 0.0 <= override <= 1.0:
            raise Refused(EXECUTION, f"override {override:g}: expected 0 to 1")
        self._motions.set_override(override)

    def emergency_stop(self) -> None:
        """Stop as `stop` does, and take no moves until it is released and the error reset."""
        self._faults.press_emergency_stop()
        self._halt(EMERGENCY_STOP, PRESSED)
        self._tell(EMERGENCY_STOP, PRESSED)

    def release_emergency_stop(self) -> None:
        """The error remains, to be reset."""
        self._faults.release_emergency_stop()

    def switch_drives(self, on: bool) -> None:
        """Off: stop as `stop` does, and take no moves until they are on again and the error reset."""
        self._faults.switch_drives(on)
        if not on:
            self._halt(COMPONENT_NOT_READY, DRIVES_OFF)
            self._tell(COMPONENT_NOT_READY, DRIVES_OFF)

    def fail(self, code: int, reason: str) -> None:
        """Something goes wrong: stop as `stop` does, and take no moves until the error is reset."""
        self._faults.fail(code, reason)
        self._halt(code, reason)
        self._tell(code, reason)

    def refuse_next_move(self, refusal: ErrorRecord | None) -> None:
        """Refuse the next move outside of the state of error, whatever it asks for; None takes that back."""
        self._faults.refuse_next(refusal)

    def time_out_servo(self) -> None:
        """Stop as if a servo mode had heard of no command for too long; raises `Refused` in other modes."""
        if self.mode not in SERVO_MODES:
            modes = " or ".join(mode.value for mode in SERVO_MODES)
            raise Refused(EXECUTION, f"the mode is {self.mode.value}: expected {modes}")
        self._end_servo(f"no {self.mode.value} command in time: the robot stops")

    def place(self, joints: Sequence[float]) -> None:
        """Be at rest at joint positions (rad), without a way there, in no mode.

        Raises `Refused` outside the limits, and while anything moves or waits.
        """
        checked = self.check_place(joints)
        self._begin_anew(checked)
        self._joints_before = checked
        self.load.place(checked, self._tool_in_flange)

    def check_place(self, joints: Sequence[float]) -> Joints:
        """Raises `Refused` where `place` would; changes nothing."""
        self._check_rest()
        return self._planner.joint_target(joints, [1.0] * len(joints))

    @property
    def tool_in_flange(self) -> Transform:
        """The pose of the TCP in the flange."""
        return self._tool_in_flange

    def set_tool(self, tool_in_flange: Transform) -> None:
        """Take the TCP to be there from now on, in no mode; raises `Refused` while anything moves or waits.

        What waits was planned with the tool before.
        """
        self._check_rest()
        self._tool_in_flange = tool_in_flange
        self._begin_anew(self.joints)
        self.load.place(self.joints, tool_in_flange)

    def record_error(self, code: int, reason: str) -> None:
        """Remember why a command was refused; codes are those of `iiwa_sim.controller.errors`."""
        self._faults.record(code, reason)

    def reset_error(self) -> None:
        """End the state of error, and forget the last refusal.

        Raises `Refused` while the emergency stop is pressed.
        """
        self._faults.reset()

    @property
    def last_error(self) -> ErrorRecord | None:
        """What has stopped the robot and was not reset, else the last refused command since a reset."""
        return self._faults.last

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
    def moving(self) -> bool:
        """Whether anything moves, is being stopped, or waits, also for an override above 0."""
        return self._motions.moving

    @property
    def under_way(self) -> bool:
        """Whether the robot moves, and will stop without another command.

        That is not so while an override of 0 pauses it, and in a gravity hold.
        """
        return self.moving and not self._motions.pausing and not self._motions.hold_runs

    @property
    def accepted(self) -> int:
        """Moves accepted since the start: the number of the newest one."""
        return self._accepted

    @property
    def joints(self) -> Joints:
        """Joint positions (rad)."""
        return self._motions.joints

    def joint_velocity(self) -> tuple[float, ...]:
        """Joint velocities (rad/s) in the last tick: the difference it made, over its time."""
        last = zip(self.joints, self._joints_before, strict=True)
        return tuple((now - before) / self.tick_s for now, before in last)

    def is_pending(self, move: int) -> bool:
        """Whether a move of this number runs or waits, and has been neither stopped nor replaced."""
        return self._motions.is_pending(move)

    @property
    def move_under_way(self) -> int:
        """The number of the normal move that runs and is not being stopped, 0 where there is none."""
        return self._motions.under_way

    def flange_frame(self) -> Frame:
        """The flange in the base."""
        return Frame.from_transform(self._model.flange(self.joints))

    def tool_frame(self) -> Frame:
        """The TCP in the base."""
        return self.tcp_frame_at(self.joints)

    @property
    def goal_joints(self) -> Joints:
        """Joint positions (rad) at the end of the move under way, not the last of the queue.

        In servo modes those of the target, during a stop those at which it ends, at rest the present ones.
        """
        return self._motions.goal

    def goal_frame(self) -> Frame:
        """The TCP in the base at `goal_joints`."""
        return self.tcp_frame_at(self.goal_joints)

    def tcp_frame_at(self, joints: Joints) -> Frame:
        """The TCP in the base at joint positions (rad)."""
        return Frame.from_transform(self._tcp(joints))

    def distance_to_goal_mm(self) -> float:
        """How far the TCP is from there, in a straight line (mm)."""
        return 1e3 * dist(self._tcp(self.joints).translation, self._tcp(self.goal_joints).translation)

    def cartesian_force(self) -> Wrench:
        """The wrench at the TCP in TCP orientation, acting on the robot (N, Nm)."""
        return self.load.cartesian_force()

    def joint_torque(self) -> tuple[float, ...]:
        """The external torque on each joint (Nm)."""
        return self.load.joint_torques(self.joints)

    def tcp(self, joints: Joints | None = None) -> Transform:
        """The pose of the TCP in the base at joint positions (rad), None for the present ones."""
        return self._tcp(self.joints if joints is None else joints)

    def _tcp(self, joints: Joints) -> Transform:
        return compose(self._model.flange(joints), self._tool_in_flange)

    def _accept(self, plan: Callable[[Joints], Plan], thresholds: Thresholds | None = None) -> int:
        """Plan a normal move from where the robot will come to rest, and queue it."""
        self._faults.check()
        motions, change = self._motions, TRANSITIONS[self.mode, Event.NORMAL_MOVE]
        self._check_room()
        start = self.end_of_queue
        planned = plan(start)
        if thresholds is not None:
            checked(thresholds)
        if motions.holding:
            self._accepted += 1
            motions.wait_behind_hold(self._accepted)
            self.endings.accepted(self._accepted)
            return self._accepted
        self._enter(change)
        self._accepted += 1
        motions.append(self._move(self._accepted, plan, planned, start))
        self.endings.accepted(self._accepted)
        if thresholds is not None:
            self._guards.add(ForceGuard(self._accepted, thresholds, self.cartesian_force()))
        return self._accepted

    @property
    def end_of_queue(self) -> Joints:
        """Joint positions (rad) at which the next normal move begins."""
        stops = TRANSITIONS[self.mode, Event.NORMAL_MOVE].stops and not self._motions.holding
        return self._motions.rest_after_stop() if stops else self._motions.rest

    def _shifted(self, shift: Frame, *, in_tool: bool) -> Frame:
        return shifted(self._tcp(self.end_of_queue), shift, in_tool=in_tool)

    def _move(self, number: int, plan: Callable[[Joints], Plan], planned: Plan, start: Joints) -> Move:
        return Move(number, *planned, start, lambda start: self._plan_again(number, plan, start))

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
        return self._move(number, plan, planned, start)

    def _yield(self, plan: Callable[[Joints], Plan], manner: Manner) -> int:
        """Plan a stiffness move from where the nominal motion will come to rest, and queue it."""
        self._faults.check()
        motions, change = self._motions, TRANSITIONS[self.mode, Event.IMPEDANCE_MOVE]
        self._check_room()
        start = motions.rest_after_stop() if change.stops else motions.rest
        planned = plan(start)
        self._enter(change)
        self._accepted += 1
        motions.append_yielding(self._move(self._accepted, plan, planned, start), manner)
        self.endings.accepted(self._accepted)
        return self._accepted

    def _check_room(self) -> None:
        if self._motions.waiting >= LONGEST_QUEUE:
            raise Refused(EXECUTION, f"{LONGEST_QUEUE} moves are waiting already")

    def _servo(self, event: Event, find: Callable[[Mode, Joints], tuple[Joints, JointLimits]]) -> int:
        """Find the target of a servo from where that will set out, and head for it."""
        self._faults.check()
        motions, change = self._motions, TRANSITIONS[self.mode, event]
        if motions.holding:
            raise Refused(COMPONENT_NOT_READY, HOLD_ENDS)
        joints, limits = find(change.mode, motions.rest_after_stop() if change.stops else motions.present)
        self._enter(change)
        self._accepted += 1
        with self.endings.because(STOP_TRIGGERED, REPLACED):
            motions.head_for(Target(self._accepted, joints, limits))
        self.endings.accepted(self._accepted)
        self._servo_heard = self.tick
        return self._accepted

    def _halt(self, code: int, reason: str) -> None:
        """Stop; moves that run or wait end with this code, for this reason."""
        self._enter(TRANSITIONS[self.mode, Event.STOP], code, reason)

    def _enter(self, change: Transition, code: int = STOP_TRIGGERED, reason: str = REPLACED) -> None:
        """Change the mode; where that stops the robot, moves end with this code, for this reason."""
        if change.stops:
            with self.endings.because(code, reason):
                self._motions.stop()
        self.mode = change.mode

    def _watch_servo(self) -> None:
        if self.servo_timeout_s is None or self.mode not in SERVO_MODES:
            return
        if (self.tick - self._servo_heard) * self.tick_s < self.servo_timeout_s:
            return
        self._end_servo(f"no {self.mode.value} command for {self.servo_timeout_s:g} s: the robot stops")

    def _end_servo(self, reason: str) -> None:
        self._enter(TRANSITIONS[self.mode, Event.SERVO_TIMEOUT], COMMUNICATION_FAILURE, reason)
        self._faults.fail(COMMUNICATION_FAILURE, reason)
        self._tell(COMMUNICATION_FAILURE, reason)

    def _watch_forces(self) -> None:
        """End a force move that has met a force."""
        if not self._motions.moving:
            self._guards.forget_all()
            return
        guard = self._guards.of(self._motions.under_way)
        contact = guard and guard.contact(self.cartesian_force(), self.tool_frame)
        if contact is not None:
            with self.endings.because(SUCCESS, str(contact)):
                self._motions.cancel()
            if self._on_contact is not None:
                self._on_contact(contact)

    def _tell(self, code: int, reason: str) -> None:
        """Tell of what has gone wrong between commands."""
        if self._on_fault is not None:
            self._on_fault(code, reason)

    def _begin_anew(self, joints: Joints) -> None:
        """Have motions that know of nothing before, at rest at joint positions (rad), in no mode."""
        override = self.override
        self.mode = Mode.UNKNOWN
        self._motions = self._motions_from(joints)
        self._motions.set_override(override)

    def _motions_from(self, joints: Joints) -> Motions:
        limits = self._targets.limits[Mode.SMART]
        return motions_of(
            self._model, self._tool_in_flange, joints, self.tick_s, limits, self.load, self.load.world.feel
        )

    def _check_rest(self) -> None:
        if self.moving:
            raise Refused(EXECUTION, "the robot has to be at rest, with nothing waiting")

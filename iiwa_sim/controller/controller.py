"""The emulated controller of one robot: it takes commands between ticks and moves the robot in ticks."""

from collections.abc import Callable, Sequence
from functools import partial
from math import dist, inf
from typing import Any

from iiwa_sim.contact.external_wrench import ExternalWrench
from iiwa_sim.contact.noise import Noise
from iiwa_sim.contact.tcp_contact_kernel import TcpContact
from iiwa_sim.controller.carrying import NO_TOOL, Tool, ToolLoad, unknown_load
from iiwa_sim.controller.endings import Endings, PendingMove, RobotEvent, WhenEnded
from iiwa_sim.controller.errors import (
    COMMUNICATION_FAILURE,
    COMPONENT_NOT_READY,
    EMERGENCY_STOP,
    EXECUTION,
    REPLACED,
    STOP_TRIGGERED,
    SUCCESS,
    ErrorRecord,
    Refused,
    RobotErrors,
)
from iiwa_sim.controller.handling import NO_HANDLING, Handling, HandlingSetup
from iiwa_sim.controller.io import Io
from iiwa_sim.controller.joint_trajectories import JointTrajectories
from iiwa_sim.controller.limits_watch import NOTHING_MORE, Protection, Safety, body_touched, report_touches
from iiwa_sim.controller.modes import SERVO_MODES, Mode
from iiwa_sim.controller.planner import Planner
from iiwa_sim.controller.requests import Kind, MoveRequest, shifted
from iiwa_sim.controller.state import RobotStatus
from iiwa_sim.frames import IDENTITY, Frame, Transform, compose
from iiwa_sim.motion.blend import Move
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.motions import Motions
from iiwa_sim.motion.springs import CartesianImpedance
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.model import arm_model
from iiwa_sim.wording import harmless
from iiwa_sim.wrench import Wrench

LEAST_OVERRIDE = 1e-6
"""Least override other than 0; a slower motion would not be visible."""
AUTOMATIC = 2
"""The mode of industrial_msgs/RobotMode in which a controller takes moves from a driver."""
LONGEST_QUEUE = 1000
"""Most moves that may wait."""


class Controller:
    """One robot, in one of the modes of `iiwa_sim.controller.modes`.

    Normal moves are checked when they are accepted, and run one after the other; a smart or direct move
    replaces the one before. A command takes effect at once and returns, or raises `Refused` and changes
    nothing. A move that first has to stop the robot is planned from the place of rest. Frames are in the
    base: of the TCP in normal moves, of the flange in smart and direct moves. The same commands at the same
    ticks give the same motion.
    """

    def __init__(
        self,
        description: RobotDescription,
        tick_s: float,
        *,
        start: Joints | None = None,
        tool_in_flange: Transform | None = None,
        contact: TcpContact | None = None,
        noise: Noise | None = None,
        io: Io | None = None,
        safety: Safety = NOTHING_MORE,
        tool: Tool = NO_TOOL,
        handled: HandlingSetup = NO_HANDLING,
        arm: Any = None,
        servo_timeout_s: float | None = None,
        on_event: Callable[[RobotEvent], None] | None = None,
    ) -> None:
        """Put the robot at rest.

        Args:
            start: Joint positions (rad) within the limits; by default home.
            tool_in_flange: The pose of the TCP; by default the robot's own.
            contact: Contact of the TCP with the surfaces of the cell, which links touch, too.
            handled: Gripper, wires and scene of the cell.
            arm: The robot's `Arm` in the world of gripper, parts, scene and other robots.
            servo_timeout_s: Time without a command that ends a servo mode; by default none does.
            on_event: Called with what happens between commands.
        """
        start = description.home if start is None else start
        tcp = description.tool_in_flange if tool_in_flange is None else tool_in_flange
        self.description = description
        self.tool = tool
        self.tool_load = tool.load
        self.tick_s = tick_s
        self.tick = 0
        """Number of ticks since the start."""
        self.mode = Mode.UNKNOWN
        """Mode of the last command: it changes with the command, also where the robot has to stop first."""
        self.accepted = 0
        """Moves accepted since the start: the number of the newest one."""
        self.tool_in_flange = tcp
        self.io = Io() if io is None else io
        self.model = arm_model(description)
        self.base = IDENTITY if arm is None or arm.base is None else arm.base
        """The pose of the base in the world."""
        self.load = ExternalWrench(self.model, tcp, start, contact, noise, tool.capsules, self.base)
        """Contacts and other forces from outside."""
        self.handling = None if arm is None else Handling(handled, self.io, self.load, arm)
        """The gripper and the bodies of the cell; None without any."""
        self.planner = Planner(self.model)
        self.motions = self._motions_from(start)
        self.joints_before = start
        """Joint positions (rad) at the end of the tick before the last one."""
        self.report = on_event or (lambda _: None)
        self.endings = Endings(lambda number: self.motions.is_pending(number))  # noqa: PLW0108 motions are replaced
        self.errors = RobotErrors()
        self.protection = Protection(self.load, description, safety)
        self.servo_target_tick = 0
        """Tick of the newest command of a servo."""
        self._servo_timeout_s = inf if servo_timeout_s is None else servo_timeout_s
        self._reports, self._touching = on_event is not None, set[str]()  # lines of contacts that last
        self.trajectories = JointTrajectories(self)

    # Ticks

    def step(self, at_most: int = 1) -> int:
        """Make one tick: the robot moves, takes the forces there, and compares them with limits.

        Before it make others, up to `at_most` in all, in which the robot only moves to known positions and
        touches nothing. The result is the same, bit for bit. Return the number of ticks.

        A stop because of a force begins in the next tick. An internal error stops the robot, in error, and
        is raised. Robots that share a world all `move_on`, then the world steps, then all `take_forces`.
        """
        left_out, handling = 0, self.handling
        if handling is not None and at_most > 1 and handling.skips:
            left_out = self._leave_out(handling, at_most - 1)
        self.move_on()
        if handling is not None:
            handling.world.step()
        self.take_forces()
        return left_out + 1

    def _leave_out(self, handling: Handling, ticks: int) -> int:
        """Make at most so many ticks in which the arm meets nothing; return how many."""
        motions, protection, pending = self.motions, self.protection, self.endings.pending
        if protection.looks_always or self._touching or motions.coming is None:
            return 0
        most_n, most_nm = protection.harmless
        if pending and pending[0].thresholds is not None:
            least_n = min(filter(None, pending[0].thresholds), default=inf)
            most_n = min(most_n, least_n - max(map(abs, pending[0].offset[:3])))
        ahead = [motions.joints, *motions.executor.ahead(ticks + 1)]
        made = handling.arm.leave_out(ahead, self.tick, self.load, (most_n, most_nm))
        if made:
            motions.executor.go_on(made)
            motions.joints = motions.executor.joints
        self.tick += made
        return made

    def move_on(self) -> None:
        """Make the first half of a tick: the robot moves."""
        # The code is flat, and most ticks only ask: a call or a property costs as much as the rest.
        waited_s = (self.tick - self.servo_target_tick) * self.tick_s
        if waited_s >= self._servo_timeout_s and self.mode in SERVO_MODES:
            waited = f"no {self.mode.value} command for {self._servo_timeout_s:g} s"
            self.fail(COMMUNICATION_FAILURE, f"{waited}: the robot stops")
        self.tick += 1
        motions, pending = self.motions, self.endings.pending
        self.joints_before = motions.joints
        try:
            motions.step()
        except Exception as fault:
            reason = f"internal error: {type(fault).__name__}, see the log"
            self.endings.lost(0, EXECUTION, reason)
            self.fail(EXECUTION, reason)
            raise
        if motions.tracking:
            self.trajectories.after_tick()
        if pending and pending[0].number != motions.under_way:
            self.endings.after_tick()
        if self.handling is not None:
            self.handling.go(motions)

    def take_forces(self) -> None:
        """Make the second half of a tick: the robot takes the forces, and compares them with limits."""
        motions, load, handling, tick = self.motions, self.load, self.handling, self.tick
        joints = motions.joints
        if handling is not None or not load.is_idle(joints, tick, self.tick_s):
            if handling is not None:
                handling.take_forces()
            load.step(joints, tick, self.tick_s, motions.tcp_contact, motions)
        pending, protection = self.endings.pending, self.protection
        if pending and pending[0].thresholds is not None:
            self._watch_forces(pending[0])
        acts = load.wrenches or load.torques
        if protection.looks_always or (acts and not protection.tolerates()):
            self._protect()
        if self._reports and (acts or self._touching):
            self._touching = report_touches(load, self._touching, self.report)

    def _watch_forces(self, move: PendingMove) -> None:
        """End a force move that has met a force."""
        contact = move.contact(self.cartesian_force(), self.tool_frame)
        if contact is not None and move.number == self.motions.under_way:
            with self.endings.because(SUCCESS, str(contact)):
                self.motions.cancel()
            self.report(contact)

    def _protect(self) -> None:
        """Stop a robot that is pushed too hard, or is outside of the limits of its TCP."""
        tcp = self.tcp().translation
        speed_m_s = dist(self.tcp(self.joints_before).translation, tcp) / self.tick_s
        why = self.protection.reason_to_stop(self.joints, tcp, speed_m_s, bool(self.errors.standing))
        if why is not None:
            self.fail(STOP_TRIGGERED, harmless(f"protective stop: {why}{body_touched(self.load)}"))

    @property
    def resting(self) -> bool:
        """True if ticks change nothing but their number and the noise, until the next command.

        A running timeout of a servo, a pause and compliance count as motion. The tick after a motion counts,
        too: the velocity becomes 0 in it.
        """
        if self.joints_before != self.motions.joints or self.endings.pending:
            return False
        if self._servo_timeout_s < inf and self.mode in SERVO_MODES:
            return False
        stands = self.protection.tolerates() and self.motions.settled and self.load.settled
        return stands and (self.handling is None or self.handling.settled)

    def skip(self, ticks: int) -> None:
        """Make `ticks` ticks at once, while `resting`: with the same result, bit for bit."""
        self.tick += ticks
        if self.load.noise is not None:
            self.load.noise.next(ticks)

    # Stops and errors

    def stop(self, code: int = STOP_TRIGGERED, reason: str = "stopped") -> None:
        """Bring the robot to rest on its path, in no mode; moves that run or wait end for this reason."""
        with self.endings.because(code, reason):
            self.motions.stop()
        self.mode = Mode.UNKNOWN

    def fail(self, code: int, reason: str) -> None:
        """Stop the robot, and take no moves until the error is reset."""
        self.errors.fail(code, reason)
        self.stop(code, reason)
        self.report(ErrorRecord(code, reason))

    def emergency_stop(self, pressed: bool = True) -> None:
        """Stop as `stop` does, and take no moves until it is released, by False, and the error reset."""
        self.errors.e_stopped = pressed
        if pressed:
            self.errors.drives_powered = False
            self.fail(EMERGENCY_STOP, "emergency stop")

    def status(self) -> RobotStatus:
        """Return the state of the robot, as ROS-Industrial puts it."""
        errors, standing = self.errors, self.errors.standing
        in_motion = self.moving and not self.motions.pausing
        flags = errors.e_stopped, errors.drives_powered, standing is None, in_motion, standing is not None
        return RobotStatus._make((AUTOMATIC, *map(int, flags), standing.code if standing else 0))

    # Settings

    def set_override(self, override: float) -> None:
        """Run all motions at this part of their planned speed, 0, a pause, to 1; raises `Refused` beyond."""
        if override != 0.0 and not LEAST_OVERRIDE <= override <= 1.0:
            raise Refused(EXECUTION, f"override {override:g}: expected 0, or {LEAST_OVERRIDE:g} to 1")
        self.motions.executor.set_override(override)

    @property
    def override(self) -> float:
        """The part of their planned speed at which all motions run or will run, 0..1."""
        return self.motions.executor.time.override

    def set_tool_load(self, load: ToolLoad) -> None:
        """Assume this load at the flange from now on; the difference to the true one acts from outside."""
        self.load.carry(unknown_load(self.tool, load), self.joints)
        self.tool_load = load

    # State

    @property
    def moving(self) -> bool:
        """True if anything moves, is being stopped, or waits, also for an override above 0."""
        return self.motions.moving

    @property
    def under_way(self) -> bool:
        """True if the robot moves and will stop without a command, or if gripper or bodies move."""
        return self.motions.ends_by_itself or (self.handling is not None and self.handling.under_way)

    @property
    def joints(self) -> Joints:
        """Joint positions (rad)."""
        return self.motions.joints

    def joint_velocity(self) -> Joints:
        """Return joint velocities (rad/s) in the last tick: its difference over its time."""
        last = zip(self.motions.joints, self.joints_before, strict=True)
        return tuple((now - before) / self.tick_s for now, before in last)

    def tcp(self, joints: Joints | None = None) -> Transform:
        """Return the pose of the TCP in the base at joint positions (rad), None for the present ones."""
        return compose(self.model.flange(self.joints if joints is None else joints), self.tool_in_flange)

    def tool_frame(self, joints: Joints | None = None) -> Frame:
        """Return the TCP in the base at joint positions (rad), None for the present ones."""
        return Frame.from_transform(self.tcp(joints))

    def flange_frame(self) -> Frame:
        """Return the flange in the base."""
        return Frame.from_transform(self.model.flange(self.joints))

    def goal_frame(self) -> Frame:
        """Return the TCP in the base at the end of the running move, of a servo's target or of a stop."""
        return self.tool_frame(self.motions.goal)

    def distance_to_goal_mm(self) -> float:
        """Return how far the TCP is from its goal, in a straight line (mm)."""
        return 1e3 * dist(self.tcp().translation, self.tcp(self.motions.goal).translation)

    def cartesian_force(self) -> Wrench:
        """Return the wrench at the TCP in TCP orientation, acting on the robot (N, Nm)."""
        return self.load.cartesian_force()

    def joint_torque(self) -> tuple[float, ...]:
        """Return the external torque on each joint (Nm)."""
        return self.load.joint_torques(self.joints)

    # Moves

    def move(self, request: MoveRequest, when_ended: WhenEnded | None = None) -> int:
        """Take a move; return its number. Raises `Refused`, and then nothing has changed.

        - PTP and LIN queue behind the running move. With thresholds the robot begins to stop on its path in
          the tick after a force is beyond its threshold, and then begins the next move.
        - A move with compliance, and a hold, replace the running motion. A hold begins where the robot has
          come to rest. It ends with a stop, a move with compliance or a hold; other moves are rejected.
        - Servos head for their target at once.

        A shift is resolved once, now. `when_ended` is called at the end of the move.
        """
        self.errors.check()
        if request.kind is not Kind.HOLD and request.compliance is None:
            self.check_hold()
        if request.shift is not None:
            start = self.tcp(self.end_of_queue)
            request = request._replace(target=shifted(start, request.shift, in_tool=request.in_tool))
        if request.kind.is_servo:
            number = self._head_for(request, Mode[request.kind.name])
        elif request.kind is Kind.HOLD:
            hold_nm_per_rad = request.hold_nm_per_rad
            number = self.begin(Mode.IMPEDANCE, lambda number: self.motions.hold(number, hold_nm_per_rad))
        elif request.compliance is not None:
            number = self._move_compliantly(request, request.compliance)
        else:
            if self.motions.executor.waiting >= LONGEST_QUEUE:
                raise Refused(EXECUTION, f"{LONGEST_QUEUE} moves are waiting: get queue tells when fewer do")
            move = self._planned(request, self.end_of_queue)
            number = self.begin(Mode.NORMAL, lambda _: self.motions.executor.append(move))
        thresholds = request.thresholds
        if thresholds or when_ended or self.endings.listeners or self._reports:  # its end is reported
            offset = self.cartesian_force()
            self.endings.pending.append(PendingMove(number, when_ended, thresholds, offset))
        return number

    def check(self, request: MoveRequest) -> None:
        """Raise `Refused` if a PTP or LIN would be rejected for its target; change nothing."""
        self.planner.plan(request, self.end_of_queue, self.model.tcp(self.tool_in_flange))

    def cancel_move(self) -> None:
        """End the move that runs: stop on its path, and go on with the next one from where the robot then is.

        While nothing runs, or the robot is being stopped, nothing changes.
        """
        self.check_hold()
        with self.endings.because(STOP_TRIGGERED, "cancelled by a command"):
            self.motions.cancel()

    def clear_queue(self) -> None:
        """Forget the moves that wait; the one that runs ends at its target.

        A robot that blends into the next one, or is too fast to rest at the target, stops on its path.
        """
        with self.endings.because(STOP_TRIGGERED, "forgotten: the queue was cleared"):
            self.motions.clear()

    def check_hold(self) -> None:
        """Raise `Refused` while a gravity hold is on, or begins when the robot is at rest."""
        if self.mode is Mode.IMPEDANCE and self.motions.holding:
            raise Refused(COMPONENT_NOT_READY, "a gravity hold is on: stop ends it")

    def begin(self, mode: Mode, begin: Callable[[int], None], replaced: str = REPLACED) -> int:
        """Begin an accepted request in place of the running move, or behind it; return its number.

        The mode changes, which may stop the robot. Moves that it ends get the reason `replaced`.
        """
        if self.mode.stops_for(mode):
            self.stop(reason=REPLACED)
        self.mode = mode
        self.accepted += 1
        with self.endings.because(STOP_TRIGGERED, replaced):
            begin(self.accepted)
        return self.accepted

    def _move_compliantly(self, request: MoveRequest, impedance: CartesianImpedance) -> int:
        """Plan a stiffness move from the nominal motion, and carry it out in place of the running one."""
        motions = self.motions
        stops = self.mode.stops_for(Mode.IMPEDANCE)
        move = self._planned(request, motions.rest_after_stop() if stops else motions.compliant_start)
        self.planner.check_approach(move.limits, 0.0, motions.moving and not stops)
        return self.begin(Mode.IMPEDANCE, lambda _: motions.move_compliantly(move, impedance))

    def _head_for(self, request: MoveRequest, mode: Mode) -> int:
        """Find the target of a servo from its start, and head for it."""
        stops = self.mode.stops_for(mode)
        here = self.motions.rest_after_stop() if stops else self.motions.present
        moving = self.motions.moving and not stops
        joints, limits = self.planner.servo_target(request, mode, here, moving)
        self.servo_target_tick = self.tick
        return self.begin(mode, lambda number: self.motions.head_for(number, joints, limits))

    def _planned(self, request: MoveRequest, start: Joints, number: int = 0) -> Move:
        """Plan a move from joint positions (rad); without a number it gets that of the next one accepted."""
        number = number or self.accepted + 1
        again = partial(self._plan_again, number, request)
        return self.planner.plan(request, start, self.model.tcp(self.tool_in_flange), number, again)

    def _plan_again(self, number: int, request: MoveRequest, start: Joints) -> Move | None:
        """Return an accepted move, begun elsewhere (rad); None, with a report, where it is impossible."""
        try:
            return self._planned(request, start, number)
        except Refused as refused:
            lost = f"move {number} and those behind it are forgotten, planned again after a move ended early"
            code, reason = refused.code, f"{lost}: {refused.reason}"
            self.errors.record(code, reason)
            self.report(ErrorRecord(code, reason))
            self.endings.lost(number, code, reason)
            return None

    @property
    def end_of_queue(self) -> Joints:
        """Joint positions (rad) at which the next normal move begins."""
        stops = self.mode.stops_for(Mode.NORMAL)
        return self.motions.rest_after_stop() if stops else self.motions.executor.rest

    # For tests, by the backdoor: no driver can do this. It takes effect at once.

    def switch_drives(self, on: bool) -> None:
        """Off: stop as `stop` does, and take no moves until they are on and the error reset."""
        self.errors.switched_off = not on
        if not on:
            self.errors.drives_powered = False
            self.fail(COMPONENT_NOT_READY, "the drives are off")

    def place(self, joints: Sequence[float], tool_in_flange: Transform | None = None) -> None:
        """Put the robot at rest at joint positions (rad), in no mode, with another TCP if one is given.

        Raises `Refused` outside the limits, and while anything moves or waits.
        """
        if self.moving:
            raise Refused(EXECUTION, "the robot has to be at rest, with nothing waiting")
        joints, override = self.planner.checked_joints(joints), self.override
        self.mode = Mode.UNKNOWN
        self.tool_in_flange = tool_in_flange = tool_in_flange or self.tool_in_flange
        self.motions = self._motions_from(joints)
        self.motions.executor.set_override(override)
        self.joints_before = joints
        self.load.place(joints, tool_in_flange)
        self.protection.find_harmless()
        if self.handling is not None:
            self.handling.place_tcp(joints, self.load.tcp(joints))

    def _motions_from(self, joints: Joints) -> Motions:
        limits, load = self.planner.limits, self.load
        return Motions(
            self.model, self.tool_in_flange, joints, self.tick_s, limits, load.pushes, load.contact
        )

"""What the parts of the controller share: the state of one robot, its tick, and what ends in a stop."""

from collections.abc import Callable
from math import inf

from iiwa_sim.contact.load_kernel import ExternalLoad
from iiwa_sim.controller.assembly import motions_of
from iiwa_sim.controller.carrying import Carrying
from iiwa_sim.controller.core_kernel import CoreTicks
from iiwa_sim.controller.endings import Endings
from iiwa_sim.controller.error_state import RobotErrors
from iiwa_sim.controller.errors import (
    COMMUNICATION_FAILURE,
    EXECUTION,
    STOP_TRIGGERED,
    SUCCESS,
)
from iiwa_sim.controller.force_guard import Contact, ForceGuard
from iiwa_sim.controller.handling import Handling
from iiwa_sim.controller.meetings import Meetings
from iiwa_sim.controller.modes import (
    LONGEST_SERVO_TIMEOUT_S,
    SERVO_MODES,
    TRANSITIONS,
    Event,
    Mode,
    Transition,
)
from iiwa_sim.controller.motions import Motions
from iiwa_sim.controller.planner import Planner
from iiwa_sim.controller.protection import Protection
from iiwa_sim.controller.targets import Targets
from iiwa_sim.frames import Frame, Transform, compose
from iiwa_sim.motion.joints import Joints
from iiwa_sim.robot.model import Model
from iiwa_sim.wrench import Wrench

REPLACED = "replaced by a newer move, of a servo or in another mode"


class Core(CoreTicks):
    """The state of one robot, stepped. The parts of the controller read and change it; nobody else does."""

    def __init__(
        self,
        model: Model,
        tick_s: float,
        start: Joints,
        tool_in_flange: Transform,
        load: ExternalLoad,
        carrying: Carrying,
        handling: Handling | None,
        protection: Protection,
        servo_timeout_s: float | None,
        on_fault: Callable[[int, str], None] | None,
        on_contact: Callable[[Contact], None] | None,
        on_touch: Callable[[str], None] | None,
    ) -> None:
        """The robot rests at `start` (rad), pushed by `load` known to it as `carrying` says, working with
        `handling`, None for nothing, and watched by `protection`; the rest is as `Controller` is given it."""
        if servo_timeout_s is not None and not 0.0 < servo_timeout_s <= LONGEST_SERVO_TIMEOUT_S:
            limits = f"above 0 and up to {LONGEST_SERVO_TIMEOUT_S:g} s"
            raise ValueError(f"servo_timeout_s is {servo_timeout_s}, expected {limits}")
        self.tick_s = tick_s
        self.tick = 0
        self.mode = Mode.UNKNOWN
        self.model = model
        self.planner = Planner(model)
        self.targets = Targets(self.planner, model.description)
        self.tool_in_flange = tool_in_flange
        self.arm = model.tcp(tool_in_flange)
        """The TCP, as a frame fixed to the flange."""
        self.load = load
        self.carrying = carrying
        self.handling = handling
        self.protection = protection
        self.motions = self._motions_from(start)
        self.joints_before = start
        self.endings = Endings(self.is_pending)
        self.error_state = RobotErrors()
        self.accepted = 0
        """Moves, since the start: the number of the newest one."""
        self.watch_trajectory = None
        self.servo_heard = 0
        """The tick in which a servo mode has heard of its newest command."""
        self._servo_timeout_s = servo_timeout_s
        self._on_fault = on_fault
        self._on_contact = on_contact
        self._meetings = None if on_touch is None else Meetings(load, tick_s, on_touch)

    @property
    def resting(self) -> bool:
        """Whether ticks change nothing but their number and the noise, until something is asked for.

        That is not so while a timeout of a servo runs, in a pause, while the robot yields, nor in the tick
        after a motion, whose velocity is still to be seen to end.
        """
        return not (
            self.joints_before != self.motions.joints
            or self.endings.pending
            or (self._servo_timeout_s is not None and self.mode in SERVO_MODES)
            or not self.protection.knows(self.load)
        ) and (
            self.motions.settled and self.load.settled and (self.handling is None or self.handling.settled)
        )

    def skip(self, ticks: int) -> None:
        """Make up for `ticks` ticks at once, while `resting`: bit for bit what they would have led to."""
        self.tick += ticks
        self.load.skip(ticks)

    def is_pending(self, move: int) -> bool:
        """Whether a move of this number runs or waits, and has been neither stopped nor replaced."""
        return self.motions.is_pending(move)

    def tcp(self, joints: Joints) -> Transform:
        """The pose of the TCP in the base at joint positions (rad)."""
        return compose(self.model.flange(joints), self.tool_in_flange)

    def joint_velocity(self) -> Joints:
        """Joint velocities (rad/s) in the last tick: the difference it made, over its time."""
        last = zip(self.motions.joints, self.joints_before, strict=True)
        return tuple((now - before) / self.tick_s for now, before in last)

    def cartesian_force(self) -> Wrench:
        """The wrench at the TCP in TCP orientation, acting on the robot (N, Nm)."""
        force: Wrench = self.load.cartesian_force()
        return force

    def halt(self, code: int, reason: str) -> None:
        """Stop; moves that run or wait end with this code, for this reason."""
        self.stop_for(TRANSITIONS[self.mode, Event.STOP], code, reason)

    def stop_for(self, change: Transition, code: int = STOP_TRIGGERED, reason: str = REPLACED) -> None:
        """Change the mode in a way that stops the robot; moves end with this code, for this reason."""
        with self.endings.because(code, reason, discards=True):
            self.motions.stop()
        self.mode = change.mode

    def _watch_servo(self) -> None:
        timeout_s = self._servo_timeout_s or inf
        if self.mode in SERVO_MODES and (self.tick - self.servo_heard) * self.tick_s >= timeout_s:
            self.end_servo(f"no {self.mode.value} command for {timeout_s:g} s: the robot stops")

    def end_servo(self, reason: str) -> None:
        self.stop_for(TRANSITIONS[self.mode, Event.SERVO_TIMEOUT], COMMUNICATION_FAILURE, reason)
        self.error_state.fail(COMMUNICATION_FAILURE, reason)
        self.tell(COMMUNICATION_FAILURE, reason)

    def _fail_in_tick(self, fault: Exception) -> None:
        """Stop after an internal error in a tick."""
        reason = f"internal error: {type(fault).__name__}, see the log"
        self.error_state.fail(EXECUTION, reason)
        self.endings.lost(0, EXECUTION, reason)
        self.halt(STOP_TRIGGERED, "stopped")

    def _watch_forces(self, guard: ForceGuard) -> None:
        """End a force move that has met a force."""
        if guard.move != self.motions.under_way:
            return
        contact = guard.contact(self.cartesian_force(), self._tool_frame)
        if contact is not None:
            with self.endings.because(SUCCESS, str(contact)):
                self.motions.cancel()
            if self._on_contact is not None:
                self._on_contact(contact)

    def _protect(self) -> None:
        """Stop a robot that is pushed too hard, or runs where or faster than it may."""
        why = self.passed_limit(self.error_state.standing is not None)
        if why is not None:
            self.fail(STOP_TRIGGERED, f"protective stop: {why}")

    def passed_limit(self, standing: bool) -> str | None:
        """Why the robot has to stop as it is pushed, and as a tick has moved it; None where it need not.

        `standing` says that an error has stopped it before: what is beyond a limit is allowed from now on.
        """
        joints, protection = self.motions.joints, self.protection
        why = protection.overload(self.load, joints, standing)
        if protection.watches_tcp:
            before, now = self.tcp(self.joints_before).translation, self.tcp(joints).translation
            why = protection.trespass(before, now, self.tick_s, standing) or why
        return why

    def fail(self, code: int, reason: str) -> None:
        """Stop the robot, and take no moves until the error is reset."""
        self.error_state.fail(code, reason)
        self.halt(code, reason)
        self.tell(code, reason)

    def tell(self, code: int, reason: str) -> None:
        """Tell of what has gone wrong between commands."""
        if self._on_fault is not None:
            self._on_fault(code, reason)

    def take_tool(self, tool_in_flange: Transform) -> None:
        """Have the TCP there from now on; motions have to begin anew."""
        self.tool_in_flange = tool_in_flange
        self.arm = self.model.tcp(tool_in_flange)

    def begin_anew(self, joints: Joints) -> None:
        """Have motions that know of nothing before, at rest at joint positions (rad), in no mode."""
        override = self.motions.override
        self.mode = Mode.UNKNOWN
        self.motions = self._motions_from(joints)
        self.motions.set_override(override)

    def _tool_frame(self) -> Frame:
        return Frame.from_transform(self.tcp(self.motions.joints))

    def _motions_from(self, joints: Joints) -> Motions:
        limits = self.targets.limits[Mode.SMART]
        pushes, feeling = self.load.pushes, self.load.world
        return motions_of(self.model, self.tool_in_flange, joints, self.tick_s, limits, pushes, feeling)

"""What all of the controller stands on: its state, the tick, and what ends in a stop."""

from collections.abc import Callable

from iiwa_sim.contact.load import ExternalLoad
from iiwa_sim.contact.noise import Noise
from iiwa_sim.contact.world_kernel import World
from iiwa_sim.contact.wrench import Wrench
from iiwa_sim.controller.assembly import motions_of
from iiwa_sim.controller.endings import Endings
from iiwa_sim.controller.errors import (
    COMMUNICATION_FAILURE,
    EXECUTION,
    STOP_TRIGGERED,
    SUCCESS,
)
from iiwa_sim.controller.faults import Faults
from iiwa_sim.controller.force_guard import Contact, ForceGuards
from iiwa_sim.controller.io import Io
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
from iiwa_sim.controller.targets import Targets
from iiwa_sim.frames import Frame, Transform, compose
from iiwa_sim.motion.joints import Joints
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.model import Model

REPLACED = "replaced by a newer move, of a servo or in another mode"


class Core:
    """The state of one robot, stepped."""

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
        if self.servo_timeout_s is not None:
            self._watch_servo(self.servo_timeout_s)
        self.tick += 1
        motions, load = self._motions, self.load
        self._joints_before = motions.joints
        try:
            motions.step()
        except Exception as fault:
            reason = f"internal fault: {type(fault).__name__}, told in the log"
            self._faults.fail(EXECUTION, reason)
            self.endings.lost(0, EXECUTION, reason)
            self._halt(STOP_TRIGGERED, "stopped")
            raise
        # Of what most ticks have nothing of only that is asked: they cost 1.5 us together.
        if self.endings.pending:
            self.endings.after_tick()
        if load.changes:
            load.step(motions.joints, self.tick_s, motions.felt)
        if self._guards.pending:
            self._watch_forces()

    @property
    def moving(self) -> bool:
        """Whether anything moves, is being stopped, or waits, also for an override above 0."""
        return self._motions.moving

    @property
    def joints(self) -> Joints:
        """Joint positions (rad)."""
        return self._motions.joints

    @property
    def override(self) -> float:
        """The part of their planned speed at which all motions run or will run, 0..1."""
        return self._motions.override

    def is_pending(self, move: int) -> bool:
        """Whether a move of this number runs or waits, and has been neither stopped nor replaced."""
        return self._motions.is_pending(move)

    def tool_frame(self) -> Frame:
        """The TCP in the base."""
        return self.tcp_frame_at(self.joints)

    def tcp_frame_at(self, joints: Joints) -> Frame:
        """The TCP in the base at joint positions (rad)."""
        return Frame.from_transform(self._tcp(joints))

    def _tcp(self, joints: Joints) -> Transform:
        return compose(self._model.flange(joints), self._tool_in_flange)

    def cartesian_force(self) -> Wrench:
        """The wrench at the TCP in TCP orientation, acting on the robot (N, Nm)."""
        return self.load.cartesian_force()

    def record_error(self, code: int, reason: str) -> None:
        """Remember why a command was refused; codes are those of `iiwa_sim.controller.errors`."""
        self._faults.record(code, reason)

    def _halt(self, code: int, reason: str) -> None:
        """Stop; moves that run or wait end with this code, for this reason."""
        self._enter(TRANSITIONS[self.mode, Event.STOP], code, reason)

    def _enter(self, change: Transition, code: int = STOP_TRIGGERED, reason: str = REPLACED) -> None:
        """Change the mode; where that stops the robot, moves end with this code, for this reason."""
        if change.stops:
            with self.endings.because(code, reason, discards=True):
                self._motions.stop()
        self.mode = change.mode

    def _watch_servo(self, timeout_s: float) -> None:
        if self.mode in SERVO_MODES and (self.tick - self._servo_heard) * self.tick_s >= timeout_s:
            self._end_servo(f"no {self.mode.value} command for {timeout_s:g} s: the robot stops")

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

    def _motions_from(self, joints: Joints) -> Motions:
        limits = self._targets.limits[Mode.SMART]
        return motions_of(
            self._model, self._tool_in_flange, joints, self.tick_s, limits, self.load, self.load.world.feel
        )

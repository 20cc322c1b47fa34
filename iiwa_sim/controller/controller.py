"""The emulated controller, stepped: it takes commands between ticks and moves the robot in them."""

from collections.abc import Callable
from math import dist

from iiwa_sim.contact.load_kernel import ExternalLoad
from iiwa_sim.contact.noise import Noise
from iiwa_sim.contact.world_kernel import World
from iiwa_sim.controller.carrying import Carrying, Tool, ToolLoad
from iiwa_sim.controller.core import Core
from iiwa_sim.controller.error_state import PRESSED
from iiwa_sim.controller.errors import EMERGENCY_STOP, EXECUTION, STOP_TRIGGERED, ErrorRecord, Refused
from iiwa_sim.controller.force_guard import Contact
from iiwa_sim.controller.handling import Handling, HandlingSetup
from iiwa_sim.controller.injected import Injected
from iiwa_sim.controller.io import Io
from iiwa_sim.controller.modes import Mode
from iiwa_sim.controller.moves import Moves
from iiwa_sim.controller.protection import NOTHING_MORE, Protection, Safety
from iiwa_sim.controller.reading import Reader
from iiwa_sim.controller.status import RobotStatus, status_of
from iiwa_sim.controller.trajectories import Progress, Trajectories
from iiwa_sim.controller.wanted import Planned
from iiwa_sim.frames import Frame, Transform
from iiwa_sim.motion.joints import Joints
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.model import Model

LEAST_OVERRIDE = 1e-6
"""The least override other than 0: less is no motion that anybody could see, and no number to divide by."""


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
        safety: Safety = NOTHING_MORE,
        tool: Tool | None = None,
        handled: HandlingSetup | None = None,
        servo_timeout_s: float | None = None,
        on_fault: Callable[[int, str], None] | None = None,
        on_contact: Callable[[Contact], None] | None = None,
        on_touch: Callable[[str], None] | None = None,
    ) -> None:
        """The robot rests at `start` (rad, within the limits), None for home.

        The TCP is at `tool_in_flange`, None for the robot's own.

        TCP and links touch the surfaces of `world`; the robot goes where it is sent, until the torque on a
        joint passes its limit, or what `safety` has it watch: then it stops, and is in error. The arm carries
        `tool`, None for nothing, and the controller knows that; `handled` is what it works with, if anything.
        `noise` is added to the readings of forces and torques. There are the inputs and outputs of `io`, or
        16 of each. The robot stops by itself when a servo mode hears of no command for `servo_timeout_s`,
        None for never. `on_fault` is told the code and the reason of what goes wrong between commands,
        `on_contact` which force has ended a move, `on_touch` which link begins to touch a surface or another
        link. Raises `RobotFault` where the robot's folder does not fit together, and ValueError for a timeout
        out of range.
        """
        self.description = description
        self.tool = tool
        """What is fixed to its flange, None for nothing: not what it believes to carry."""
        self.tick_s = tick_s
        self.io = Io() if io is None else io
        start = description.home if start is None else start
        tcp = description.tool_in_flange if tool_in_flange is None else tool_in_flange
        model = Model(description)
        self.load = ExternalLoad(model, tcp, start, world, noise, () if tool is None else tool.capsules)
        """What pushes the robot from outside, and what it touches."""
        protection = Protection(description.joints, description.torque, safety)
        self._core = Core(
            model,
            tick_s,
            start,
            tcp,
            self.load,
            Carrying(tool, self.load),
            None
            if handled is None
            else Handling(handled, self.io, self.load, description, tool, start, tick_s),
            protection,
            servo_timeout_s,
            on_fault,
            on_contact,
            on_touch,
        )
        self._moves = Moves(self._core)
        self._trajectories = Trajectories(self._core, self._moves)
        self.move = self._moves.take
        """Take a `MoveRequest`; gives its number. Raises `Refused`; more is said in `Moves.take`."""
        self.check = self._moves.check
        """Raises `Refused` where a PTP or LIN would be for its target; changes nothing."""
        self.follow = self._trajectories.take
        """Take a joint trajectory in place of what runs; gives its number, and a remark where one is due.
        Raises `Refused`; more is said in `Trajectories.take`."""
        self.cancel_trajectory = self._trajectories.cancel
        """Stop the trajectory of this number on its way; gives whether it was followed or waited."""
        self.cancel_move = self._moves.cancel
        """End the move that runs: see `Moves.cancel`."""
        self.clear_queue = self._moves.clear
        """Forget the moves that wait: see `Moves.clear`."""
        self.handling = self._core.handling
        """The gripper, if there is one."""
        self.injected = Injected(self._core)
        """What a test bench does to the robot."""
        self.endings = self._core.endings
        """Tells its listeners how each move ended."""
        self.is_pending = self._core.is_pending
        """Whether a move of this number runs or waits, and has been neither stopped nor replaced."""
        self.record_error = self._core.error_state.record
        """Remember why a command was refused; codes are those of `iiwa_sim.controller.errors`."""
        self.reset_error = self._core.error_state.reset
        """End the error state, and forget the last refusal; raises `Refused` while the emergency stop is
        pressed."""
        self.release_emergency_stop = self._core.error_state.release_emergency_stop
        """The error remains, to be reset."""
        self.set_collision_detection = protection.set_collision_detection
        """Stop, in error, when the force (N) or the torque (Nm) from outside at the TCP is greater; 0 where
        that is not watched. Raises `Refused` for numbers out of range."""
        self.cartesian_force = self._core.cartesian_force
        """The wrench at the TCP in TCP orientation, acting on the robot (N, Nm)."""
        self.joint_velocity = self._core.joint_velocity
        """Joint velocities (rad/s) in the last tick."""
        self.step = self._core.step
        """One tick."""
        self.skip = self._core.skip
        """Make up for `ticks` ticks at once, while `resting`: bit for bit what they would have led to."""

    @property
    def resting(self) -> bool:
        """Whether ticks change nothing but their number and the noise, until something is asked for."""
        return self._core.resting

    @property
    def trajectory(self) -> Progress | None:
        """Where the trajectory that is followed stands; None while there is none."""
        return self._trajectories.progress

    def stop(self) -> None:
        """Bring the robot to rest on its path, and forget the moves that wait."""
        self._core.halt(STOP_TRIGGERED, "stopped")

    def set_override(self, override: float) -> None:
        """Run all motions at this part of their planned speed, from 0, a pause, to 1.

        What moves stays on its path and keeps the planned limits; so it takes some time: 0.3 s, or what
        the slowest joint needs to stop; longer in servo modes and in impedance. At rest the override is there
        at once. Raises `Refused` for a number out of range.
        """
        if override != 0.0 and not LEAST_OVERRIDE <= override <= 1.0:
            raise Refused(EXECUTION, f"override {override:g}: expected 0, or {LEAST_OVERRIDE:g} to 1")
        self._core.motions.set_override(override)

    @property
    def collision_detection(self) -> tuple[float, float]:
        """The greatest force (N) and torque (Nm) from outside at the TCP; 0 where it is not watched."""
        safety = self._core.protection.safety
        return safety.force_n or 0.0, safety.torque_nm or 0.0

    def set_tool_load(self, load: ToolLoad) -> None:
        """What the controller takes its arm to carry from now on.

        The difference to what is there acts from outside. Raises `Refused` for numbers out of range.
        """
        self._core.carrying.believe(load, self.joints)

    @property
    def tool_load(self) -> ToolLoad:
        """What the controller takes its arm to carry."""
        return self._core.carrying.believed

    def emergency_stop(self) -> None:
        """Stop as `stop` does, and take no moves until it is released and the error reset."""
        self._core.error_state.press_emergency_stop()
        self._core.fail(EMERGENCY_STOP, PRESSED)

    @property
    def tick(self) -> int:
        """How many there have been."""
        return self._core.tick

    @property
    def mode(self) -> Mode:
        """Mode of the last command: it changes with the command, also where the robot has to stop first."""
        return self._core.mode

    @property
    def moving(self) -> bool:
        """Whether anything moves, is being stopped, or waits, also for an override above 0."""
        return self._core.motions.moving

    @property
    def joints(self) -> Joints:
        """Joint positions (rad)."""
        return self._core.motions.joints

    def reader(self) -> Reader:
        """What reads all that the state follows from, for who wants it in each tick."""
        return Reader(self._core, self.io)

    @property
    def override(self) -> float:
        """The part of their planned speed at which all motions run or will run, 0..1."""
        return self._core.motions.override

    def tool_frame(self) -> Frame:
        """The TCP in the base."""
        return self.tcp_frame_at(self.joints)

    def tcp_frame_at(self, joints: Joints) -> Frame:
        """The TCP in the base at joint positions (rad)."""
        return Frame.from_transform(self._core.tcp(joints))

    def status(self) -> RobotStatus:
        """The state of the robot, as ROS-Industrial puts it."""
        return status_of(self._core.error_state, in_motion=self.moving and not self._core.motions.pausing)

    @property
    def last_error(self) -> ErrorRecord | None:
        """What has stopped the robot and was not reset, else the last refused command since a reset."""
        return self._core.error_state.last

    @property
    def under_way(self) -> bool:
        """Whether the robot moves, and will stop without another command: not in a pause by an override of 0,
        nor in a gravity hold; or whether its gripper does."""
        return self._core.under_way

    @property
    def accepted(self) -> int:
        """Moves accepted since the start: the number of the newest one."""
        return self._core.accepted

    @property
    def queue(self) -> int:
        """How many moves wait behind the one that runs, or begins in the next tick."""
        return self._core.motions.behind

    @property
    def planned(self) -> list[Planned]:
        """What runs and what waits, in the order in which it is done; see `Motions.planned`."""
        return self._core.motions.planned

    @property
    def move_under_way(self) -> int:
        """The number of the normal move that runs and is not being stopped, 0 where there is none."""
        return self._core.motions.under_way

    def flange_frame(self) -> Frame:
        """The flange in the base."""
        return Frame.from_transform(self._core.model.flange(self.joints))

    @property
    def goal_joints(self) -> Joints:
        """Joint positions (rad) at the end of the move under way, of a servo's target or of a stop; at rest
        the present ones."""
        return self._core.motions.goal

    def goal_frame(self) -> Frame:
        """The TCP in the base at `goal_joints`."""
        return self.tcp_frame_at(self.goal_joints)

    def distance_to_goal_mm(self) -> float:
        """How far the TCP is from there, in a straight line (mm)."""
        here, goal = self._core.tcp(self.joints), self._core.tcp(self.goal_joints)
        return 1e3 * dist(here.translation, goal.translation)

    def joint_torque(self) -> tuple[float, ...]:
        """The external torque on each joint (Nm)."""
        return self.load.joint_torques(self.joints)

    def tcp(self, joints: Joints | None = None) -> Transform:
        """The pose of the TCP in the base at joint positions (rad), None for the present ones."""
        return self._core.tcp(self.joints if joints is None else joints)

    @property
    def tool_in_flange(self) -> Transform:
        """The pose of the TCP in the flange."""
        return self._core.tool_in_flange

    @property
    def end_of_queue(self) -> Joints:
        """Joint positions (rad) at which the next normal move begins."""
        return self._moves.end_of_queue()

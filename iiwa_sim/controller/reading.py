"""What the state of a robot follows from, read in a tick with as little work as can be."""

from typing import NamedTuple

from iiwa_sim.controller.carrying import ToolLoad
from iiwa_sim.controller.core import Core
from iiwa_sim.controller.errors import ErrorRecord
from iiwa_sim.controller.handling import GripperState, PartState
from iiwa_sim.controller.io import Io
from iiwa_sim.controller.meetings import LinkTouch, touches_of
from iiwa_sim.controller.modes import Mode
from iiwa_sim.controller.status import RobotStatus, status_of
from iiwa_sim.frames import Transform
from iiwa_sim.motion.joints import Joints
from iiwa_sim.wrench import Wrench


class Reading(NamedTuple):
    """One robot in one tick. Nothing in it ever changes, so another thread may look at it later."""

    tick: int
    joints: Joints
    """rad"""
    joints_before: Joints
    """A tick ago (rad)."""
    goal: Joints
    """Goal of the joints, as `Controller.goal_joints` (rad)."""
    tool_in_flange: Transform
    force: Wrench
    """The reading at the TCP, along its axes (N, Nm)."""
    torques: tuple[float, ...]
    """Torques from outside, on each joint (Nm)."""
    accepted: int
    """The number of the newest move."""
    under_way: int
    """The number of the normal move that runs, 0 for none."""
    touching: bool
    """Whether surfaces do anything to the robot."""
    mode: Mode
    moving: bool
    override: float
    tool_load: ToolLoad
    gripper: GripperState | None
    parts: tuple[PartState, ...]
    link_touches: tuple[LinkTouch, ...]
    status: RobotStatus
    error: ErrorRecord | None
    inputs: tuple[bool, ...]
    outputs: tuple[bool, ...]


class Reader:
    """Reads one robot, in each tick that is recorded, which it must not delay.

    In a tick, 2 ms after the one before, all that is called is new to the processor: a call of a property
    costs several times as much as in a row. So what cannot have changed is not asked for again.
    """

    def __init__(self, core: Core, io: Io) -> None:
        """Nothing is read yet."""
        self._core = core
        self._io = io
        self._under_way = 0  # the move whose end is the goal
        self._goal: Joints = ()
        self._signs: tuple[object, ...] = ()  # what the status follows from
        self._status: RobotStatus | None = None

    def read(self) -> Reading:
        """The present reading."""
        core = self._core
        motions, load, errors, handling = core.motions, core.load, core.error_state, core.handling
        moving, joints, override = motions.moving, motions.joints, motions.override
        under_way, goal = 0, joints
        if moving:
            under_way = motions.under_way
            if under_way == 0 or under_way != self._under_way:
                self._under_way, self._goal = under_way, motions.goal
            goal = self._goal
        in_motion = moving and (override != 0.0 or not motions.pausing)
        signs = (errors.standing, in_motion, errors.e_stopped, errors.drives_powered)
        if self._status is None or signs != self._signs:
            self._signs, self._status = signs, status_of(errors, in_motion=in_motion)
        force, torques = load.readings(joints)
        return Reading(
            core.tick,
            joints,
            core.joints_before,
            goal,
            core.tool_in_flange,
            force,
            torques,
            core.accepted,
            under_way,
            load.touching,
            core.mode,
            moving,
            override,
            core.carrying.believed,
            None if handling is None else handling.state,
            () if handling is None else handling.parts,
            touches_of(load.link_contacts),
            self._status,
            errors.last,
            self._io.inputs,
            self._io.outputs,
        )

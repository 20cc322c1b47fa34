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
    """As `Controller.goal_joints` (rad)."""
    tool_in_flange: Transform
    force: Wrench
    """The reading at the TCP, along its axes (N, Nm)."""
    torques: tuple[float, ...]
    """From outside, on each joint (Nm)."""
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


def read(core: Core, io: Io) -> Reading:
    """The present reading. It is called in each tick of a robot that is recorded, which it must not delay: a
    call of a property costs several times as much there as in a row."""
    motions, load, faults = core.motions, core.load, core.faults
    moving, joints = motions.moving, motions.joints
    force, torques = load.readings(joints)
    return Reading(
        core.tick,
        joints,
        core.joints_before,
        motions.goal if moving else joints,
        core.tool_in_flange,
        force,
        torques,
        core.accepted,
        motions.under_way if moving else 0,
        load.touching,
        core.mode,
        moving,
        motions.override,
        core.carrying.believed,
        None if core.handling is None else core.handling.state,
        () if core.handling is None else core.handling.parts,
        touches_of(load.link_contacts),
        status_of(faults, in_motion=moving and not motions.pausing),
        faults.last,
        io.inputs,
        io.outputs,
    )

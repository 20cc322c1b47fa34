"""The state of the robot in one tick, all of it at once.

A new field goes into `Snapshot`, into `snapshot`, and into `protocol/status.schema.json` with its unit.
"""

import msgspec

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import ErrorRecord
from iiwa_sim.controller.handling import GripperState, PartState
from iiwa_sim.controller.meetings import LinkTouch, touches_of
from iiwa_sim.controller.status import RobotStatus
from iiwa_sim.frames import Frame

NO_ERROR = ErrorRecord(0, "none")


class ErrorState(msgspec.Struct, frozen=True):
    """What went wrong last, as `get error` tells it."""

    code: int
    reason: str


class Snapshot(msgspec.Struct, frozen=True, kw_only=True):
    """Where a command gets the same, the field has that command's name, units and order."""

    time_s: float
    """Simulated, since the start."""
    tick: int
    mode: str
    status: str
    """moving, stopped"""
    joint_position: tuple[float, ...]
    """rad"""
    joint_velocity: tuple[float, ...]
    """rad/s, of the last tick"""
    flange_frame: Frame
    """The flange in the base: mm, rad."""
    tool_frame: Frame
    """The TCP in the base: mm, rad."""
    cartesian_force: tuple[float, ...]
    """External force (N) and torque (Nm) at the TCP, along its axes."""
    joint_torque: tuple[float, ...]
    """External torque on each joint (Nm)."""
    goal_joint_position: tuple[float, ...]
    """rad: the end of the move under way."""
    goal_frame: Frame
    """The TCP there, in the base: mm, rad."""
    override: float
    """0 to 1."""
    tool_load: tuple[float, ...]
    """What the controller takes its arm to carry: kg, and the centre of that in the flange (mm)."""
    gripper: GripperState | None = None
    """None without one. mm"""
    parts: tuple[PartState, ...]
    link_touches: tuple[LinkTouch, ...]
    """Links that touch surfaces."""
    robot_status: RobotStatus
    inputs: tuple[bool, ...]
    """Digital inputs, from number 1 on."""
    outputs: tuple[bool, ...]
    error: ErrorState


def snapshot(controller: Controller) -> Snapshot:
    """The present state of `controller`'s robot."""
    error = controller.last_error or NO_ERROR
    return Snapshot(
        time_s=round(controller.tick * controller.tick_s, 9),  # 1.4, not 1.4000000000000001
        tick=controller.tick,
        mode=controller.mode.value,
        status="moving" if controller.moving else "stopped",
        joint_position=controller.joints,
        joint_velocity=controller.joint_velocity(),
        flange_frame=controller.flange_frame(),
        tool_frame=controller.tool_frame(),
        cartesian_force=controller.cartesian_force(),
        joint_torque=controller.joint_torque(),
        goal_joint_position=controller.goal_joints,
        goal_frame=controller.goal_frame(),
        override=controller.override,
        tool_load=controller.tool_load.told(),
        gripper=None if controller.handling is None else controller.handling.state,
        parts=() if controller.handling is None else controller.handling.parts,
        link_touches=touches_of(controller.load.link_contacts),
        robot_status=controller.status(),
        inputs=controller.io.inputs,
        outputs=controller.io.outputs,
        error=ErrorState(error.code, error.reason),
    )

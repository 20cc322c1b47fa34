"""The state of the robot in one tick, for status lines, recordings, the page and Python.

A new field goes into `Snapshot`, into `snapshot`, and into `protocol/status.schema.json` with its unit.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import msgspec

from iiwa_sim.contact.links import LinkContact
from iiwa_sim.controller.errors import ErrorRecord
from iiwa_sim.controller.handling import BodyState, GripperState, PartState
from iiwa_sim.frames import Frame

if TYPE_CHECKING:
    from iiwa_sim.controller.controller import Controller


class RobotStatus(NamedTuple):
    """The state in the terms of ROS-Industrial: fields and values of industrial_msgs/RobotStatus.

    A flag is 1 for true and 0 for false.
    """

    mode: int
    e_stopped: int
    """The emergency stop is pressed."""
    drives_powered: int
    motion_possible: int
    """A move would be accepted."""
    in_motion: int
    """The robot moves: unlike `get status`, not in a pause."""
    in_error: int
    error_code: int
    """The cause of the error state, 0 outside of it."""


class Snapshot(msgspec.Struct, frozen=True, kw_only=True):
    """State in one tick. A field that a command gets, too, has its name, units and order."""

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
    """rad: the end of the running move."""
    goal_frame: Frame
    """The TCP there, in the base: mm, rad."""
    override: float
    """0 to 1."""
    tool_load: tuple[float, ...]
    """The load at the flange that the controller believes in: kg, and its centre in the flange (mm)."""
    gripper: GripperState | None = None
    """The state of the gripper; None without one."""
    parts: tuple[PartState, ...]
    bodies: tuple[BodyState, ...] = ()
    """The bodies of the scene."""
    link_touches: tuple[LinkContact, ...]
    """Links that touch surfaces."""
    robot_status: RobotStatus
    inputs: tuple[bool, ...]
    """Digital inputs, from number 1 on."""
    outputs: tuple[bool, ...]
    error: ErrorRecord
    """The last error, as `get error` replies."""


def snapshot(controller: Controller) -> Snapshot:
    """Return the present state of `controller`'s robot."""
    handling = controller.handling
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
        goal_joint_position=controller.motions.goal,
        goal_frame=controller.goal_frame(),
        override=controller.override,
        tool_load=controller.tool_load.in_mm(),
        gripper=None if handling is None else handling.state,
        parts=() if handling is None else handling.parts,
        bodies=() if handling is None else handling.scene_bodies,
        link_touches=controller.load.link_contacts,
        robot_status=controller.status(),
        inputs=controller.io.inputs,
        outputs=controller.io.outputs,
        error=controller.errors.last or ErrorRecord(0, "none"),
    )

"""The state of the robot in one tick, all of it at once.

A new field goes into `Snapshot`, into `snapshot`, and into `protocol/status.schema.json` with its unit.
"""

import msgspec

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import ErrorRecord
from iiwa_sim.frames import Frame

NO_ERROR = ErrorRecord(0, "none")


class ErrorState(msgspec.Struct, frozen=True):
    """What went wrong last, as `get error` tells it."""

    code: int
    reason: str


class Snapshot(msgspec.Struct, frozen=True):
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
    error: ErrorState


def snapshot(controller: Controller) -> Snapshot:
    """The present state of `controller`'s robot."""
    error = controller.last_error or NO_ERROR
    return Snapshot(
        time_s=controller.tick * controller.tick_s,
        tick=controller.tick,
        mode=controller.mode.value,
        status="moving" if controller.moving else "stopped",
        joint_position=controller.joints,
        joint_velocity=controller.joint_velocity(),
        flange_frame=controller.flange_frame(),
        tool_frame=controller.tool_frame(),
        cartesian_force=controller.cartesian_force(),
        joint_torque=controller.joint_torque(),
        error=ErrorState(error.code, error.reason),
    )

"""The state of the robot as it is recorded: that of the status port, rounded but for the joint positions."""

import msgspec

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.snapshot import snapshot
from iiwa_sim.frames import Frame

PER_MM = 1e4
"""Steps, of frames in mm: of 0.1 um each. In full, what is rounded here would be more than half of a file."""
PER_UNIT = 1e7
"""Of angles (rad) and joint velocities (rad/s)."""
PER_N = 1e4
"""Of forces (N) and torques (Nm)."""

_encode = msgspec.json.Encoder().encode


def state_line(controller: Controller) -> bytes:
    """The present state as JSON, fit for `protocol/status.schema.json`.

    Joint positions are the robot's own, bit for bit, so that a recording plays back to them; all else that is
    found from them by arithmetic is rounded.
    """
    state = snapshot(controller)
    return _encode(
        msgspec.structs.replace(
            state,
            joint_velocity=_rounded(state.joint_velocity, PER_UNIT),
            flange_frame=_frame(state.flange_frame),
            tool_frame=_frame(state.tool_frame),
            cartesian_force=_rounded(state.cartesian_force, PER_N),
            joint_torque=_rounded(state.joint_torque, PER_N),
            goal_frame=_frame(state.goal_frame),
        )
    )


def _rounded(values: tuple[float, ...], steps: float) -> tuple[float, ...]:
    """To the nearest step; `round` would take five times as long."""
    if not any(values):
        return values
    return tuple([(value * steps + 0.5) // 1.0 / steps for value in values])


def _frame(frame: Frame) -> Frame:
    return Frame(*_rounded(frame[:3], PER_MM), *_rounded(frame[3:], PER_UNIT))

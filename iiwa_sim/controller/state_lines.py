"""The state of a robot as lines of JSON, one after the other: what stays as it was is not made again.

A line has the fields of a `Snapshot`. In a tick, 2 ms after the one before, all that is called is new to the
processor, so a line made by way of a snapshot takes twice as long as this.
"""

from collections.abc import Sequence

import msgspec

from iiwa_sim.controller.handling import GripperState, PartState
from iiwa_sim.controller.meetings import LinkTouch
from iiwa_sim.controller.numbers_kernel import Numbers
from iiwa_sim.controller.reading import Reading
from iiwa_sim.controller.snapshot import NO_ERROR, ErrorState
from iiwa_sim.controller.status import RobotStatus
from iiwa_sim.motion.joints import Joints

Values = Sequence[float]
_STANDING = slice(Reading._fields.index("mode"), None)


class _Moved(msgspec.Struct):
    """The part of a line that differs in each tick of a motion."""

    joint_position: Joints
    joint_velocity: Values
    flange_frame: Values
    tool_frame: Values


class _Forces(msgspec.Struct):
    cartesian_force: Values
    joint_torque: Values


class _Goal(msgspec.Struct):
    goal_joint_position: Joints
    goal_frame: Values


class _Mode(msgspec.Struct):
    mode: str
    status: str


class _Standing(msgspec.Struct):
    """The part that is the same for many ticks, beside the mode."""

    override: float
    tool_load: tuple[float, ...]
    gripper: GripperState | msgspec.UnsetType | None
    parts: tuple[PartState, ...]
    link_touches: tuple[LinkTouch, ...]
    robot_status: RobotStatus
    inputs: tuple[bool, ...]
    outputs: tuple[bool, ...]
    error: ErrorState


class StateLines:
    """Makes lines of the readings of one robot, given in the order of time, in one thread.

    Their fields are in the order of those of a `Snapshot`.
    """

    def __init__(self, numbers: Numbers, tick_s: float, no_gripper: msgspec.UnsetType | None = None) -> None:
        """`no_gripper` is what a robot without one has there; UNSET leaves the field out."""
        self._numbers = numbers
        self._tick_s = tick_s
        self._no_gripper = no_gripper
        self._encode = msgspec.json.Encoder().encode
        self._before: Reading | None = None
        self._mode = self._moved = self._forces = self._goal = self._standing = b""

    def line(self, now: Reading) -> bytes:
        """The state of a tick as JSON, fit for `protocol/status.schema.json`."""
        before, self._before = self._before, now
        numbers, encode = self._numbers, self._encode
        has_tool = before is not None and now.tool_in_flange == before.tool_in_flange
        if before is None or not (
            has_tool and now.joints == before.joints and now.joints_before == before.joints_before
        ):
            frames = numbers.frames(now.joints, now.tool_in_flange)
            velocities = numbers.velocities(now.joints, now.joints_before, self._tick_s)
            self._moved = encode(_Moved(now.joints, velocities, *frames))[1:-1]
        if before is None or now.force != before.force or now.torques != before.torques:
            self._forces = encode(_Forces(numbers.forces(now.force), numbers.forces(now.torques)))[1:-1]
        if before is None or not (has_tool and now.goal == before.goal):
            self._goal = encode(_Goal(now.goal, numbers.tcp(now.goal, now.tool_in_flange)))[1:-1]
        if before is None or now[_STANDING] != before[_STANDING]:
            self._mode = encode(_Mode(now.mode.value, "moving" if now.moving else "stopped"))[1:-1]
            self._standing = encode(self._stands(now))[1:]
        time_s = encode(round(now.tick * self._tick_s, 9))  # 1.4, not 1.4000000000000001
        rest = (self._mode, self._moved, self._forces, self._goal, self._standing)
        return b'{"time_s":%b,"tick":%d,%b,%b,%b,%b,%b' % (time_s, now.tick, *rest)

    def _stands(self, reading: Reading) -> _Standing:
        error = reading.error or NO_ERROR
        return _Standing(
            reading.override,
            reading.tool_load.told(),
            self._no_gripper if reading.gripper is None else reading.gripper,
            reading.parts,
            reading.link_touches,
            reading.status,
            reading.inputs,
            reading.outputs,
            ErrorState(error.code, error.reason),
        )

"""The state of the robot as it is recorded: readings of ticks, made lines of JSON."""

from collections.abc import Sequence
from math import floor

import msgspec

from iiwa_sim.controller.handling import GripperState, PartState
from iiwa_sim.controller.meetings import LinkTouch
from iiwa_sim.controller.reading import Reading
from iiwa_sim.controller.snapshot import NO_ERROR, ErrorState
from iiwa_sim.controller.status import RobotStatus
from iiwa_sim.motion.joints import Joints
from iiwa_sim.recordings.numbers_kernel import Numbers
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.model import Model

PER_N = 1e4
"""Steps, of forces (N) and torques (Nm)."""

Bits = tuple[bool, ...]
_STANDING = slice(Reading._fields.index("mode"), None)


class _Moved(msgspec.Struct):
    """The part of a line that differs in each tick of a motion."""

    joint_position: Joints
    joint_velocity: list[float]
    flange_frame: list[float]
    tool_frame: list[float]


class _Forces(msgspec.Struct):
    cartesian_force: list[float]
    joint_torque: list[float]


class _Goal(msgspec.Struct):
    goal_joint_position: Joints
    goal_frame: list[float]


class _Standing(msgspec.Struct):
    """The part that is the same for many ticks."""

    mode: str
    status: str
    override: float
    tool_load: tuple[float, ...]
    gripper: GripperState | msgspec.UnsetType
    """Left out without one: for Lichtblick a field has one type."""
    parts: tuple[PartState, ...]
    link_touches: tuple[LinkTouch, ...]
    robot_status: RobotStatus
    inputs: Bits
    outputs: Bits
    error: ErrorState


class StateLines:
    """Makes lines of the readings of one robot, given in the order of time, in one thread.

    Joint positions are the robot's own, bit for bit, so that a recording plays back to them; all else that is
    found from them by arithmetic is rounded. What is as it was in the line before is not made again.
    """

    def __init__(self, description: RobotDescription, tick_s: float) -> None:
        # With a model of our own: it remembers, and the robot's is in another thread.
        self._numbers = Numbers(Model(description).tcp_of_flange)
        self._tick_s = tick_s
        self._encode = msgspec.json.Encoder().encode
        self._before: Reading | None = None
        self._moved = self._forces = self._goal = self._standing = b""

    def line(self, now: Reading) -> bytes:
        """The state of a tick as JSON, fit for `protocol/status.schema.json`."""
        before, self._before = self._before, now
        has_tool = before is not None and now.tool_in_flange == before.tool_in_flange
        if before is None or not (
            has_tool and now.joints == before.joints and now.joints_before == before.joints_before
        ):
            frames = self._numbers.frames(now.joints, now.tool_in_flange)
            velocities = self._numbers.velocities(now.joints, now.joints_before, self._tick_s)
            self._moved = self._encode(_Moved(now.joints, velocities, *frames))[1:-1]
        if before is None or now.force != before.force or now.torques != before.torques:
            self._forces = self._encode(_Forces(_rounded(now.force), _rounded(now.torques)))[1:-1]
        if before is None or not (has_tool and now.goal == before.goal):
            _, frame = self._numbers.frames(now.goal, now.tool_in_flange)
            self._goal = self._encode(_Goal(now.goal, frame))[1:-1]
        if before is None or now[_STANDING] != before[_STANDING]:
            self._standing = self._encode(_standing(now))[1:]
        time_s = self._encode(round(now.tick * self._tick_s, 9))  # 1.4, not 1.4000000000000001
        rest = (self._moved, self._forces, self._goal, self._standing)
        return b'{"time_s":%b,"tick":%d,%b,%b,%b,%b' % (time_s, now.tick, *rest)


def _standing(reading: Reading) -> _Standing:
    error = reading.error or NO_ERROR
    return _Standing(
        reading.mode.value,
        "moving" if reading.moving else "stopped",
        reading.override,
        reading.tool_load.told(),
        msgspec.UNSET if reading.gripper is None else reading.gripper,
        reading.parts,
        reading.link_touches,
        reading.status,
        reading.inputs,
        reading.outputs,
        ErrorState(error.code, error.reason),
    )


def _rounded(values: Sequence[float]) -> list[float]:
    """Forces or torques, to the nearest step."""
    return [floor(value * PER_N + 0.5) / PER_N for value in values]

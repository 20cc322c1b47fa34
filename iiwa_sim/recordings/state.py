"""The state of the robot as it is recorded: readings of ticks, made lines of JSON many at a time."""

from collections.abc import Sequence
from itertools import compress
from math import pi

import msgspec
import numpy as np
from numpy.typing import NDArray

from iiwa_sim.controller.handling import GripperState, PartState
from iiwa_sim.controller.meetings import LinkTouch
from iiwa_sim.controller.reading import Reading
from iiwa_sim.controller.snapshot import NO_ERROR, ErrorState
from iiwa_sim.controller.status import RobotStatus
from iiwa_sim.frames import GIMBAL_LOCK, Transform, compose, euler_from_rotation
from iiwa_sim.motion.joints import Joints
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.model import Model

PER_MM = 1e4
"""Steps, of frames in mm: of 0.1 um each. In full, what is rounded here would be more than half of a file."""
PER_UNIT = 1e7
"""Of angles (rad) and joint velocities (rad/s)."""
PER_N = 1e4
"""Of forces (N) and torques (Nm)."""
_PER_FRAME = np.array([PER_MM] * 3 + [PER_UNIT] * 3)

Array = NDArray[np.float64]
Bits = tuple[bool, ...]
_STANDING = slice(Reading._fields.index("mode"), None)


class _Moved(msgspec.Struct):
    """The part of a line that differs in each tick of a motion."""

    joint_position: Joints
    joint_velocity: list[float]
    flange_frame: list[float]
    tool_frame: list[float]
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
        self._model = Model(description)  # of our own: it remembers, and the robot's is in another thread
        self._tick_s = tick_s
        self._encode = msgspec.json.Encoder().encode
        self._before: Reading | None = None
        self._moved = self._goal = self._standing = b""

    def lines(self, readings: Sequence[Reading]) -> list[bytes]:
        """The states of ticks as JSON, fit for `protocol/status.schema.json`."""
        befores = [self._before, *readings[:-1]]
        changed = [_moved(before, now) for before, now in zip(befores, readings, strict=True)]
        moved = iter(self._all_moved(list(compress(readings, changed))) if any(changed) else [])
        lines = []
        for before, now, has_moved in zip(befores, readings, changed, strict=True):
            if has_moved:
                self._moved = self._encode(next(moved))[1:-1]
            if before is None or now.goal != before.goal or now.tool_in_flange != before.tool_in_flange:
                self._goal = self._encode(self._goal_of(now))[1:-1]
            if before is None or now[_STANDING] != before[_STANDING]:
                self._standing = self._encode(_standing(now))[1:]
            time_s = self._encode(round(now.tick * self._tick_s, 9))  # 1.4, not 1.4000000000000001
            rest = (self._moved, self._goal, self._standing)
            lines.append(b'{"time_s":%b,"tick":%d,%b,%b,%b' % (time_s, now.tick, *rest))
        self._before = readings[-1]
        return lines

    def _all_moved(self, readings: Sequence[Reading]) -> list[_Moved]:
        """All at once, which takes half the time of one after the other."""
        joints = np.array([each.joints for each in readings])
        before = np.array([each.joints_before for each in readings])
        velocities = _rounded((joints - before) / self._tick_s, PER_UNIT)
        forces = _each_rounded([each.force for each in readings])
        torques = _each_rounded([each.torques for each in readings])
        flanges = [self._model.flange(each.joints) for each in readings]
        tools = [compose(pose, each.tool_in_flange) for pose, each in zip(flanges, readings, strict=True)]
        poses = _frames([*flanges, *tools]).tolist()
        columns = (velocities.tolist(), poses[: len(flanges)], poses[len(flanges) :], forces, torques)
        return [_Moved(each.joints, *row) for each, *row in zip(readings, *columns, strict=True)]

    def _goal_of(self, reading: Reading) -> _Goal:
        tool = compose(self._model.flange(reading.goal), reading.tool_in_flange)
        return _Goal(reading.goal, _frames([tool]).tolist()[0])


def _moved(before: Reading | None, now: Reading) -> bool:
    """Whether anything is different that differs in each tick of a motion."""
    return (
        before is None
        or now.joints != before.joints
        or now.joints_before != before.joints_before
        or now.force != before.force
        or now.torques != before.torques
        or now.tool_in_flange != before.tool_in_flange
    )


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


def _each_rounded(rows: Sequence[tuple[float, ...]]) -> Sequence[list[float]]:
    """Forces or torques. Those of a robot that nothing touches are one and the same in all ticks."""
    if all(row is rows[0] for row in rows):
        return [_rounded(np.array(rows[0]), PER_N).tolist()] * len(rows)
    found: list[list[float]] = _rounded(np.array(rows), PER_N).tolist()
    return found


def _rounded(values: Array, steps: float | Array) -> Array:
    """To the nearest step."""
    rounded: Array = np.floor(values * steps + 0.5) / steps
    return rounded


def _frames(poses: Sequence[Transform]) -> Array:
    """Poses in m as rows of frames in mm and rad (n, 6), rounded."""
    r = np.array([pose.rotation for pose in poses])
    found = np.empty((len(poses), 6))
    found[:, :3] = 1e3 * np.array([pose.translation for pose in poses])
    # As `frames.euler_from_rotation` does it.
    cos_beta = np.hypot(r[:, 0], r[:, 3])
    locked = np.flatnonzero(cos_beta < GIMBAL_LOCK)
    cos_beta[locked] = 1.0
    sa, ca = r[:, 3] / cos_beta, r[:, 0] / cos_beta
    found[:, 3] = np.arctan2(r[:, 3], r[:, 0])
    found[:, 4] = np.arctan2(-r[:, 6], cos_beta)
    found[:, 5] = np.arctan2(sa * r[:, 2] - ca * r[:, 5], ca * r[:, 4] - sa * r[:, 1])
    angles = found[:, 3:]
    angles[angles <= -pi] = pi
    for place in locked.tolist():
        found[place, 3:] = euler_from_rotation(poses[place].rotation)
    return _rounded(found, _PER_FRAME)

"""The state of the robot as it is recorded: read in the tick, and made a line of JSON later."""

from typing import NamedTuple

import msgspec

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.snapshot import NO_ERROR, ErrorState
from iiwa_sim.controller.status import RobotStatus
from iiwa_sim.frames import Frame, Transform, compose
from iiwa_sim.motion.joints import Joints
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.model import Model
from iiwa_sim.wrench import Wrench

PER_MM = 1e4
"""Steps, of frames in mm: of 0.1 um each. In full, what is rounded here would be more than half of a file."""
PER_UNIT = 1e7
"""Of angles (rad) and joint velocities (rad/s)."""
PER_N = 1e4
"""Of forces (N) and torques (Nm)."""


class Standing(msgspec.Struct, frozen=True):
    """What is the same for many ticks, as in `Snapshot`."""

    mode: str
    status: str
    override: float
    robot_status: RobotStatus
    inputs: tuple[bool, ...]
    outputs: tuple[bool, ...]
    error: ErrorState


class Reading(NamedTuple):
    """What of the robot all that is recorded of a tick follows from. Nothing in it ever changes."""

    joints: Joints
    """rad"""
    joints_before: Joints
    """A tick ago (rad)."""
    goal: Joints
    """rad"""
    tool_in_flange: Transform
    force: Wrench
    torque: tuple[float, ...]
    """From outside, on each joint (Nm)."""
    standing: Standing


def read(controller: Controller) -> Reading:
    """The present reading: what costs time is left for later, since a tick has to wait for this."""
    error = controller.last_error or NO_ERROR
    return Reading(
        controller.joints,
        controller.joints_before,
        controller.goal_joints,
        controller.tool_in_flange,
        controller.cartesian_force(),
        controller.joint_torque(),
        Standing(
            controller.mode.value,
            "moving" if controller.moving else "stopped",
            controller.override,
            controller.status(),
            controller.io.inputs,
            controller.io.outputs,
            ErrorState(error.code, error.reason),
        ),
    )


class _Moved(msgspec.Struct):
    """The part of a line that differs in each tick of a motion."""

    joint_position: Joints
    joint_velocity: tuple[float, ...]
    flange_frame: Frame
    tool_frame: Frame
    cartesian_force: tuple[float, ...]
    joint_torque: tuple[float, ...]


class _Goal(msgspec.Struct):
    goal_joint_position: Joints
    goal_frame: Frame


class StateLines:
    """Makes lines of the readings of one robot, given in the order of time, in one thread.

    Joint positions are the robot's own, bit for bit, so that a recording plays back to them; all else that is
    found from them by arithmetic is rounded. What is as it was in the line before is not made again.
    """

    def __init__(self, description: RobotDescription, tick_s: float) -> None:
        self._model = Model(description)  # of our own: it remembers, and the robot's is in another thread
        self._tick_s = tick_s
        self._encode = msgspec.json.Encoder().encode
        self._reading: Reading | None = None
        self._rest = b""  # what follows the tick
        self._goal = b""
        self._standing = b""

    def line(self, reading: Reading, tick: int) -> bytes:
        """The state in a tick as JSON, fit for `protocol/status.schema.json`."""
        before = self._reading
        if before is None or reading != before:
            tool = reading.tool_in_flange
            if before is None or reading.goal != before.goal or tool != before.tool_in_flange:
                self._goal = self._encode(_Goal(reading.goal, self._tcp(reading.goal, tool)[1]))
            if before is None or reading.standing != before.standing:
                self._standing = self._encode(reading.standing)
            self._reading = reading
            moved = self._encode(self._moved(reading))
            self._rest = b"%b,%b,%b" % (moved[1:-1], self._goal[1:-1], self._standing[1:])
        time_s = self._encode(round(tick * self._tick_s, 9))  # 1.4, not 1.4000000000000001
        return b'{"time_s":%b,"tick":%d,%b' % (time_s, tick, self._rest)

    def _moved(self, reading: Reading) -> _Moved:
        flange, tool = self._tcp(reading.joints, reading.tool_in_flange)
        tick_s = self._tick_s
        velocity = [(now - before) / tick_s for now, before in zip(*reading[:2], strict=True)]
        return _Moved(
            reading.joints,
            _rounded(tuple(velocity), PER_UNIT),
            flange,
            tool,
            _rounded(reading.force, PER_N),
            _rounded(reading.torque, PER_N),
        )

    def _tcp(self, joints: Joints, tool_in_flange: Transform) -> tuple[Frame, Frame]:
        """Flange and TCP in the base, rounded."""
        flange = self._model.flange(joints)
        return _frame(flange), _frame(compose(flange, tool_in_flange))


def _rounded(values: tuple[float, ...], steps: float) -> tuple[float, ...]:
    """To the nearest step; `round` would take five times as long."""
    if not any(values):
        return values
    return tuple([(value * steps + 0.5) // 1.0 / steps for value in values])


def _frame(pose: Transform) -> Frame:
    frame = Frame.from_transform(pose)
    return Frame(*_rounded(frame[:3], PER_MM), *_rounded(frame[3:], PER_UNIT))

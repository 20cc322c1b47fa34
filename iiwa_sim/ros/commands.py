"""Reads a robot_movement_interface/Command as a move, or refuses it with a reason: nothing is guessed.

Units are those of drag&bot's drivers: m and rad; `%` is 0 to 1, `PERCENT` 0 to 100.
"""

from collections.abc import Iterable, Sequence
from math import dist, isfinite
from typing import Any

from msgspec.structs import astuple

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.controller.requests import Kind, MoveRequest, from_quaternion
from iiwa_sim.frames import Frame, compose, transform_from_euler
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.wording import harmless, shortened

JOINTS, EULER, QUATERNION = "JOINTS", "EULER_INTRINSIC_ZYX", "QUATERNION"
BASES = ("base", "/base", "base_link", "/base_link")
"""Values of pose_reference with which the pose is in the base."""
_TYPES = {kind.value: (kind, False) for kind in Kind if kind is not Kind.HOLD} | {
    "LINFORCE": (Kind.LIN, True),
    "PTPFORCE": (Kind.PTP, True),
}
_SHARES = {"%": 1.0, "PERCENT": 0.01}


def read_command(command: Any, robot: Controller, *, apply_reference: bool = True) -> tuple[MoveRequest, str]:
    """Return the move that a command asks for, and a remark on how it was understood. Raises `Refused`.

    `apply_reference` says what to do with a pose_reference_frame with values that is not the base.
    """
    if command.command_type not in _TYPES:
        raise _unknown("command_type", command.command_type, _TYPES)
    kind, feels_forces = _TYPES[command.command_type]
    for name in ("pose", "velocity", "acceleration", "effort", "blending"):
        if not all(map(isfinite, getattr(command, name))):
            raise _bad(f"{name}: expected finite numbers")
    if command.additional_parameters or command.additional_values:
        raise _bad("additional_parameters and additional_values: expected none")
    count = len(robot.description.joints)
    target, remark = _target(command, count, apply_reference)
    on_joints = not isinstance(target, Frame)
    if feels_forces and on_joints:
        raise _bad(f"pose_type of {command.command_type}: expected {EULER} or {QUATERNION}")
    move = _with_speed(MoveRequest(kind, target), command, robot)
    move = move._replace(**_acceleration(command, move, robot.description))
    thresholds, blending = _thresholds(command, feels_forces), _blending(command, move, robot)
    return move._replace(blending=blending, thresholds=thresholds), remark


def _target(command: Any, joint_count: int, apply_reference: bool) -> tuple[Sequence[float] | Frame, str]:
    kind, pose, name = command.pose_type, command.pose, command.pose_reference
    counts = {JOINTS: joint_count, EULER: 6, QUATERNION: 7}
    if kind not in counts:
        raise _unknown("pose_type", kind, counts)
    _count("pose", pose, counts[kind], kind)
    if kind == JOINTS:
        return tuple(pose), ""
    x, y, z = (1e3 * each for each in pose[:3])
    target = Frame(x, y, z, *pose[3:]) if kind == EULER else from_quaternion((x, y, z), tuple(pose[3:]))
    frame = astuple(command.pose_reference_frame)
    if not all(map(isfinite, frame)):
        raise _bad("pose_reference_frame: expected finite numbers")
    if not any(frame) or name in BASES:  # a frame of zeros is the base, whatever its name
        return target, ""
    if not apply_reference:
        return target, f"pose_reference {_shown(name)} was taken as applied already"
    in_base = Frame.from_transform(compose(transform_from_euler(*frame), target.to_transform()))
    return in_base, f"pose_reference {_shown(name)} was applied"


def _with_speed(move: MoveRequest, command: Any, robot: Controller) -> MoveRequest:
    word, values, joints = command.velocity_type, command.velocity, robot.description.joints
    on_joints = not isinstance(move.target, Frame)
    on_each_joint = on_joints and move.kind is not Kind.LIN
    _one_or_each("velocity", values, len(joints) if on_each_joint else 1)
    if word == "M/S":
        if move.kind is not Kind.LIN or on_joints:
            raise _bad("velocity_type M/S: only for LIN and LINFORCE to a Cartesian pose")
        if not values[0] > 0.0:
            raise _bad("velocity in M/S: expected above 0")
        return move._replace(tcp_speed_m_s=values[0])
    if word == "RAD/S":
        if not on_each_joint:
            raise _bad(f"velocity_type RAD/S: only for PTP, SMART and DIRECT to {JOINTS}")
        limits = robot.description.velocity
        each = values * (len(joints) // len(values))
        for name, speed, limit in zip(joints, each, limits, strict=True):
            if not 0.0 <= speed <= limit:
                raise _bad(f"velocity {speed:g} rad/s: {name} goes up to {limit:.7g} rad/s, from 0")
        return move._replace(speeds=tuple(speed / limit for speed, limit in zip(each, limits, strict=True)))
    if word not in _SHARES:
        raise _unknown("velocity_type", word, (*_SHARES, "M/S", "RAD/S"))
    shares = _shares("velocity", word, values, zero=on_each_joint)
    if on_each_joint:
        return move._replace(speeds=shares * (len(joints) // len(shares)))
    return move._replace(speed=shares[0])


def _acceleration(command: Any, move: MoveRequest, robot: RobotDescription) -> dict[str, Any]:
    """The fields of a `MoveRequest` for the acceleration; none if the command has no values."""
    word, values = command.acceleration_type, command.acceleration
    if not values:
        return {}
    on_each_joint = not isinstance(move.target, Frame) and move.kind is not Kind.LIN
    _one_or_each("acceleration", values, len(robot.joints) if on_each_joint else 1)
    if word in _SHARES:
        return {"accelerations": _shares("acceleration", word, values)}
    if word not in ("M/S^2", "RAD/S^2"):
        raise _unknown("acceleration_type", word, ("M/S^2", "RAD/S^2", *_SHARES))
    if not all(value > 0.0 for value in values):
        raise _bad(f"acceleration in {word}: expected above 0")
    if word == "RAD/S^2":
        limits = robot.direct_acceleration if move.kind is Kind.DIRECT else robot.acceleration
        each = zip(values * (len(limits) // len(values)), limits, strict=True)
        return {"accelerations": tuple(min(value / limit, 1.0) for value, limit in each)}
    if move.kind is not Kind.LIN:
        raise _bad("acceleration_type M/S^2: only for LIN and LINFORCE")
    return {"tcp_acceleration_m_s2": values[0]}


def _blending(command: Any, move: MoveRequest, robot: Controller) -> float:
    """Blending as a `MoveRequest` has it: mm, or for PTP to joints a part of the way."""
    word, values, target = command.blending_type, command.blending, move.target
    joint_line = move.kind is Kind.PTP and not isinstance(target, Frame)
    if len(values) > 1:
        raise _bad(f"blending: expected 1 value or none, got {len(values)}")
    value = float(values[0]) if values else 0.0
    if value == 0.0:
        return 0.0
    if value < 0.0:
        raise _bad(f"blending {value:g}: expected 0 or more")
    if move.kind.is_servo:
        raise _bad(f"blending of {move.kind.value}: expected 0, such moves do not blend")
    if word in _SHARES:
        (share,) = _shares("blending", word, [value])
        if joint_line:
            return share
        there = target if isinstance(target, Frame) else robot.tool_frame(tuple(target))
        return share * dist(robot.tool_frame(robot.end_of_queue)[:3], there[:3])
    if word == "M":
        if joint_line:
            raise _bad(f"blending_type M of PTP to {JOINTS}: expected RAD, % or PERCENT")
        return 1e3 * value
    if word == "RAD":
        if not joint_line:
            raise _bad(f"blending_type RAD: only for PTP to {JOINTS}, expected M, % or PERCENT")
        way = max(abs(b - a) for a, b in zip(robot.end_of_queue, target, strict=True))
        return 1.0 if value >= way else value / way
    raise _unknown("blending_type", word, ("M", "RAD", *_SHARES))


def _thresholds(command: Any, feels_forces: bool) -> tuple[float, float, float] | None:
    if not feels_forces:
        if command.effort:
            raise _bad(f"effort of {command.command_type}: expected no values")
        return None
    _count("effort", command.effort, 3, "forces that end the move, along x, y and z of the TCP")
    if command.effort_type != "N":
        raise _unknown("effort_type", command.effort_type, ("N",))
    x, y, z = command.effort
    if min(x, y, z) <= 0.0:
        raise _bad("effort: expected forces above 0")
    return (x, y, z)


def _shares(name: str, word: str, values: list[float], *, zero: bool = False) -> tuple[float, ...]:
    shares = tuple(_SHARES[word] * value for value in values)
    if min(shares) < 0.0 or max(shares) > 1.0 or (0.0 in shares and not zero):
        least, most = "0 or more" if zero else "above 0", "1" if word == "%" else "100"
        raise _bad(f"{name} in {word}: expected {least} and up to {most}")
    return shares


def _one_or_each(name: str, values: list[float], joint_count: int) -> None:
    if len(values) not in (1, joint_count):
        expected = "1 value" if joint_count == 1 else f"1 or {joint_count} values"
        raise _bad(f"{name}: expected {expected}, got {len(values)}")


def _count(name: str, values: list[float], expected: int, what: str) -> None:
    if len(values) != expected:
        raise _bad(f"{name}: expected {expected} values ({what}), got {len(values)}")


def _unknown(name: str, word: str, words: Iterable[str]) -> Refused:
    return _bad(f"{name} {_shown(word)}: expected one of {', '.join(words)}")


def _bad(reason: str) -> Refused:
    return Refused(EXECUTION, reason)


def _shown(word: str) -> str:
    return f"'{shortened(harmless(word), 40)}'"

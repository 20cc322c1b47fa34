"""Translates a Command message into a move, or refuses it with a reason: nothing is guessed or left out.

Units are those of drag&bot's drivers: m and rad; `%` is 0 to 1, `PERCENT` 0 to 100.
"""

from math import isfinite
from typing import Any

from iiwa_sim.controller.acceleration import AccelerationCap, AccelerationUnit
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.controller.poses import from_quaternion
from iiwa_sim.controller.requests import Kind
from iiwa_sim.frames import Frame, compose, transform_from_euler
from iiwa_sim.ros.rmi.robot import BlendingUnit, Joints, Move, SpeedUnit
from iiwa_sim.wording import harmless, shortened

JOINTS, EULER, QUATERNION = "JOINTS", "EULER_INTRINSIC_ZYX", "QUATERNION"
BASES = ("base", "/base", "base_link", "/base_link")
"""Values of pose_reference with which the pose is in the base."""
NEWTON = "N"

_TYPES = {kind.value: (kind, False) for kind in Kind if kind is not Kind.HOLD} | {
    "LINFORCE": (Kind.LIN, True),
    "PTPFORCE": (Kind.PTP, True),
}
_SHARES = {"%": 1.0, "PERCENT": 0.01}
_SPEED_UNITS = {"M/S": SpeedUnit.M_S, "RAD/S": SpeedUnit.RAD_S}
_ACCELERATION_UNITS = {"M/S^2": AccelerationUnit.TCP_M_S2, "RAD/S^2": AccelerationUnit.RAD_S2}
_LONGEST_WORD = 40


def read_command(command: Any, joint_count: int, *, apply_reference: bool = True) -> Move:
    """The move that a Command (of `definitions.type_of`) asks for. Raises `Refused`.

    `apply_reference` says what to do with a pose_reference_frame with values that is not the base.
    """
    if command.command_type not in _TYPES:
        raise _unknown("command_type", command.command_type, _TYPES)
    kind, feels_forces = _TYPES[command.command_type]
    _check_finite(command)
    if command.additional_parameters or command.additional_values:
        raise Refused(EXECUTION, "additional_parameters and additional_values: expected none")
    target, note = _target(command, joint_count, apply_reference)
    on_joints = not isinstance(target, Frame)
    if feels_forces and on_joints:
        raise Refused(EXECUTION, f"pose_type of {command.command_type}: expected {EULER} or {QUATERNION}")
    speeds, speed_unit = _speeds(command, kind, on_joints, joint_count)
    blending, blending_unit = _blending(command, kind, joint_line=on_joints and kind is Kind.PTP)
    thresholds = _thresholds(command, feels_forces)
    cap = _acceleration(command, kind, on_joints, joint_count)
    return Move(kind, target, speeds, speed_unit, blending, blending_unit, thresholds, cap, note)


def _check_finite(command: Any) -> None:
    frame = command.pose_reference_frame
    for name, values in (
        ("pose_reference_frame", _six(frame)),
        ("pose", command.pose),
        ("velocity", command.velocity),
        ("acceleration", command.acceleration),
        ("effort", command.effort),
        ("blending", command.blending),
    ):
        if not all(map(isfinite, values)):
            raise Refused(EXECUTION, f"{name}: expected finite numbers")


def _target(command: Any, joint_count: int, apply_reference: bool) -> tuple[Joints | Frame, str]:
    """The target, and a note on how it was understood."""
    kind, pose = command.pose_type, command.pose
    if kind == JOINTS:
        _count("pose", pose, joint_count, kind)
        return tuple(pose), ""
    if kind == EULER:
        _count("pose", pose, 6, kind)
        x, y, z, *angles = pose
        target = Frame(1e3 * x, 1e3 * y, 1e3 * z, *angles)
    elif kind == QUATERNION:
        _count("pose", pose, 7, kind)
        x, y, z, qx, qy, qz, qw = pose
        target = from_quaternion((1e3 * x, 1e3 * y, 1e3 * z), (qx, qy, qz, qw))
    else:
        raise _unknown("pose_type", kind, (JOINTS, EULER, QUATERNION))
    return _in_base(command, target, apply_reference)


def _in_base(command: Any, target: Frame, apply_reference: bool) -> tuple[Frame, str]:
    """The target in the base. A reference frame of zeros is the base, whatever its name."""
    frame, name = _six(command.pose_reference_frame), command.pose_reference
    if not any(frame) or name in BASES:
        return target, ""
    if not apply_reference:
        return target, f"pose_reference {_shown(name)} was taken as applied already"
    in_base = Frame.from_transform(compose(transform_from_euler(*frame), target.to_transform()))
    return in_base, f"pose_reference {_shown(name)} was applied"


def _speeds(
    command: Any, kind: Kind, on_joints: bool, joint_count: int
) -> tuple[tuple[float, ...], SpeedUnit]:
    word, values = command.velocity_type, command.velocity
    on_each_joint = on_joints and kind is not Kind.LIN
    _one_or_each("velocity", values, joint_count if on_each_joint else 1)
    if word in _SHARES:
        return _shares("velocity", word, values, zero=on_each_joint), SpeedUnit.RELATIVE
    if word not in _SPEED_UNITS:
        raise _unknown("velocity_type", word, (*_SHARES, *_SPEED_UNITS))
    unit = _SPEED_UNITS[word]
    if unit is SpeedUnit.M_S and (kind is not Kind.LIN or on_joints):
        raise Refused(EXECUTION, "velocity_type M/S: only for LIN and LINFORCE to a Cartesian pose")
    if unit is SpeedUnit.RAD_S and not on_each_joint:
        raise Refused(EXECUTION, f"velocity_type RAD/S: only for PTP, SMART and DIRECT to {JOINTS}")
    if unit is SpeedUnit.M_S and not values[0] > 0.0:
        raise Refused(EXECUTION, "velocity in M/S: expected above 0")
    if min(values) < 0.0:
        raise Refused(EXECUTION, f"velocity in {word}: expected 0 or more")
    return tuple(values), unit


def _acceleration(command: Any, kind: Kind, on_joints: bool, joint_count: int) -> AccelerationCap | None:
    """The acceleration cap; None if the command has no values, or full ones in % or PERCENT."""
    word, values = command.acceleration_type, command.acceleration
    if not values:
        return None
    _one_or_each("acceleration", values, joint_count if on_joints and kind is not Kind.LIN else 1)
    if word in _SHARES:
        shares = _shares("acceleration", word, values)
        return AccelerationCap(shares, AccelerationUnit.RELATIVE) if min(shares) < 1.0 else None
    if word not in _ACCELERATION_UNITS:
        raise _unknown("acceleration_type", word, (*_ACCELERATION_UNITS, *_SHARES))
    if not all(value > 0.0 for value in values):
        raise Refused(EXECUTION, f"acceleration in {word}: expected above 0")
    unit = _ACCELERATION_UNITS[word]
    if unit is AccelerationUnit.TCP_M_S2 and kind is not Kind.LIN:
        raise Refused(EXECUTION, "acceleration_type M/S^2: only for LIN and LINFORCE")
    return AccelerationCap(tuple(values), unit)


def _shares(name: str, word: str, values: list[float], *, zero: bool = False) -> tuple[float, ...]:
    shares = tuple(_SHARES[word] * value for value in values)
    if min(shares) < 0.0 or max(shares) > 1.0 or (0.0 in shares and not zero):
        least, most = "0 or more" if zero else "above 0", "1" if word == "%" else "100"
        raise Refused(EXECUTION, f"{name} in {word}: expected {least} and up to {most}")
    return shares


def _one_or_each(name: str, values: list[float], joint_count: int) -> None:
    if len(values) not in (1, joint_count):
        expected = "1 value" if joint_count == 1 else f"1 or {joint_count} values"
        raise Refused(EXECUTION, f"{name}: expected {expected}, got {len(values)}")


def _blending(command: Any, kind: Kind, *, joint_line: bool) -> tuple[float, BlendingUnit]:
    word, values = command.blending_type, command.blending
    if len(values) > 1:
        raise Refused(EXECUTION, f"blending: expected 1 value or none, got {len(values)}")
    if not values or values[0] == 0.0:
        return 0.0, BlendingUnit.MM
    (value,) = values
    if value < 0.0:
        raise Refused(EXECUTION, f"blending {value:g}: expected 0 or more")
    if kind.is_servo:
        raise Refused(EXECUTION, f"blending of {kind.value}: expected 0, such moves do not blend")
    if word in _SHARES:
        share = _SHARES[word] * value
        if share > 1.0:
            raise Refused(EXECUTION, f"blending in {word}: expected up to {'1' if word == '%' else '100'}")
        return share, BlendingUnit.RELATIVE
    if word == "M":
        if joint_line:
            raise Refused(EXECUTION, f"blending_type M of PTP to {JOINTS}: expected RAD, % or PERCENT")
        return 1e3 * value, BlendingUnit.MM
    if word == "RAD":
        if not joint_line:
            raise Refused(EXECUTION, f"blending_type RAD: only for PTP to {JOINTS}, expected M, % or PERCENT")
        return value, BlendingUnit.RAD
    raise _unknown("blending_type", word, ("M", "RAD", *_SHARES))


def _thresholds(command: Any, feels_forces: bool) -> tuple[float, float, float] | None:
    if not feels_forces:
        if command.effort:
            raise Refused(EXECUTION, f"effort of {command.command_type}: expected no values")
        return None
    _count("effort", command.effort, 3, "forces that end the move, along x, y and z of the TCP")
    if command.effort_type != NEWTON:
        raise _unknown("effort_type", command.effort_type, (NEWTON,))
    x, y, z = command.effort
    if min(x, y, z) <= 0.0:
        raise Refused(EXECUTION, "effort: expected forces above 0")
    return (x, y, z)


def _six(frame: Any) -> tuple[float, float, float, float, float, float]:
    return (frame.x, frame.y, frame.z, frame.alpha, frame.beta, frame.gamma)


def _count(name: str, values: list[float], expected: int, what: str) -> None:
    if len(values) != expected:
        raise Refused(EXECUTION, f"{name}: expected {expected} values ({what}), got {len(values)}")


def _unknown(name: str, word: str, words: Any) -> Refused:
    return Refused(EXECUTION, f"{name} {_shown(word)}: expected one of {', '.join(words)}")


def _shown(word: str) -> str:
    return f"'{shortened(harmless(word), _LONGEST_WORD)}'"

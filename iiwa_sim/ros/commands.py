"""Reads a robot_movement_interface/Command as a move, or refuses it with a reason: nothing is guessed.

Units are those of drag&bot's drivers: m and rad; `%` is 0 to 1, `PERCENT` 0 to 100.
"""

from collections.abc import Mapping, Sequence
from math import dist, inf, isfinite
from typing import Any, TypeVar

from msgspec.structs import astuple

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.controller.requests import Kind, MoveRequest, from_quaternion
from iiwa_sim.frames import Frame, compose, transform_from_euler
from iiwa_sim.wording import harmless, shortened

JOINTS, EULER, QUATERNION = "JOINTS", "EULER_INTRINSIC_ZYX", "QUATERNION"
BASES = ("base", "/base", "base_link", "/base_link")
"""Values of pose_reference with which the pose is in the base."""
_TYPES = {kind.value: (kind, False) for kind in Kind if kind is not Kind.HOLD} | {
    "LINFORCE": (Kind.LIN, True),
    "PTPFORCE": (Kind.PTP, True),
}
_Found = TypeVar("_Found")


def read_command(command: Any, robot: Controller, *, apply_reference: bool = True) -> MoveRequest:
    """Return the requested move of a command. Raises `Refused`.

    `apply_reference` says what to do with a pose_reference_frame with values that is not the base.
    """
    kind, feels_forces = _one_of("command_type", command.command_type, _TYPES)
    for name in ("pose", "velocity", "acceleration", "effort", "blending"):
        if not all(map(isfinite, getattr(command, name))):
            raise Refused(EXECUTION, f"{name}: expected finite numbers")
    if command.additional_parameters or command.additional_values:
        raise Refused(EXECUTION, "additional_parameters and additional_values: expected none")
    target = _target(command, len(robot.description.joints), apply_reference)
    if feels_forces and not isinstance(target, Frame):
        raise Refused(EXECUTION, f"pose_type of {command.command_type}: expected {EULER} or {QUATERNION}")
    _count("effort", command.effort, 3 if feels_forces else 0)
    forces: Any = None
    if feels_forces:
        forces = _values("effort", command.effort_type, command.effort, {"N": (inf,) * 3})
    move = MoveRequest(kind, target, thresholds=forces)
    return move._replace(
        **_speed(command, move, robot),
        **_acceleration(command, move, robot),
        blending=_blending(command, move, robot),
    )


def _target(command: Any, joint_count: int, apply_reference: bool) -> Sequence[float] | Frame:
    kind, pose = command.pose_type, command.pose
    _count("pose", pose, _one_of("pose_type", kind, {JOINTS: joint_count, EULER: 6, QUATERNION: 7}))
    if kind == JOINTS:
        return tuple(pose)
    x, y, z = (1e3 * each for each in pose[:3])
    target = Frame(x, y, z, *pose[3:]) if kind == EULER else from_quaternion((x, y, z), tuple(pose[3:]))
    frame = astuple(command.pose_reference_frame)
    if not all(map(isfinite, frame)):
        raise Refused(EXECUTION, "pose_reference_frame: expected finite numbers")
    if not apply_reference or not any(frame) or command.pose_reference in BASES:
        return target  # a frame of zeros is the base, whatever its name
    return Frame.from_transform(compose(transform_from_euler(*frame), target.to_transform()))


def _speed(command: Any, move: MoveRequest, robot: Controller) -> dict[str, Any]:
    """Return the fields of a `MoveRequest` for the velocity."""
    units = _units(move, robot)
    if on_joints := len(units["%"]) > 1:
        units["RAD/S"] = robot.description.velocity
    elif move.kind is Kind.LIN and isinstance(move.target, Frame):
        units["M/S"] = (inf,)
    values = _values("velocity", command.velocity_type, command.velocity, units, zero=on_joints)
    if command.velocity_type == "M/S":
        return {"tcp_speed_m_s": values[0]}
    return {"speeds": values} if on_joints else {"speed": values[0]}


def _acceleration(command: Any, move: MoveRequest, robot: Controller) -> dict[str, Any]:
    """Return the fields of a `MoveRequest` for the acceleration; none if the command has no values."""
    if not command.acceleration:
        return {}
    units = _units(move, robot)
    units["RAD/S^2"] = (inf,) * len(units["%"])
    if move.kind is Kind.LIN:
        units["M/S^2"] = (inf,)
    values = _values("acceleration", command.acceleration_type, command.acceleration, units)
    if command.acceleration_type == "M/S^2":
        return {"tcp_acceleration_m_s2": values[0]}
    if command.acceleration_type == "RAD/S^2":
        arm, direct = robot.description, move.kind is Kind.DIRECT
        limits = arm.direct_acceleration if direct else arm.acceleration
        each = zip(values * (len(limits) // len(values)), limits, strict=True)
        return {"accelerations": tuple(min(value / limit, 1.0) for value, limit in each)}
    return {"accelerations": values}


def _blending(command: Any, move: MoveRequest, robot: Controller) -> float:
    """Return the blending of a `MoveRequest`: mm, or for PTP to joints a part of the largest distance."""
    word, target = command.blending_type, move.target
    if not any(command.blending):
        return 0.0
    if move.kind.is_servo:
        raise Refused(EXECUTION, f"blending of {move.kind.value}: expected 0, such moves do not blend")
    on_joints = move.kind is Kind.PTP and not isinstance(target, Frame)
    units = {"RAD" if on_joints else "M": (inf,), "%": (1.0,), "PERCENT": (100.0,)}
    (value,) = _values("blending", word, command.blending, units)
    if word == "M":
        return 1e3 * value
    if word == "RAD":
        distance = max(abs(b - a) for a, b in zip(robot.end_of_queue, target, strict=True))
        return 1.0 if value >= distance else value / distance
    if on_joints:
        return value
    there = target if isinstance(target, Frame) else robot.tool_frame(tuple(target))
    return value * dist(robot.tool_frame(robot.end_of_queue)[:3], there[:3])


def _units(move: MoveRequest, robot: Controller) -> dict[str, Sequence[float]]:
    """Return the units of shares, each with the whole of each joint, or of the TCP alone."""
    on_tcp = isinstance(move.target, Frame) or move.kind is Kind.LIN
    count = 1 if on_tcp else len(robot.description.joints)
    return {"%": (1.0,) * count, "PERCENT": (100.0,) * count}


def _values(
    name: str, word: str, values: Sequence[float], units: Mapping[str, Sequence[float]], *, zero: bool = False
) -> tuple[float, ...]:
    """Return values as shares of the largest ones in their unit; as they are if these are infinite."""
    _count(name, values, 1, *(len(most) for most in units.values()))
    most = _one_of(f"{name}_type", word, units)
    found = tuple(values) * (len(most) // len(values))
    for value, limit in zip(found, most, strict=True):
        if not (0.0 < value <= limit or (zero and value == 0.0)):
            least = "0 or more" if zero else "above 0"
            most_words = "" if limit == inf else f", up to {limit:.7g}"
            raise Refused(EXECUTION, f"{name} {value:g} in {word}: expected {least}{most_words}")
    return tuple(v if limit == inf else v / limit for v, limit in zip(found, most, strict=True))


def _count(name: str, values: Sequence[float], *counts: int) -> None:
    if len(values) not in counts:
        expected = " or ".join(map(str, sorted({*counts})))
        raise Refused(EXECUTION, f"{name}: {len(values)} values, expected {expected}")


def _one_of(name: str, word: str, known: Mapping[str, _Found]) -> _Found:
    if word not in known:
        shown, expected = shortened(harmless(word), 40), ", ".join(known)
        raise Refused(EXECUTION, f"{name} '{shown}': expected one of {expected}")
    return known[word]

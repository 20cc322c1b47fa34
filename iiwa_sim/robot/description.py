"""The description of a robot: its folder with robot.toml and robot.urdf, read and checked."""

from __future__ import annotations

from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from math import radians, sqrt
from operator import attrgetter, ge, mul
from pathlib import Path
from typing import Annotated, Any

import msgspec

from iiwa_sim.frames import Frame, Transform
from iiwa_sim.settings import Name, Reader, SettingsFault, between, data_folder

DEFAULT_ROBOT = "lbr_iiwa_7_r800"
SETTINGS_FILE = "robot.toml"
URDF_FILE = "robot.urdf"

LONGEST_STOP_S = 0.1
"""Longest stop in s, as documented for the original controller."""

_Position = Annotated[float, between(-720.0, 720.0, " deg")]
_Velocity = Annotated[float, between(0.01, 10_000.0, " deg/s")]
_Torque = Annotated[float, between(0.01, 100_000.0, " Nm")]
_Acceleration = Annotated[float, between(0.1, 1_000.0, " 1/s")]
_Jerk = Annotated[float, between(0.1, 10_000.0, " 1/s")]
Length = Annotated[float, between(-10_000.0, 10_000.0, " mm")]
Angle = Annotated[float, between(-10.0, 10.0, " rad")]
_Radius = Annotated[float, between(0.1, 10_000.0, " mm")]
CapsuleMm = tuple[Length, Length, Length, Length, Length, Length, _Radius]
"""The ends of a capsule and its radius."""


class RobotFault(SettingsFault):
    """A robot cannot be used as its folder describes it.

    The message is one line that names the file, the key, its value and what was expected.
    """


class ToolSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    x_mm: Length
    y_mm: Length
    z_mm: Length
    alpha: Angle
    beta: Angle
    gamma: Angle

    def to_transform(self) -> Transform:
        return Frame(*msgspec.structs.astuple(self)).to_transform()


class _LimitSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    position_min_deg: list[_Position]
    position_max_deg: list[_Position]
    velocity_deg_per_s: list[_Velocity]
    torque_nm: list[_Torque]
    acceleration_per_velocity_per_s: _Acceleration | list[_Acceleration]
    jerk_per_acceleration_per_s: _Jerk


class _DirectSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    acceleration_per_velocity_per_s: _Acceleration | list[_Acceleration]
    jerk_per_acceleration_per_s: _Jerk


class _StopSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    rate_per_s: Annotated[float, between(1.0, 1_000.0, " 1/s")]
    rate_change_per_s2: Annotated[float, between(1.0, 1_000_000.0, " 1/s^2")]

    def duration_s(self) -> float:
        """Time (s) in which the rate falls from 1 to 0."""
        ramp_s = self.rate_per_s / self.rate_change_per_s2
        if self.rate_per_s * ramp_s > 1.0:  # the slope reverses before it reaches its limit
            return 2.0 / sqrt(self.rate_change_per_s2)
        return 1.0 / self.rate_per_s + ramp_s


class _Settings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    name: Name
    kinematics: str
    joints: list[str]
    flange: str
    home_deg: list[_Position]
    tool_in_flange: ToolSettings
    limits: _LimitSettings
    direct: _DirectSettings
    stop: _StopSettings
    capsules_mm: dict[str, Any] = {}  # lists of `CapsuleMm`


@dataclass(frozen=True)
class RobotDescription:
    """A robot as its robot.toml describes it. One value per joint, base first; rad, m, s, Nm."""

    name: str
    kinematics: str
    """Kind of the inverse kinematics, see `iiwa_sim.robot.inverse`."""
    joints: tuple[str, ...]
    """Names of the joints in the URDF."""
    flange: str
    """Link of the URDF that is the flange."""
    tool_in_flange: Transform
    """Pose of the TCP in the flange until a client sets another tool."""
    home: tuple[float, ...]
    position_min: tuple[float, ...]
    position_max: tuple[float, ...]
    velocity: tuple[float, ...]
    torque: tuple[float, ...]
    acceleration: tuple[float, ...]
    """Limit of planned motion."""
    jerk: tuple[float, ...]
    """Limit of planned motion."""
    direct_acceleration: tuple[float, ...]
    """Limit in direct mode."""
    direct_jerk: tuple[float, ...]
    """Limit in direct mode."""
    stop_rate_per_s: float
    """Largest slope of the rate of planned time, which falls from 1 to 0 in a stop."""
    stop_rate_change_per_s2: float
    """Largest change of that slope."""
    settings_path: str
    """Path of the robot.toml, for messages."""
    urdf_path: str
    """Path of the URDF, for messages."""
    urdf: str
    """Text of the URDF."""
    capsules_mm: tuple[tuple[str, tuple[float, ...]], ...] = ()
    """Links by name, and the ends and radius of a capsule in the frame of the link."""

    @property
    def stop_acceleration(self) -> tuple[float, ...]:
        """Acceleration limit (rad/s^2) in a stop.

        On the path q(t) at the rate r of its time, q'' = r^2 a + r' v, with r <= 1.
        """
        return tuple(
            a + self.stop_rate_per_s * v for a, v in zip(self.acceleration, self.velocity, strict=True)
        )

    @property
    def stop_jerk(self) -> tuple[float, ...]:
        """Jerk limit (rad/s^3) in a stop: q''' = r^3 j + 3 r r' a + r'' v, with r <= 1."""
        return tuple(
            j + 3.0 * self.stop_rate_per_s * a + self.stop_rate_change_per_s2 * v
            for j, a, v in zip(self.jerk, self.acceleration, self.velocity, strict=True)
        )


def load_robot(name_or_folder: str | Path = DEFAULT_ROBOT) -> RobotDescription:
    """Return the built-in robot of that name, or else the robot in that folder.

    A built-in robot is read once in a process. Raises `RobotFault` if the folder is missing or does not
    describe a robot. The URDF is checked when the `Model` is built, and whether its geometry suits the
    kinematics when the inverse is.
    """
    name = str(name_or_folder)
    return _built_in(name) if name in built_in_robots() else _read(_folder(name_or_folder))


@cache
def _built_in(name: str) -> RobotDescription:
    return _read(data_folder("iiwa_sim.robots") / name)


def _read(folder: Path) -> RobotDescription:
    settings_path, urdf_path = str(folder / SETTINGS_FILE), str(folder / URDF_FILE)
    reader = Reader(settings_path, RobotFault)
    settings = reader.settings(_Settings)
    _check_values(reader, settings)
    limits, direct = settings.limits, settings.direct
    velocity = _radians(limits.velocity_deg_per_s)
    acceleration = _accelerations(limits.acceleration_per_velocity_per_s, velocity)
    jerk = tuple(limits.jerk_per_acceleration_per_s * a for a in acceleration)
    direct_acceleration = _accelerations(direct.acceleration_per_velocity_per_s, velocity)
    direct_jerk = tuple(direct.jerk_per_acceleration_per_s * a for a in direct_acceleration)
    for key, stiff, planned in (
        ("acceleration_per_velocity_per_s", direct_acceleration, acceleration),
        ("jerk_per_acceleration_per_s", direct_jerk, jerk),
    ):
        holds = all(map(ge, stiff, planned))
        expected = "limits in direct mode that are no lower than those of [limits]"
        reader.check(f"direct.{key}", getattr(direct, key), holds, expected)
    return RobotDescription(
        name=settings.name,
        kinematics=settings.kinematics,
        joints=tuple(settings.joints),
        flange=settings.flange,
        tool_in_flange=settings.tool_in_flange.to_transform(),
        home=_radians(settings.home_deg),
        position_min=_radians(limits.position_min_deg),
        position_max=_radians(limits.position_max_deg),
        velocity=velocity,
        torque=tuple(limits.torque_nm),
        acceleration=acceleration,
        jerk=jerk,
        direct_acceleration=direct_acceleration,
        direct_jerk=direct_jerk,
        stop_rate_per_s=settings.stop.rate_per_s,
        stop_rate_change_per_s2=settings.stop.rate_change_per_s2,
        settings_path=settings_path,
        urdf_path=urdf_path,
        urdf=Reader(urdf_path, RobotFault).text(),
        capsules_mm=tuple(
            (link, each)
            for link, found in settings.capsules_mm.items()
            for each in reader.under(f"capsules_mm.{link}").converted(found, list[CapsuleMm])
        ),
    )


def _radians(degrees: list[float]) -> tuple[float, ...]:
    return tuple(map(radians, degrees))


def _accelerations(ratio: float | list[float], velocity: tuple[float, ...]) -> tuple[float, ...]:
    """Return accelerations (rad/s^2) by their ratio to velocities (1/s), one or one for each joint."""
    ratios = ratio if isinstance(ratio, list) else [ratio] * len(velocity)
    return tuple(map(mul, ratios, velocity))


def _check_values(reader: Reader, settings: _Settings) -> None:
    check = reader.check
    limits, stop = settings.limits, settings.stop
    names = settings.joints
    check("joints", names, len(names) > 0, "at least one joint")
    check("joints", names, len(set(names)) == len(names), "each joint once")
    for key in (
        "home_deg",
        *(f"limits.{field}" for field in limits.__struct_fields__),
        "direct.acceleration_per_velocity_per_s",
    ):
        values = attrgetter(key)(settings)
        if isinstance(values, list):
            check(key, values, len(values) == len(names), f"{len(names)} values, one per joint")
    for axis, (low, home, high) in enumerate(
        zip(limits.position_min_deg, settings.home_deg, limits.position_max_deg, strict=True)
    ):
        range_deg = f"{low:g} to {high:g} deg"
        check(f"limits.position_min_deg[{axis}]", low, low < high, f"less than position_max_deg, {high:g}")
        check(
            f"home_deg[{axis}]", home, low <= home <= high, f"a position within {names[axis]}'s {range_deg}"
        )
    longest_ms = 1e3 * LONGEST_STOP_S
    duration_s = stop.duration_s()
    check(
        "stop.rate_per_s",
        stop.rate_per_s,
        duration_s <= LONGEST_STOP_S,
        f"a stop within {longest_ms:g} ms; with rate_change_per_s2 = {stop.rate_change_per_s2:g} "
        f"it takes {1e3 * duration_s:.1f} ms",
    )


@cache
def built_in_robots() -> tuple[str, ...]:
    """Return the names of the built-in robots."""
    folders = data_folder("iiwa_sim.robots").iterdir()
    return tuple(sorted(folder.name for folder in folders if (folder / SETTINGS_FILE).is_file()))


def _folder(name_or_folder: str | Path) -> Path:
    folder = Path(name_or_folder)
    why = ""
    try:
        if str(name_or_folder) and folder.is_dir():
            return folder
    except OSError as fault:  # a name that is too long, or a parent folder without permission
        why = f" ({fault.strerror})"
    if near := get_close_matches(folder.name, built_in_robots(), 1):
        why += f", did you mean {near[0]!r}?"
    given = str(name_or_folder) or "''"
    raise RobotFault(f"robot {given}", "", "", f"a folder, or one of {', '.join(built_in_robots())}{why}")

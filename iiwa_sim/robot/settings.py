"""robot.toml: its keys and their ranges."""

from __future__ import annotations

from math import radians, sqrt
from operator import attrgetter, truediv

import msgspec

from iiwa_sim.frames import Frame, Transform
from iiwa_sim.robot.fault import RobotFault
from iiwa_sim.settings import Reader

LONGEST_STOP_S = 0.1
"""Longest stop in s, as documented for the original controller."""

_POSITION, _VELOCITY, _TORQUE = (-720.0, 720.0, " deg"), (0.01, 10_000.0, " deg/s"), (0.01, 100_000.0, " Nm")
_ACCELERATION, _JERK = (0.1, 1_000.0, " 1/s"), (0.1, 10_000.0, " 1/s")
LENGTH, ANGLE = (-10_000.0, 10_000.0, " mm"), (-10.0, 10.0, " rad")
_RANGES = {
    "home_deg": _POSITION,
    "limits.position_min_deg": _POSITION,
    "limits.position_max_deg": _POSITION,
    "limits.velocity_deg_per_s": _VELOCITY,
    "limits.torque_nm": _TORQUE,
    "limits.acceleration_per_velocity_per_s": _ACCELERATION,
    "limits.jerk_per_acceleration_per_s": _JERK,
    "direct.acceleration_per_velocity_per_s": _ACCELERATION,
    "direct.jerk_per_acceleration_per_s": _JERK,
    "tool_in_flange.x_mm": LENGTH,
    "tool_in_flange.y_mm": LENGTH,
    "tool_in_flange.z_mm": LENGTH,
    "tool_in_flange.alpha": ANGLE,
    "tool_in_flange.beta": ANGLE,
    "tool_in_flange.gamma": ANGLE,
    "stop.rate_per_s": (1.0, 1_000.0, " 1/s"),
    "stop.rate_change_per_s2": (1.0, 1_000_000.0, " 1/s^2"),
}
"""Least and greatest value and the unit, with a wide margin for any arm: values beyond are mistakes."""


class ToolSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    x_mm: float
    y_mm: float
    z_mm: float
    alpha: float
    beta: float
    gamma: float

    def to_transform(self) -> Transform:
        return Frame(self.x_mm, self.y_mm, self.z_mm, self.alpha, self.beta, self.gamma).to_transform()


def _each(value: float | list[float], joints: int) -> tuple[float, ...]:
    return tuple(value) if isinstance(value, list) else (value,) * joints


class LimitSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    position_min_deg: list[float]
    position_max_deg: list[float]
    velocity_deg_per_s: list[float]
    torque_nm: list[float]
    acceleration_per_velocity_per_s: float | list[float]
    jerk_per_acceleration_per_s: float

    def position_min(self) -> tuple[float, ...]:
        return tuple(map(radians, self.position_min_deg))

    def position_max(self) -> tuple[float, ...]:
        return tuple(map(radians, self.position_max_deg))

    def velocity(self) -> tuple[float, ...]:
        return tuple(map(radians, self.velocity_deg_per_s))

    def acceleration_ratios(self) -> tuple[float, ...]:
        """Acceleration over velocity of each joint (1/s)."""
        return _each(self.acceleration_per_velocity_per_s, len(self.velocity_deg_per_s))


class DirectSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    acceleration_per_velocity_per_s: float | list[float]
    jerk_per_acceleration_per_s: float

    def acceleration_ratios(self, joints: int) -> tuple[float, ...]:
        """Acceleration over velocity of each joint (1/s)."""
        return _each(self.acceleration_per_velocity_per_s, joints)


class StopSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    rate_per_s: float
    rate_change_per_s2: float

    def duration_s(self) -> float:
        """Time (s) in which the rate falls from 1 to 0."""
        ramp_s = self.rate_per_s / self.rate_change_per_s2
        if self.rate_per_s * ramp_s > 1.0:  # the slope reverses before it reaches its limit
            return 2.0 / sqrt(self.rate_change_per_s2)
        return 1.0 / self.rate_per_s + ramp_s


class Settings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    name: str
    kinematics: str
    joints: list[str]
    flange: str
    home_deg: list[float]
    tool_in_flange: ToolSettings
    limits: LimitSettings
    direct: DirectSettings
    stop: StopSettings

    def home(self) -> tuple[float, ...]:
        return tuple(map(radians, self.home_deg))


def read_settings(path: str, text: str) -> Settings:
    """The settings in the text of a robot.toml; raises `RobotFault`."""
    reader = Reader(path, RobotFault)
    settings = reader.settings(text, Settings)
    _check_values(reader, settings)
    return settings


def _check_values(reader: Reader, settings: Settings) -> None:
    check = reader.check
    limits, direct, stop = settings.limits, settings.direct, settings.stop
    names = settings.joints
    reader.check_name("name", settings.name)
    check("joints", names, len(names) > 0, "at least one joint")
    check("joints", names, len(set(names)) == len(names), "each joint once")
    for key, allowed in _RANGES.items():
        values = attrgetter(key)(settings)
        if isinstance(values, float):
            reader.check_range(key, values, allowed)
            continue
        check(key, values, len(values) == len(names), f"{len(names)} values, one per joint")
        for axis, value in enumerate(values):
            reader.check_range(f"{key}[{axis}]", value, allowed)
    for axis, (low, home, high) in enumerate(
        zip(limits.position_min_deg, settings.home_deg, limits.position_max_deg, strict=True)
    ):
        range_deg = f"{low:g} to {high:g} deg"
        check(f"limits.position_min_deg[{axis}]", low, low < high, f"less than position_max_deg, {high:g}")
        check(
            f"home_deg[{axis}]", home, low <= home <= high, f"a position within {names[axis]}'s {range_deg}"
        )
    planned, stiff = limits.acceleration_ratios(), direct.acceleration_ratios(len(names))
    for axis, (ratio, gentlest) in enumerate(zip(stiff, planned, strict=True)):
        place = f"[{axis}]" if isinstance(direct.acceleration_per_velocity_per_s, list) else ""
        check(
            f"direct.acceleration_per_velocity_per_s{place}",
            ratio,
            ratio >= gentlest,
            f"at least that of limits, {gentlest:g} 1/s",
        )
    gentlest = limits.jerk_per_acceleration_per_s * max(map(truediv, planned, stiff))
    check(
        "direct.jerk_per_acceleration_per_s",
        direct.jerk_per_acceleration_per_s,
        direct.jerk_per_acceleration_per_s >= gentlest,
        f"at least {gentlest:g} 1/s, for a jerk of at least that of limits",
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

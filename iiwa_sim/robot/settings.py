"""robot.toml: its keys, and what may stand there."""

from __future__ import annotations

import tomllib
from math import isfinite, radians, sqrt
from typing import Any

import msgspec

from iiwa_sim.frames import Frame, Transform
from iiwa_sim.robot.fault import RobotFault

LONGEST_STOP_S = 0.1
"""A stop takes at most this: what the original controller is documented to do."""


class ToolSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    x_mm: float
    y_mm: float
    z_mm: float
    alpha: float
    beta: float
    gamma: float

    def to_transform(self) -> Transform:
        return Frame(self.x_mm, self.y_mm, self.z_mm, self.alpha, self.beta, self.gamma).to_transform()


class LimitSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    position_min_deg: list[float]
    position_max_deg: list[float]
    velocity_deg_per_s: list[float]
    torque_nm: list[float]
    acceleration_per_velocity_per_s: float
    jerk_per_acceleration_per_s: float

    def position_min(self) -> tuple[float, ...]:
        return tuple(map(radians, self.position_min_deg))

    def position_max(self) -> tuple[float, ...]:
        return tuple(map(radians, self.position_max_deg))

    def velocity(self) -> tuple[float, ...]:
        return tuple(map(radians, self.velocity_deg_per_s))


class StopSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    rate_per_s: float
    rate_change_per_s2: float

    def duration_s(self) -> float:
        """Time the rate takes from 1 to 0 with this slope and this change of slope."""
        ramp_s = self.rate_per_s / self.rate_change_per_s2
        if self.rate_per_s * ramp_s > 1.0:  # turns before the full slope is reached
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
    stop: StopSettings

    def home(self) -> tuple[float, ...]:
        return tuple(map(radians, self.home_deg))


def read_settings(path: str, text: str) -> Settings:
    """The settings in the text of a robot.toml; raises `RobotFault`."""
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as fault:
        raise RobotFault(path, "", "", f"valid TOML ({fault})") from None
    try:
        settings = msgspec.convert(table, Settings)
    except msgspec.ValidationError as fault:
        raise _type_fault(path, table, str(fault)) from None
    _check_values(path, settings)
    return settings


def _type_fault(path: str, table: dict[str, Any], message: str) -> RobotFault:
    """The fault that msgspec found, with the value it is about: it says `what it wants - at $.key[1]`."""
    expected, _, place = message.partition(" - at ")
    key = place.strip("`").removeprefix("$").removeprefix(".")
    if "unknown field" in expected or "missing required field" in expected:
        field = expected.split("`")[1]
        key = f"{key}.{field}" if key else field
        fault = "no key of this name" if "unknown" in expected else "this key"
        return RobotFault(path, key, _value(table, key), fault)
    expected = expected.removeprefix("Expected ").replace("`", "").replace(", got", ", not")
    return RobotFault(path, key, _value(table, key), expected)


def _value(table: dict[str, Any], key: str) -> str:
    value: Any = table
    for part in key.replace("[", ".[").split("."):
        if part.startswith("["):
            value = value[int(part[1:-1])]
        elif isinstance(value, dict) and part in value:
            value = value[part]
        else:
            return "(missing)"
    return repr(value)


def _check_values(path: str, settings: Settings) -> None:
    def check(key: str, value: object, holds: bool, expected: str) -> None:
        if not holds:
            raise RobotFault(path, key, value, expected)

    limits, stop, tool = settings.limits, settings.stop, settings.tool_in_flange
    names = settings.joints
    check("name", repr(settings.name), settings.name.strip() != "", "a name")
    check("joints", names, len(names) > 0, "at least one joint")
    check("joints", names, len(set(names)) == len(names), "each joint once")
    for key, values in (
        ("home_deg", settings.home_deg),
        ("limits.position_min_deg", limits.position_min_deg),
        ("limits.position_max_deg", limits.position_max_deg),
        ("limits.velocity_deg_per_s", limits.velocity_deg_per_s),
        ("limits.torque_nm", limits.torque_nm),
    ):
        check(key, values, len(values) == len(names), f"{len(names)} values, one per joint")
        check(key, values, all(map(isfinite, values)), "finite numbers")
    for key, values in (
        ("limits.velocity_deg_per_s", limits.velocity_deg_per_s),
        ("limits.torque_nm", limits.torque_nm),
        ("limits.acceleration_per_velocity_per_s", [limits.acceleration_per_velocity_per_s]),
        ("limits.jerk_per_acceleration_per_s", [limits.jerk_per_acceleration_per_s]),
        ("stop.rate_per_s", [stop.rate_per_s]),
        ("stop.rate_change_per_s2", [stop.rate_change_per_s2]),
    ):
        shown = values if key.endswith(("deg_per_s", "nm")) else values[0]
        check(key, shown, all(isfinite(value) and value > 0.0 for value in values), "more than 0, and finite")
    for axis, (low, home, high) in enumerate(
        zip(limits.position_min_deg, settings.home_deg, limits.position_max_deg, strict=True)
    ):
        range_deg = f"{low:g} to {high:g} deg"
        check(f"limits.position_min_deg[{axis}]", low, low < high, f"less than position_max_deg, {high:g}")
        check(
            f"home_deg[{axis}]", home, low <= home <= high, f"a position within {names[axis]}'s {range_deg}"
        )
    for field in tool.__struct_fields__:
        value = getattr(tool, field)
        check(f"tool_in_flange.{field}", value, isfinite(value), "a finite number")
    longest_ms = 1e3 * LONGEST_STOP_S
    duration_s = stop.duration_s()
    check(
        "stop.rate_per_s",
        stop.rate_per_s,
        duration_s <= LONGEST_STOP_S,
        f"a stop within {longest_ms:g} ms; with rate_change_per_s2 = {stop.rate_change_per_s2:g} "
        f"it takes {1e3 * duration_s:.1f} ms",
    )

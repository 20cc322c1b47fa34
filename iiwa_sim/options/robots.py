"""Robots of a process: the settings of each robot of a fleet."""

import re
import tomllib
from pathlib import Path
from typing import Any

import msgspec

from iiwa_sim.options import model
from iiwa_sim.options.model import SettingError, Settings
from iiwa_sim.options.sources import COMMAND_LINE, OPTIONS, Given, Place, from_names, merged, read
from iiwa_sim.protocols.ports import DEFAULT_PROTOCOL

Robots = dict[str, Settings]
"""Settings by the name of each robot of a process; a single robot has an empty name."""


def robots_of(given: Given) -> Robots:
    """Return name and settings of each robot of the process. Raises SettingError."""
    if "fleet" in given and "count" not in given:
        fleet = Path(given["fleet"])
        robots = _named(fleet, {key: value for key, value in given.items() if key != "fleet"})
        before = f"{fleet}: "
    else:
        common, before = Settings(**given), ""
        names = [""] if common.count is None else [f"robot-{number}" for number in range(common.count)]
        robots = {name: _numbered(common, number, name) for number, name in enumerate(names)}
    if len(robots) > 1 and given.get("ros"):
        raise SettingError("--ros: expected one robot: a process is one node of ROS 1")
    spaces = [robot.ros_namespace.strip("/") for robot in robots.values() if robot.ros2]
    if len(set(spaces)) < len(spaces):
        raise SettingError(f"{before}--ros-namespace: expected a different one for each robot on ROS 2")
    written = [file for robot in robots.values() for key in model.WRITTEN if (file := getattr(robot, key))]
    for file in written:
        if written.count(file) > 1 and not Path(file).is_char_device():
            raise SettingError(f"{before}{file}: expected a file of its own for each robot and option")
    return robots


def robots_in(settings: Settings) -> dict[str, dict[str, int]]:
    """Return the names of the robots in a cell with `[[robot]]`, each with the ports of its protocols.

    A file that cannot be used has none: whoever loads the cell says why.
    """
    try:
        file = tomllib.loads(Path(settings.cell or settings.robot or "").read_text(encoding="utf-8-sig"))
        found = {}
        for each in file["robot"]:
            spoken, ports = each.get("protocol", DEFAULT_PROTOCOL), each.get("port", 0)
            spoken = spoken if isinstance(spoken, list) else [spoken]
            ports = ports if isinstance(ports, list) else [ports] * len(spoken)
            found[each["name"]] = dict(zip(spoken, ports, strict=True))
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}
    return found


def _named(path: Path, common: Given) -> Robots:
    try:
        file = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError) as fault:
        raise SettingError(f"{path}: expected a readable TOML file ({fault})") from None
    for key in file.keys() - {"robot"}:
        raise SettingError(f"{path}: {key}: expected only tables [robot.NAME]")
    tables = file.get("robot")
    if not isinstance(tables, dict) or not tables:
        raise SettingError(f"{path}: expected at least one robot, as [robot.NAME]")
    robots: Robots = {}
    for index, (name, table) in enumerate(tables.items()):
        before = f"{path}: robot.{name}"
        if not re.fullmatch(r"[A-Za-z0-9_.-]{1,100}", name) or not isinstance(table, dict):
            raise SettingError(f"{before}: expected a table and a name of letters, digits, - _ .")
        own = from_names(table, Place("key", " = ", f"{before}."), path.parent)
        try:
            robots[name] = _numbered(Settings(**merged(common, own)), index, name, own)
        except SettingError as fault:
            raise SettingError(f"{before}: {fault}") from None
    return robots


def _numbered(robot: Settings, index: int, name: str, own: Given | None = None) -> Settings:
    """Return settings with ports and files of this robot, except for its `own` options."""
    own = own or {}
    changed: dict[str, Any] = {}
    for key in model.PORTS:
        if key not in own and (port := getattr(robot, key)):
            changed[key] = port + index
    if "port" not in own and not robots_in(robot):
        changed["port"] = tuple(port and port + index for port in robot.ports.values())
    changed = {key: read(OPTIONS[key], value, COMMAND_LINE) for key, value in changed.items()}
    if robot.view_port is not None:  # the page is a client of the backdoor
        changed.setdefault("backdoor_port", robot.backdoor_port or 0)
    for key in model.WRITTEN:
        if name and key not in own and (file := getattr(robot, key)):
            changed[key] = str(Path(file).with_stem(f"{Path(file).stem}-{name}"))
    return msgspec.structs.replace(robot, **changed)

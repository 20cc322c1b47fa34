"""Robots of a process: the settings of each robot of a fleet."""

import tomllib
from pathlib import Path
from typing import Annotated, Any

import msgspec

from iiwa_sim.options import model
from iiwa_sim.options.model import SettingError, Settings
from iiwa_sim.options.sources import COMMAND_LINE, OPTIONS, Given, Place, from_names, merged, read
from iiwa_sim.protocols.ports import DEFAULT_PROTOCOL
from iiwa_sim.settings import Reader, SettingsFault, expecting

Robots = dict[str, Settings]
"""Settings by the name of each robot of a process; a single robot has an empty name."""


class _Fleet(msgspec.Struct, forbid_unknown_fields=True):
    robot: Annotated[dict[str, dict[str, Any]], expecting("at least one, as [robot.NAME]", min_length=1)]


def robots_of(given: Given) -> Robots:
    """Return name and settings of each robot of the process. Raises SettingError and SettingsFault."""
    fleet = Path(given["fleet"]) if "fleet" in given and "count" not in given else None
    if fleet is not None:
        reader = Reader(str(fleet), SettingsFault)
        tables = reader.settings(reader.text(fleet, "a fleet file"), _Fleet).robot
        given = {key: given[key] for key in given if key != "fleet"}
    else:
        count = Settings(**given).count
        tables = {"": {}} if count is None else {f"robot-{number}": {} for number in range(count)}
    robots: Robots = {}
    for index, (name, table) in enumerate(tables.items()):
        place = f"{fleet}: robot.{name}"
        own = from_names(table, Place("key", " = ", f"{place}."), fleet and fleet.parent)
        try:
            robots[name] = _numbered(Settings(**merged(given, own)), index, name, own)
        except SettingError as fault:
            raise SettingError(f"{place}: {fault}" if fleet else str(fault)) from None
    if len(robots) > 1 and any(robot.ros for robot in robots.values()):
        raise SettingError("--ros: expected one robot: a process is one node of ROS 1")
    spaces = [robot.ros_namespace.strip("/") for robot in robots.values() if robot.ros2]
    if len(set(spaces)) < len(spaces):
        raise SettingError("--ros-namespace: expected a different one for each robot on ROS 2")
    files = [file for robot in robots.values() for key in model.WRITTEN if (file := getattr(robot, key))]
    if len(set(files)) < len(files):
        raise SettingError("--transcript, --record: expected a file of its own for each robot")
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


def _numbered(robot: Settings, index: int, name: str, own: Given) -> Settings:
    """Return settings with ports and files of this robot, except for its `own` options."""
    ports = {key: getattr(robot, key) for key in model.PORTS if key not in own}
    changed = {key: port + index for key, port in ports.items() if port}
    if "port" not in own and not robots_in(robot):
        changed["port"] = tuple(port and port + index for port in robot.ports.values())
    changed = {key: read(OPTIONS[key], value, COMMAND_LINE) for key, value in changed.items()}
    files = {key: getattr(robot, key) for key in model.WRITTEN if key not in own}
    changed |= {key: model.file_of(name, file) for key, file in files.items() if file}
    return msgspec.structs.replace(robot, **changed)

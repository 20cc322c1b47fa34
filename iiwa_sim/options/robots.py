"""Robots of a process: the rules between options, and the settings of each robot of a fleet."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from iiwa_sim.options import model
from iiwa_sim.options.model import Settings
from iiwa_sim.options.sources import (
    KEYWORDS,
    OPTIONS,
    Given,
    Place,
    SettingError,
    Value,
    from_names,
    merged,
)
from iiwa_sim.protocols.ports import DEFAULT_PORTS, DEFAULT_PROTOCOL, MAX_PORT
from iiwa_sim.server.token import is_loopback

Robots = list[tuple[str, Settings]]
"""Name and settings of each robot of a process; a single robot has an empty name."""


def settings_of(given: Given, defaults: Mapping[str, Any] | None = None) -> Settings:
    """Return the settings of one robot; checks the rules and picks the ports that are not given.

    Args:
        given: Options with their sources.
        defaults: Defaults that differ from those of the command line, by keyword.

    Raises:
        SettingError: If options do not fit together.
    """
    values = {OPTIONS[key].keyword: each.value for key, each in given.items()}
    found = Settings(**{**(defaults or {}), **values})
    _check(given, found)
    names = robots_in(found)
    for key in ("port", "protocol"):
        if names and key in given and given[key].value:
            raise _error(given, key, f"expected none: write {key} of {' and '.join(names)} in the cell")
    ports = found.port or tuple(DEFAULT_PORTS[name] for name in found.protocol)
    ports = () if names else ports * len(found.protocol) if ports == (0,) else ports
    found = msgspec.structs.replace(found, port=ports)
    if len(found.port) != len(found.protocol) and not names:
        raise _error(given, "port", f"expected {len(found.protocol)}, one for each protocol")
    if found.view_port is not None:  # the page is a client of both
        status = found.status_port or 0
        found = msgspec.structs.replace(found, status_port=status, backdoor_port=found.backdoor_port or 0)
    return found


def robots_in(settings: Settings) -> dict[str, dict[str, int]]:
    """Return the names of the robots in a cell with `[[robot]]`, each with the ports of its protocols.

    A file that cannot be used has none: whoever loads the cell says why.
    """
    import tomllib

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


def given_by(settings: Settings) -> Given:
    """Return those options of settings that differ from their defaults, checked. Raises SettingError."""
    values = {each.keyword: (each, getattr(settings, each.keyword)) for each in OPTIONS.values()}
    changed = {name: value for name, (each, value) in values.items() if value != each.default}
    process = {
        each.key: Value(changed.pop(name), KEYWORDS)
        for name, (each, _) in values.items()
        if each.key in model.PROCESS and name in changed
    }
    return from_names(changed, KEYWORDS) | process


def from_keywords(
    keywords: Mapping[str, Any], settings: Settings | None = None, folder: Path | None = None
) -> Settings:
    """Return settings from keyword arguments, which hold before `settings`. Raises SettingError.

    Ports are free ones if none is given.
    """
    given = merged(given_by(settings or Settings()), from_names(keywords, KEYWORDS, folder))
    found = settings_of(given, {"port": (0,)})
    _check_overlaps([("", found)])
    return found


def robots_of(given: Given) -> Robots:
    """Return name and settings of each robot of the process. Raises SettingError."""
    if "fleet" in given and "count" in given:
        raise _error(given, "fleet", f"expected no {given['fleet'].place.show(OPTIONS['count'])} with it")
    if "fleet" in given:
        robots = _named(Path(given["fleet"].value), {k: each for k, each in given.items() if k != "fleet"})
    elif "count" in given:
        common = settings_of(given)
        numbers = range(given["count"].value)
        robots = [(f"robot-{k}", _numbered(common, k, f"robot-{k}", set())) for k in numbers]
    else:
        robots = [("", settings_of(given))]
    if len(robots) > 1 and robots[0][1].ros:
        raise _error(given, "ros", "expected one robot: a process is one node of ROS 1")
    _check_overlaps(robots, f"{given['fleet'].value}: " if "fleet" in given else "")
    return robots


def _named(path: Path, given: Given) -> Robots:
    import tomllib

    try:
        file = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError) as fault:
        raise SettingError(f"{path}: expected a readable TOML file ({fault})") from None
    for key in file.keys() - {"robot"}:
        raise SettingError(f"{path}: {key}: expected only tables [robot.NAME]")
    tables = file.get("robot")
    if not isinstance(tables, dict) or not tables:
        raise SettingError(f"{path}: expected at least one robot, as [robot.NAME]")
    robots: Robots = []
    for index, (name, table) in enumerate(tables.items()):
        if not re.fullmatch(r"[A-Za-z0-9_.-]{1,100}", name) or not isinstance(table, dict):
            raise SettingError(f"{path}: robot.{name}: expected a table and a name of letters, digits, - _ .")
        own = from_names(table, Place("key", " = ", f"{path}: robot.{name}."), path.parent)
        both = merged(given, own)
        spoken = both["protocol"].value if "protocol" in both else Settings().protocol
        for key, protocol in model.NEEDS_PROTOCOL.items():  # given for the robots that speak it
            if key in given and key not in own and protocol not in spoken:
                del both[key]
        robots.append((name, _numbered(settings_of(both), index, name, set(own))))
    for key in model.NEEDS_PROTOCOL:
        if key in given and not any(getattr(robot, key) for _, robot in robots):
            raise _error(given, key, f"expected a robot with {model.NEEDS_PROTOCOL[key]} in its protocol")
    return robots


def _numbered(robot: Settings, index: int, name: str, own: set[str]) -> Settings:
    """Return settings with ports and files of this robot, except for its `own` options."""
    changed: dict[str, Any] = {}
    for key in (key for key in model.LISTENS_AT if key not in own and key not in model.PROCESS):
        ports = getattr(robot, key)
        moved = [port and port + index for port in (ports if key == "port" else [ports])]
        if max((port or 0 for port in moved), default=0) > MAX_PORT:
            raise SettingError(
                f"{OPTIONS[key].flag}: robot {index} has port {max(moved)}, expected up to {MAX_PORT}"
            )
        changed[key] = tuple(moved) if key == "port" else moved[0]
    for key in (key for key in model.WRITTEN if key not in own and getattr(robot, key)):
        path = Path(getattr(robot, key))
        changed[key] = str(path.with_stem(f"{path.stem}-{name}"))
    return msgspec.structs.replace(robot, **changed)


def _check(given: Given, found: Settings) -> None:
    values = {key: each.value for key, each in given.items()}
    values = {key: v for key, v in values.items() if v is not None and v is not False and v not in ((), "")}
    if len(set(found.protocol)) < max(len(found.protocol), 1):
        raise _error(given, "protocol", "expected one or more, each once")
    for key, value in values.items():

        def named(other: str, spelling: str = given[key].place.spelling) -> str:
            return str(getattr(OPTIONS[other], spelling))

        needed = model.NEEDS.get(key, (key,))
        if not values.keys() & set(needed):
            raise _error(given, key, f"expected {' or '.join(map(named, needed))} with it")
        if model.EXCLUDES.get(key) in values:
            raise _error(given, key, f"expected no {named(model.EXCLUDES[key])} with it")
        limit = model.AT_MOST.get(key)
        if limit and value > (most := getattr(found, OPTIONS[limit].keyword)):
            raise _error(given, key, f"expected at most {most} Hz, the {named(limit)}")
        if model.NEEDS_PROTOCOL.get(key, found.protocol[0]) not in found.protocol:
            raise _error(given, key, f"expected {model.NEEDS_PROTOCOL[key]} in {named('protocol')}")
        tokens = model.NEEDS_TOKEN.get(key)
        if tokens and not values.keys() & set(tokens) and not is_loopback(value):
            raise _error(given, key, f"expected {' or '.join(map(named, tokens))} with it")


def _check_overlaps(robots: Robots, before: str = "") -> None:
    """Check what no system call would refuse: files and names on ROS 2 that two robots share."""
    spaces = [robot.ros_namespace.strip("/") for _, robot in robots if robot.ros2]
    if len(set(spaces)) < len(spaces):
        raise SettingError(f"{before}--ros-namespace: expected a different one for each robot on ROS 2")
    written = [Path(file) for _, robot in robots for key in model.WRITTEN if (file := getattr(robot, key))]
    files = [path.resolve() for path in written if not path.is_char_device()]
    for path in files:
        if files.count(path) > 1:
            raise SettingError(f"{before}{path}: expected a file of its own for each robot and option")


def _error(given: Given, key: str, expected: str) -> SettingError:
    value, place = given[key]
    shown = list(value) if isinstance(value, tuple) else None if value is True else value
    return SettingError(f"{place.show(OPTIONS[key], shown)}: {expected}")

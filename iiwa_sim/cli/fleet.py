"""Several robots in one process: equal ones, `--count N`, or those that a fleet.toml names.

Robot number k, from 0, has each port of the options plus k; 0 stays 0. In a file a robot is a table with
options of its own, by their names with `_` for `-`:

    [robot.welder]
    cell = "welder.toml"  # files are looked for from the folder of this one
    clock = "10x"

    [robot.painter]
    robot = "kr_6_r900_sixx"
    dialect = "krc4"
    port = 54700  # as it stands here
"""

import argparse
import copy
import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import msgspec

from iiwa_sim.cli.consistency import check, check_dialect
from iiwa_sim.cli.environment import value_of
from iiwa_sim.cli.parsing import Error, Parser
from iiwa_sim.dialect.ports import MAX_PORT
from iiwa_sim.robot.description import built_in_robots
from iiwa_sim.settings import LONGEST_NAME, Reader, SettingsFault
from iiwa_sim.wording import Unusable, shortened

PORTS = ("port", "status_port", "rosbridge_port", "backdoor_port", "backdoor_http_port")
OF_THE_PROCESS = (
    *("help", "version", "count", "fleet", "log_level", "log_json", "ros", "bye_shuts_down"),
    *("view_port", "view_host", "view_token", "view_token_file"),
)
"""Options of the process, which one robot of a fleet cannot have."""
WRITTEN = ("transcript", "record")
FILES = ("cell", "robot", *WRITTEN, "rosbridge_secret", "backdoor_token_file")
_NAME = re.compile(rf"[A-Za-z0-9_.-]{{1,{LONGEST_NAME}}}")
_EVERYWHERE = ("0.0.0.0", "::")


class FleetFault(SettingsFault):
    """A fleet.toml cannot be used."""


class Robot(NamedTuple):
    """One of the robots that a process simulates, with its options."""

    name: str
    """The name of the robot in log and announcements; empty for a single robot without one."""
    options: argparse.Namespace


class _Fleet(msgspec.Struct, forbid_unknown_fields=True):
    robot: dict[str, dict[str, Any]]


def robots_of(parser: Parser, options: argparse.Namespace) -> list[Robot]:
    """The robots that checked options ask for.

    Raises FleetFault for a file that cannot be used; wrong options end the program.
    """
    if options.fleet is not None:
        robots, error = _named(parser, options), _failing(f"{options.fleet}: ")
        check_dialect(error, options, {dialect for robot in robots for dialect in robot.options.dialect})
    elif options.count is not None:
        robots, error = _equal(parser.error, options), parser.error
    else:
        return [Robot("", options)]
    if options.ros:
        error("argument --ros: expected one robot: a process is one node of ROS 1")
    namespaces = [robot.options.ros_namespace.strip("/") for robot in robots if robot.options.ros2]
    if len(set(namespaces)) < len(namespaces):
        error("argument --ros-namespace: expected one of its own for each robot on ROS 2")
    _check_ports(error, robots)
    _check_files(error, robots)
    return robots


def descriptors_of(robots: list[Robot]) -> int:
    """Descriptors needed by the robots: one for each port, each file that is written, and each clock."""
    return sum(
        1
        + sum(1 for _ in _ports(robot.options))
        + sum(getattr(robot.options, kind) is not None for kind in WRITTEN)
        for robot in robots
    )


def _equal(error: Error, options: argparse.Namespace) -> list[Robot]:
    robots = []
    for index in range(options.count):
        own = copy.copy(options)
        _move_ports(error, own, index, set())
        robots.append(Robot(f"robot-{index}", own))
        _name_files(own, f"robot-{index}", set())
    return robots


def _name_files(options: argparse.Namespace, name: str, named: set[str]) -> None:
    """Give the robot files of its own, where it does not name them itself."""
    for kind in WRITTEN:
        path = getattr(options, kind)
        if path is not None and kind not in named:
            setattr(options, kind, path.with_stem(f"{path.stem}-{name}"))


def _named(parser: Parser, options: argparse.Namespace) -> list[Robot]:
    path = Path(options.fleet)
    reader = Reader(str(path), FleetFault)
    tables = reader.settings(reader.text(path, "an existing file"), _Fleet).robot
    reader.check("robot", {}, bool(tables), "at least one robot, as [robot.NAME]")
    actions = {each.dest: each for each in parser.options if each.dest not in OF_THE_PROCESS}
    robots = []
    for index, (name, table) in enumerate(tables.items()):
        key = f"robot.{name}"
        reader.check(key, name, bool(_NAME.fullmatch(name)), "a name of letters, digits, '-', '_' and '.'")
        own = copy.copy(options)
        if "cell" in table or "robot" in table:
            own.cell = own.robot = None
        for option, value in table.items():
            reader.check(f"{key}.{option}", value, option in actions, "no key of this name")
            setattr(own, option, _value(reader, f"{key}.{option}", actions[option], value, path.parent))
        error = _failing(f"{path}: {key}: ")
        own.fleet = own.count = None
        check(error, own)
        if "strict" in table:  # of all robots it may be: there are others that it is for
            check_dialect(error, own, own.dialect)
        _move_ports(error, own, index, set(table))
        _name_files(own, name, set(table))
        robots.append(Robot(name, own))
    return robots


def _value(reader: Reader, key: str, action: argparse.Action, value: object, folder: Path) -> object:
    """The value of an option from a value in the file."""
    if (action.nargs == 0) != isinstance(value, bool):
        raise reader.fault(key, value, "no true or false" if isinstance(value, bool) else "true or false")
    values = value if isinstance(value, list) else [value]
    texts = [str(int(each)) if isinstance(each, bool) else str(each) for each in values]
    reader.check(key, value, all(isinstance(each, str | int | float) for each in values), "a text or numbers")
    text = ",".join(texts)
    if action.dest in FILES and not (action.dest == "robot" and text in built_in_robots()):
        text = str(folder / text)
    try:
        return value_of(action, text)
    except argparse.ArgumentTypeError as fault:
        raise Unusable(f"{reader.path}: {key}: {fault}") from None


def _move_ports(error: Error, options: argparse.Namespace, index: int, named: set[str]) -> None:
    """Add the robot's number to the ports that it does not set itself."""
    for kind in PORTS:
        ports = getattr(options, kind)
        if ports is None or kind in named:
            continue
        moved = [port and port + index for port in (ports if isinstance(ports, list) else [ports])]
        if max(moved) > MAX_PORT:
            option, wanted = kind.replace("_", "-"), f"expected up to {MAX_PORT}"
            error(f"argument --{option}: robot number {index} would have {max(moved)}, {wanted}")
        setattr(options, kind, moved if isinstance(ports, list) else moved[0])


def _check_ports(error: Error, robots: list[Robot]) -> None:
    taken: dict[int, list[tuple[str, str]]] = {}
    for robot in robots:
        for kind, host, port in _ports(robot.options):
            for other_host, other in taken.setdefault(port, []) if port else []:
                if host == other_host or host in _EVERYWHERE or other_host in _EVERYWHERE:
                    error(f"{kind} of {robot.name} overlaps {other}: both are port {port}")
            taken.setdefault(port, []).append((host, f"{kind} of {robot.name}"))


def _check_files(error: Error, robots: list[Robot]) -> None:
    taken: dict[Path, str] = {}
    for robot in robots:
        for kind in WRITTEN:
            path = getattr(robot.options, kind)
            if path is None or path.is_char_device():  # such as a terminal, which many may write to
                continue
            place = path.resolve()
            if place in taken:
                error(f"--{kind} of {robot.name} overlaps {taken[place]}: both are {path}")
            taken[place] = f"--{kind} of {robot.name}"


def _ports(options: argparse.Namespace) -> Iterator[tuple[str, str, int]]:
    """Port options with host and port; 0 for one that is picked."""
    for kind in PORTS:
        ports = getattr(options, kind)
        host = options.backdoor_host or "127.0.0.1" if kind.startswith("backdoor") else options.host
        for port in ports if isinstance(ports, list) else [ports]:
            if port is not None:
                yield f"--{kind.replace('_', '-')}", host, port


def _failing(where: str) -> Error:
    return partial(_fail, where)


def _fail(where: str, message: str) -> NoReturn:
    raise Unusable(f"{where}{shortened(message, 400)}")

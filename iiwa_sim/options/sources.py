"""Environment variables, fleet files and keyword arguments for the options in `model.py`."""

import difflib
import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, NamedTuple, get_args

import msgspec
from msgspec import inspect

from iiwa_sim.options import model
from iiwa_sim.options.model import SettingError, Settings
from iiwa_sim.protocols.ports import DEFAULT_PROTOCOL
from iiwa_sim.settings import LONGEST_VALUE, Reader, SettingsFault, expecting
from iiwa_sim.wording import harmless, shortened

SERVICE_LINKS = ("IIWA_SIM_SERVICE_", "IIWA_SIM_PORT_")
"""Variables that Kubernetes sets for a Service named iiwa-sim."""


class Option:
    """One option in all its spellings."""

    def __init__(self, field: msgspec.structs.FieldInfo, group: str) -> None:
        *title, self.text = (each for each in field.type.__metadata__ if isinstance(each, str))
        self.group, self.type = title[0] if title else group, field.type
        self.keyword, self.key, self.default = field.name, model.option_name(field.name), field.default
        self.flag, self.variable = model.flag_of(field.name), f"IIWA_SIM_{self.key.upper()}"
        self.is_list = isinstance(self.default, tuple)
        kind: Any = inspect.type_info(field.type)
        kind = kind.item_type if self.is_list else getattr(kind, "types", [kind])[0]
        self.is_switch, extra = isinstance(kind, inspect.BoolType), getattr(kind, "extra", {})
        literal = get_args(field.type)[0]
        values = get_args(get_args(literal)[0] if self.is_list else literal)  # msgspec sorts them
        words = list(map(str, values if isinstance(kind, inspect.LiteralType) else ["true", "false"]))
        self.check = extra.get("check", str)
        self.expected = extra.get("expected", " or ".join(words)) + ", commas between" * self.is_list
        self.metavar = extra.get("metavar", "|".join(words))
        shown = ",".join(self.default) if self.is_list else self.default
        self.unset = "" if shown is None or self.is_switch else str(shown)


class _Fleet(msgspec.Struct, forbid_unknown_fields=True):
    robot: Annotated[dict[str, dict[str, Any]], expecting("at least one, as [robot.NAME]", min_length=1)]


class Place(NamedTuple):
    """Source of values, and how it spells options."""

    spelling: str
    equals: str
    before: str = ""
    is_text: bool = False

    def show(self, option: Option, value: object) -> str:
        """Return an option and its value as the user wrote them, such as `--rate 5`; tokens stay hidden."""
        text = (str(value) or "''") if self.is_text else repr(value)
        text = "***" if option.metavar == "TOKEN" else shortened(harmless(text), LONGEST_VALUE)
        return f"{self.before}{getattr(option, self.spelling)}{self.equals}{text}"


Given = dict[str, Any]
"""Checked values by the fields of `Settings`."""
OPTIONS: dict[str, Option] = {}
"""The options by the fields of `Settings`."""
_group = ""
for _field in msgspec.structs.fields(Settings):
    OPTIONS[_field.name] = Option(_field, _group)
    _group = OPTIONS[_field.name].group
COMMAND_LINE = Place("flag", " ", is_text=True)
ENVIRONMENT = Place("variable", "=", is_text=True)
KEYWORDS = Place("keyword", "=")


def from_environment(variables: Mapping[str, str]) -> tuple[Given, list[str]]:
    """Return the options in environment variables, and warnings for unknown ones.

    An empty variable counts as not set. Raises SettingError.
    """
    known = {each.variable for each in OPTIONS.values()}
    mine = {name for name, text in variables.items() if text and name.startswith("IIWA_SIM_")}
    mine -= {name for name in mine if name.startswith(SERVICE_LINKS) or "tcp://" in variables[name]}
    given = from_names({name: variables[name] for name in known & mine}, ENVIRONMENT)
    return given, [str(unknown(name, known)) for name in sorted(mine - known)]


def from_names(names: Mapping[str, Any], place: Place, folder: Path | None = None) -> Given:
    """Return options by keyword or key of a table; paths start at `folder`. Raises SettingError."""
    left_out = model.PROCESS if place.spelling in ("keyword", "key") else ()
    known = {getattr(each, place.spelling): each for each in OPTIONS.values() if each.key not in left_out}
    for name in sorted(names.keys() - known.keys()):
        if name in model.PROCESS:
            raise SettingError(f"{place.before}{name}: expected on the command line, for the whole process")
        raise unknown(name, known, before=place.before)
    given = {known[name]: value for name, value in names.items() if value is not None}
    return {option.keyword: read(option, value, place, folder) for option, value in given.items()}


def from_keywords(keywords: Mapping[str, Any], settings: Settings | None = None) -> Settings:
    """Return settings from keyword arguments, which precede `settings`. Raises SettingError.

    Ports are free ones if none is given.
    """
    common: Given = {"port": (0,)}
    for name, option in OPTIONS.items():
        value = getattr(settings or Settings(), name)
        if value != option.default:
            common[name] = read(option, value, KEYWORDS)
    return Settings(**merged(common, from_names(keywords, KEYWORDS)))


def merged(*sources: Given) -> Given:
    """Return the options of several sources, the last of which holds; a cell stands for a robot."""
    found: Given = {}
    for each in sources:
        if "cell" in each or "robot" in each:
            found = {key: value for key, value in found.items() if key not in ("cell", "robot")}
        found |= each
    return found


def read(option: Option, given: Any, place: Place, folder: Path | None = None) -> Any:
    """Return a checked value. Raises SettingError with the option, its value and the expected ones."""
    value = str(given) if isinstance(given, Path) else given
    if option.is_list and not isinstance(value, list | tuple):
        value = [word.strip() for word in str(value).split(",")]
    if option.metavar == "HOST" and isinstance(value, str):
        value = value.removeprefix("[").removesuffix("]")  # as an IPv6 address is printed before its port
    try:
        value = msgspec.convert(value, option.type, strict=not (place.is_text or option.is_list))
        if value is None:  # the text null
            raise ValueError
        if folder and option.key in model.FILES and (option.key != "robot" or (folder / value).exists()):
            value = str(folder / value)
        list(map(option.check, value if option.is_list else [value]))
    except (msgspec.ValidationError, ValueError, OSError):
        also = ", 1 or 0" if option.is_switch and place.is_text else ""
        raise SettingError(f"{place.show(option, given)}: expected {option.expected}{also}") from None
    return value


def unknown(name: str, known: Iterable[str], what: str = "no such option", before: str = "") -> SettingError:
    """Build the error for an unknown name, with the one of `known` that is nearest to it."""
    near = [f", did you mean {each}?" for each in difflib.get_close_matches(name, list(known), 1)]
    return SettingError(f"{before}{shortened(harmless(name), LONGEST_VALUE)}: {what}{''.join(near)}")


def robots_of(given: Given) -> dict[str, Settings]:
    """Return the settings of each robot of the process by its name; a single robot has an empty name.

    Raises SettingError and SettingsFault.
    """
    fleet = Path(given["fleet"]) if "fleet" in given and "count" not in given else None
    if fleet is not None:
        tables = Reader(str(fleet), SettingsFault).settings(_Fleet).robot
        given = {key: given[key] for key in given if key != "fleet"}
    else:
        count = Settings(**given).count
        tables = {"": {}} if count is None else {f"robot-{number}": {} for number in range(count)}
    robots: dict[str, Settings] = {}
    for index, (name, table) in enumerate(tables.items()):
        place = f"{fleet}: robot.{name}"
        if fleet and not re.fullmatch(r"[A-Za-z0-9_.-]{1,100}", name):  # it is part of file names and the log
            raise SettingError(harmless(f"{place}: expected a name of letters, digits, - _ ."))
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
    _check_ports(robots)
    files = [file for robot in robots.values() for key in model.WRITTEN if (file := getattr(robot, key))]
    if len(set(files)) < len(files):
        raise SettingError("--transcript, --record: expected a file of its own for each robot")
    return robots


def robots_in(settings: Settings) -> dict[str, dict[str, int]]:
    """Return the names of the robots in a cell with `[[robot]]`, each with the ports of its protocols.

    A file that cannot be used has none; loading the cell then raises the reason.
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


def _check_ports(robots: Mapping[str, Settings]) -> None:
    """Raise SettingError if two options name the same port of the same host."""
    taken: dict[tuple[str, int], str] = {}
    for name, robot in robots.items():
        own, hosts = f" of {name}" if name else "", {"backdoor_port": robot.backdoor_host}
        ports = {} if robots_in(robot) else robot.ports
        asked = [(f"--port for {each}{own}", robot.host, port) for each, port in ports.items()]
        flags = ((model.flag_of(key) + own, key) for key in model.PORTS)
        asked += [(flag, hosts.get(key, robot.host), getattr(robot, key)) for flag, key in flags]
        for option, host, port in (*asked, ("--view-port", robot.view_host, robot.view_port)):
            if port and (other := taken.setdefault((host, port), option)) != option:
                raise SettingError(f"{option}: expected another port than {port}, that of {other}")


def _numbered(robot: Settings, index: int, name: str, own: Given) -> Settings:
    """Return settings with ports and files of this robot, except for its `own` options."""
    ports = {key: getattr(robot, key) for key in model.PORTS if key not in own}
    changed = {key: port + index for key, port in ports.items() if port}
    if "port" not in own and not robots_in(robot):
        changed["port"] = ",".join(str(port and port + index) for port in robot.ports.values())
    changed = {key: read(OPTIONS[key], value, COMMAND_LINE) for key, value in changed.items()}
    files = {key: getattr(robot, key) for key in model.WRITTEN if key not in own}
    changed |= {key: model.file_of(name, file) for key, file in files.items() if file}
    return msgspec.structs.replace(robot, **changed)

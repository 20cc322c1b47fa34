"""Environment variables, tables of TOML files and keyword arguments for the options in `model.py`."""

import difflib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
from msgspec import inspect

from iiwa_sim.options import model
from iiwa_sim.options.model import SettingError, Settings
from iiwa_sim.wording import harmless, shortened

LONGEST_SHOWN = 60
"""Most characters of a name or a value that a message shows."""
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
        words = list(map(str, getattr(kind, "values", ["true", "false"])))
        self.check = extra.get("check", str)
        self.expected = extra.get("expected", " or ".join(words)) + ", commas between" * self.is_list
        self.metavar = extra.get("metavar", "|".join(words))
        shown = ",".join(self.default) if self.is_list else self.default
        self.unset = "" if shown is None or self.is_switch else str(shown)


class Place(NamedTuple):
    """Source of values, and how it spells options."""

    spelling: str
    equals: str
    before: str = ""
    is_text: bool = False

    def show(self, option: Option, value: object) -> str:
        """Return an option and its value as the user wrote them, such as `--rate 5`; tokens stay hidden."""
        words = map(str, value if isinstance(value, list | tuple) else [value])
        text = (",".join(words) or "''") if self.is_text else repr(value)
        text = "***" if option.metavar == "TOKEN" else shortened(harmless(text), LONGEST_SHOWN)
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
    """Return a checked value. Raises SettingError with the option, its value and what is expected."""
    value = str(given) if isinstance(given, Path) else given
    if option.is_list and not isinstance(value, list | tuple):
        value = [word.strip() for word in str(value).split(",")]
    if option.metavar == "HOST" and isinstance(value, str):
        value = value.removeprefix("[").removesuffix("]")  # as an IPv6 address is printed before its port
    try:
        value = msgspec.convert(value, option.type, strict=not (place.is_text or option.is_list))
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
    return SettingError(f"{before}{shortened(harmless(name), LONGEST_SHOWN)}: {what}{''.join(near)}")

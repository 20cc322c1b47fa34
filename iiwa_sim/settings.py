"""Settings in TOML files: reading, checking and error messages.

An error is one line that names the file, the key, its value and what was expected.
"""

from __future__ import annotations

import re
import sys
import tomllib
from difflib import get_close_matches
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from iiwa_sim.wording import Unusable, harmless, shortened

LONGEST_NAME = 100
LONGEST_VALUE = 60
"""Most characters of a key or a value that a message shows."""
LONGEST_EXPECTED = 400
"""Most characters of the expectation in a message, which may quote paths and names."""

Range = tuple[float, float, str]
"""Least and greatest value, and the unit with a leading blank."""
Settings = TypeVar("Settings")

_PLACE = re.compile(r" - at `\$([\w.\[\]]*)`$")
MISSING = "(missing)"
"""Shown in place of a value."""
_IN_TOML = {
    "str": "a string",
    "int": "an integer",
    "float": "a number",
    "bool": "a boolean",
    "array": "an array",
    "object": "a table",
}
"""Names of types in msgspec's messages, in the words of TOML."""
_TYPE = re.compile(rf"\b({'|'.join(_IN_TOML)})\b")
_PART = re.compile(r"(\w+)|\[(\d+)\]")


def data_folder(package: str) -> Path:
    """Return the folder of a package of data, without importlib.resources, which takes 10 ms to import."""
    return Path(import_module(package).__path__[0])


class SettingsFault(Unusable):
    """A settings file cannot be used."""

    def __init__(self, file: str, key: str, value: object, expected: str) -> None:
        place = f"{file}: {_shown(key)} = {_shown(value)}" if key else file
        wanted = shortened(" ".join(expected.split()), LONGEST_EXPECTED)
        super().__init__(harmless(f"{place}: expected {wanted}"))


class Reader:
    """Reads one file and checks its values; every error is raised as the same kind of fault."""

    def __init__(self, path: str, fault: type[SettingsFault], prefix: str = "") -> None:
        """`prefix` stands before the keys in messages."""
        self.path = path
        self._fault = fault
        self._prefix = prefix

    def under(self, prefix: str) -> Reader:
        """Return a reader of a table in the file, whose keys begin so."""
        return Reader(self.path, self._fault, prefix)

    def fault(self, key: str, value: object, expected: str) -> SettingsFault:
        """The exception to raise for a key whose value cannot be used."""
        key = f"{self._prefix}{key}" if key else ""
        return self._fault(self.path, key, MISSING if value is None else quoted(value), expected)

    def text(self, file: Path, missing: str) -> str:
        """The text of a file; `missing` tells what was expected if there is none."""
        try:
            if file.exists() and not file.is_file():  # a pipe would never end
                raise self.fault("", "", "a regular file")
            return file.read_text(encoding="utf-8-sig")  # editors may put an invisible mark in front
        except FileNotFoundError:
            raise self.fault("", "", missing) from None
        except OSError as fault:
            raise self.fault("", "", f"a readable text file ({fault.strerror})") from None
        except UnicodeDecodeError as fault:
            raise self.fault("", "", f"a readable text file ({fault})") from None

    def settings(self, text: str, kind: type[Settings]) -> Settings:
        """The settings in a TOML text, checked against the keys and types of a `msgspec.Struct`."""
        try:
            table = tomllib.loads(text)
        except tomllib.TOMLDecodeError as fault:
            raise self.fault("", "", f"valid TOML ({fault})") from None
        except ValueError:
            longest = sys.get_int_max_str_digits()
            raise self.fault("", "", f"whole numbers of at most {longest} digits") from None
        except RecursionError:
            raise self.fault("", "", "fewer lists and tables within each other") from None
        try:
            return msgspec.convert(table, kind)
        except msgspec.ValidationError as fault:
            raise self._type_fault(table, kind, str(fault)) from None

    def check(self, key: str, value: object, holds: bool, expected: str) -> None:
        """Raises the fault if a condition does not hold for a value."""
        if not holds:
            raise self.fault(key, value, expected)

    def check_range(self, key: str, value: float, allowed: Range) -> None:
        """Raises the fault if a number is out of its range."""
        least, greatest, unit = allowed
        expected = f"a number from {least:.9g} to {greatest:.9g}{unit}"
        self.check(key, value, least <= value <= greatest, expected)

    def check_name(self, key: str, name: str) -> None:
        """Raises the fault if a text is not usable as a name."""
        self.check(key, name, name.strip() != "", "a name")
        self.check(key, name, name == " ".join(name.split()), "single blanks, and none at the ends")
        self.check(key, name, name.isprintable(), "characters that print")
        self.check(key, name, len(name) <= LONGEST_NAME, f"at most {LONGEST_NAME} characters")

    def check_name_in_lines(self, key: str, name: str) -> None:
        """Raises the fault if a text is not usable as the name of what lines of commands speak of."""
        self.check_name(key, name)
        self.check(key, name, ":" not in name, "no colon, which ends the command in a line of the backdoor")

    def _type_fault(self, table: dict[str, Any], kind: type, message: str) -> SettingsFault:
        """The fault for an error of msgspec, with the value concerned.

        Its message reads `what it wants - at $.key[1]`.
        """
        place = _PLACE.search(message)
        key = place[1].removeprefix(".") if place else ""
        expected = message[: place.start()] if place else message
        if "unknown field" in expected or "missing required field" in expected:
            field = expected[expected.index("`") + 1 : expected.rindex("`")]
            wanted = "this key"
            if "unknown field" in expected:
                known = _keys(
                    msgspec.inspect.type_info(kind), [name for name, _ in _PART.findall(key) if name]
                )
                near = get_close_matches(field, known - {field}, 1)
                wanted = "no key of this name" + (f", did you mean {near[0]!r}?" if near else "")
            holder = _value(table, key)
            value = quoted(holder[field]) if field in holder else MISSING
            return self._fault(self.path, f"{key}.{field}" if key else field, value, wanted)
        if expected.startswith("Invalid value"):  # of the key by which msgspec tells types apart
            expected = " or ".join(_tags(msgspec.inspect.type_info(kind), key.rpartition(".")[2]))
        if expected == "Number out of range":
            expected = "a number of less than 309 digits"
        expected = expected.removeprefix("Expected ").replace("`", "").replace(", got", ", not")
        expected = expected.replace(" | null", "")  # TOML has none: a key is left out
        expected = _TYPE.sub(lambda word: _IN_TOML[word[0]], expected.replace(" | ", " or "))
        expected = expected.replace(", not a number", ", not a float")
        if expected == "an array, not a table":
            expected += f"; [[{key}]] begins a table of an array"
        return self.fault(key, _value(table, key), expected)


def quoted(value: object) -> object:
    """A text in quotes, to show where it begins and ends; any other value as it is."""
    return repr(value) if isinstance(value, str) else value


def _tags(kind: Any, field: str) -> list[str]:
    """The texts by which a field of this name, within a type of msgspec's, tells types apart."""
    if isinstance(kind, msgspec.inspect.UnionType):
        return [tag for each in kind.types for tag in _tags(each, field)]
    if isinstance(kind, msgspec.inspect.VarTupleType | msgspec.inspect.ListType):
        return _tags(kind.item_type, field)
    if not isinstance(kind, msgspec.inspect.StructType):
        return []
    own = [repr(kind.tag)] if kind.tag_field == field else []
    return own + [tag for each in kind.fields for tag in _tags(each.type, field)]


def _keys(kind: Any, path: list[str]) -> set[str]:
    """Return the keys of the tables at a path within a type of msgspec's."""
    if isinstance(kind, msgspec.inspect.UnionType):
        return {key for each in kind.types for key in _keys(each, path)}
    if isinstance(kind, msgspec.inspect.VarTupleType | msgspec.inspect.ListType):
        return _keys(kind.item_type, path)
    if not isinstance(kind, msgspec.inspect.StructType):
        return set()
    if not path:
        return {each.encode_name for each in kind.fields}
    return {key for each in kind.fields if each.encode_name == path[0] for key in _keys(each.type, path[1:])}


def _value(table: dict[str, Any], key: str) -> Any:
    value: Any = table
    for name, index in _PART.findall(key):
        value = value[name] if name else value[int(index)]
    return value


def _shown(value: object) -> str:
    try:
        return shortened(str(value), LONGEST_VALUE)
    except (ValueError, RecursionError):  # an integer of more digits than Python prints, lists in lists
        return f"a very long {type(value).__name__}"

"""Settings in TOML files: reading, checking and error messages.

An error is one line that names the file, the key, its value and what was expected. The types of settings
say what is allowed: `between` for numbers, `Name` for texts, `require` in `__post_init__` for the rest.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, TypeVar

import msgspec
from msgspec import inspect

from iiwa_sim.wording import Unusable, harmless, shortened

LONGEST_NAME = 100
LONGEST_VALUE = 60
"""Most characters of a key or a value that a message shows."""
LONGEST_FILE = 200
LONGEST_EXPECTED = 400
"""Most characters of the expectation in a message, which may quote paths and names."""
MISSING = "(missing)"
"""Shown in place of a value."""
Settings = TypeVar("Settings")

_PLACE = re.compile(r" - at `\$([\w.\[\]]*)`$")
_PART = re.compile(r"(\w+)|\[(\d+)\]")


def between(least: float, greatest: float, unit: str = "") -> msgspec.Meta:
    """Return the range of a number; `unit` is that of messages, with a leading blank."""
    kind = "an integer" if isinstance(least, int) else "a number"
    return expecting(f"{kind} from {least:.9g} to {greatest:.9g}{unit}", ge=least, le=greatest)


def expecting(expected: str, **limits: Any) -> msgspec.Meta:
    """Return limits as `msgspec.Meta` has them, with the words for them in messages."""
    return msgspec.Meta(**limits, extra={"expected": expected})


_CHARACTER = r"[^\s\x00-\x1f\x7f-\x9f]"
Name = Annotated[
    str,
    expecting(
        f"a name of up to {LONGEST_NAME} characters that print, with single blanks",
        pattern=rf"^{_CHARACTER}+( {_CHARACTER}+)*\Z",
        max_length=LONGEST_NAME,
    ),
]


def require(holds: bool, key: str, expected: str) -> None:
    """Reject a value in `__post_init__` of settings; `key` begins there."""
    if not holds:
        raise ValueError(key, expected)


def data_folder(package: str) -> Path:
    """Return the folder of a package of data, without importlib.resources, which takes 10 ms to import."""
    return Path(import_module(package).__path__[0])


class SettingsFault(Unusable):
    """A settings file cannot be used."""

    def __init__(self, file: str, key: str, value: object, expected: str) -> None:
        file = shortened(file, LONGEST_FILE)
        key, shown = (shortened(str(each), LONGEST_VALUE) for each in (key, value))
        place = f"{file}: {key} = {shown}" if key else file
        wanted = shortened(" ".join(expected.split()), LONGEST_EXPECTED)
        super().__init__(harmless(f"{place}: expected {wanted}"))


class Reader:
    """Reader of one file that checks its values; every error is raised as the same kind of fault."""

    def __init__(self, path: str, fault: type[SettingsFault], prefix: str = "") -> None:
        """`prefix` stands before the keys in messages."""
        self.path = path
        self._fault = fault
        self._prefix = prefix

    def under(self, prefix: str) -> Reader:
        """Return a reader of a table in the file, whose keys begin so."""
        return Reader(self.path, self._fault, prefix)

    def fault(self, key: str, value: object, expected: str) -> SettingsFault:
        """Return the exception to raise for a key whose value cannot be used."""
        key, shown = f"{self._prefix}{key}" if key else "", repr(value) if isinstance(value, str) else value
        return self._fault(self.path, key, MISSING if value is None else shown, expected)

    def check(self, key: str, value: object, holds: bool, expected: str) -> None:
        """Raise the fault if a condition does not hold for a value."""
        if not holds:
            raise self.fault(key, value, expected)

    def text(self) -> str:
        """Return the text of the file."""
        try:
            if (file := Path(self.path)).exists() and not file.is_file():  # a pipe would never end
                raise self.fault("", "", "a regular file")
            return file.read_text(encoding="utf-8-sig")  # editors may put an invisible mark in front
        except (OSError, ValueError) as fault:
            why = getattr(fault, "strerror", fault)
            raise self.fault("", "", f"a readable text file ({why})") from None

    def settings(self, kind: type[Settings]) -> Settings:
        """Return the settings in a TOML file, converted to a `msgspec.Struct`."""
        text = self.text()
        try:
            return self.converted(tomllib.loads(text), kind)
        except (ValueError, RecursionError) as fault:  # of TOML, a number of too many digits, or deep lists
            raise self.fault("", "", f"valid TOML ({fault})") from None

    def converted(self, value: Any, kind: type[Settings]) -> Settings:
        """Return the settings in tables and lists."""
        try:
            return msgspec.convert(value, kind)
        except msgspec.ValidationError as fault:
            found = _PLACE.search(message := str(fault))
            key, expected = (found[1].removeprefix("."), message[: found.start()]) if found else ("", message)
            if isinstance(fault.__cause__, ValueError):  # of `require`
                own, expected = fault.__cause__.args
                key = f"{key}.{own}" if key else own
            else:
                key, expected = _in_words(inspect.type_info(kind), key, expected)
            raise self.fault(key, _value(value, _path(key)), expected) from None


def _in_words(kind: inspect.Type, key: str, expected: str) -> tuple[str, str]:
    """Return the key that an error of msgspec at `key` concerns, and what was expected."""
    path = _path(key)
    name = ".".join(each for each in path if not each.isdigit())
    for got, at, wanted in (("object", [*path, "0"], f"[[{name}]]"), ("array", path, f"[{name}]")):
        if f"got `{got}`" in expected and any(isinstance(t, inspect.StructType) for t in _types(kind, at)):
            return key, f"{'an array' if got == 'object' else 'one table'}: write {wanted}"
    if words := [each.extra["expected"] for each in _types(kind, path) if getattr(each, "extra", None)]:
        return key, " or ".join(words)
    if "unknown field" in expected or "missing required field" in expected:
        name, wanted = expected.split("`")[1], "this key"
        if "unknown field" in expected:
            tables = [each for each in _types(kind, path) if isinstance(each, inspect.StructType)]
            known = {field.encode_name for each in tables for field in each.fields}
            near = get_close_matches(name, known, 1)
            hint = f", did you mean {near[0]!r}?" if near else f"; there are {', '.join(sorted(known))}"
            wanted = f"no key of this name{hint}"
        return f"{key}.{name}" if key else name, wanted
    if counts := [len(each.item_types) for each in _types(kind, path) if isinstance(each, inspect.TupleType)]:
        return key, f"a list of {' or '.join(map(str, counts))} values"
    # TOML has no null: a key is left out.
    return key, expected.removeprefix("Expected ").replace(" | null", "").replace(" | ", " or ")


def _path(key: str) -> list[str]:
    """Return the names and indices in a key."""
    return [name or index for name, index in _PART.findall(key)]


def _types(kind: Any, path: Sequence[str]) -> Iterator[Any]:
    """Yield the types that may stand at a path in settings of a type."""
    if isinstance(kind, inspect.UnionType):
        for each in kind.types:
            yield from _types(each, path)
    elif not path:
        yield kind
    elif isinstance(kind, inspect.Metadata):
        yield from _types(kind.type, path)
    elif isinstance(kind, inspect.StructType):
        for field in kind.fields:
            if field.encode_name == path[0]:
                yield from _types(field.type, path[1:])
    elif isinstance(kind, inspect.TupleType):
        yield from _types(kind.item_types[int(path[0])], path[1:])
    elif isinstance(kind, inspect.ListType | inspect.VarTupleType):
        yield from _types(kind.item_type, path[1:])


def _value(value: Any, path: Sequence[str]) -> Any:
    """Return the value at a path in tables and lists; None for nothing."""
    try:
        for each in path:
            value = value[each] if isinstance(value, dict) else value[int(each)]
    except (KeyError, IndexError):
        return None
    return value

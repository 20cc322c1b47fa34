"""The table of the text protocol: its commands, and how a line is parsed by them.

A line reads `command : parameters`. Letter case is ignored, any run of blanks and tabs counts as one blank. A
line that names no command (empty, `:`, more than one `:`) is answered `unknown command`, one with wrong
parameters (too few, no number, out of range) `error`. Values behind the last parameter are counted: the
session ignores or refuses them. Parameters behind a command that takes none are ignored.
"""

import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from difflib import get_close_matches
from functools import cache, lru_cache
from itertools import groupby
from math import inf, nan, nextafter, tau
from typing import NamedTuple

import msgspec

from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, Refused
from iiwa_sim.protocols.decimals import NOT_DECIMAL, NotANumberError, parse_decimal, quoted
from iiwa_sim.protocols.lines import MAX_LINE_BYTES, OVERLONG
from iiwa_sim.settings import data_folder

UNKNOWN_COMMAND = "unknown command"
ERROR = "error"
EXTENSIONS = "extensions"
"""`help : extensions` names the commands that the original does not know."""
LONGEST_LOOKED_UP = 40
"""Bytes of a misspelt name for which a similar one is looked up."""
ALIKE = 0.75
"""Least similarity of a name, from 0 to 1, to be shown as a hint."""

_HELP = "help"
_ASKS_HELP = re.compile(rb"[ \t]*(?:help(?=[ \t?])|\?)[ \t?]*:?", re.IGNORECASE)  # `help lin move`, `?`
_CACHED_LINES = 1024


class Quantity(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A number on the wire: `above < value`, `minimum <= value`, `value <= maximum` where they are given."""

    unit: str
    meaning: str
    above: float | None = None
    minimum: float | None = None
    maximum: float | None = None
    integer: bool = False
    name: str = ""

    @property
    def range(self) -> str:
        """The range as an inequality, such as `0 < speed <= 1`; empty if the table gives none."""
        low = f"{self.above:g} < " if self.above is not None else ""
        low = f"{self.minimum:g} <= " if self.minimum is not None else low
        high = f" <= {self.maximum:g}" if self.maximum is not None else ""
        return f"{low}{self.name}{high}" if low or high else ""

    @property
    def bounds(self) -> tuple[float, float]:
        """The least and the greatest value, both in range; both finite."""
        low = nextafter(-inf, 0.0) if self.minimum is None else self.minimum
        if self.above is not None:
            low = max(low, nextafter(self.above, inf))
        return low, nextafter(inf, 0.0) if self.maximum is None else self.maximum

    def refusal(self, word: bytes) -> str:
        """Return the reason to refuse a word that is no number in range."""
        try:
            value = parse_decimal(word)
        except NotANumberError as fault:
            return f"{self.name} = {fault}{_commas(word)}"
        if self.integer and value != int(value):
            return f"{self.name} = {quoted(word)}: expected a whole number"
        parts = (
            f"above {self.above:g}" if self.above is not None else "",
            f"at least {self.minimum:g}" if self.minimum is not None else "",
            f"up to {self.maximum:g}" if self.maximum is not None else "",
        )
        return f"{self.name} = {quoted(word)}: expected {' and '.join(part for part in parts if part)}"


class _Quantities(tuple[Quantity, ...]):
    """Quantities in their order on the wire, which the file names."""


class _Reply(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    words: tuple[str, ...] = ()
    values: _Quantities = _Quantities()
    list: _Quantities = _Quantities()
    prose: bool = False


class Command(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One command of the table.

    It takes numbers (`parameters`, and `optional` ones, all or none of them), words (`phrase` names them), or
    nothing. It answers one of `reply.words`, numbers (`reply.values`), any number of the same (`reply.list`)
    or a line of prose.
    """

    summary: str
    mode: str
    requirements: tuple[str, ...]
    reply: _Reply
    parameters: _Quantities = _Quantities()
    optional: _Quantities = _Quantities()
    phrase: str = ""
    extension: bool = False
    name: str = ""

    def takes(self) -> str:
        """Return the parameters of the command by name and number: `x y z speed: 4 values`."""
        names = [name for name, _ in _in_series(self.parameters)]
        names += [f"({each.name})" for each in self.optional]
        more = f" or {len(self.parameters) + len(self.optional)}" if self.optional else ""
        plural = "" if len(self.parameters) == 1 and not more else "s"
        return f"{' '.join(names)}: {len(self.parameters)}{more} value{plural}"

    def usage(self) -> str:
        """Return how to write the command, with units and ranges, and what it answers."""
        takes = [f"[{self.phrase}]"] if self.phrase else []
        takes += [f"{name}[{_unit_and_range(each, name)}]" for name, each in _in_series(self.parameters)]
        takes += [f"({each.name}[{_unit_and_range(each, each.name)}])" for each in self.optional]
        gives = " ".join(f"{name}[{each.unit}]" for name, each in _in_series(self.reply.values))
        for each in self.reply.list:
            gives = f"{each.name}[{_unit_and_range(each, each.name)}] ..."
        gives = gives or " / ".join(self.reply.words) or "text"
        return f"{self.name}{' : ' if takes else ''}{' '.join(takes)} -> {gives}"


class Refusal(NamedTuple):
    """A line that is refused before it reaches the controller."""

    reply: str
    code: int
    reason: str


class Request(NamedTuple):
    """A parsed line: the command with its numbers or its words."""

    command: Command
    values: tuple[float, ...]
    phrase: str
    beyond: int = 0
    """Number of values after the last parameter."""
    in_degrees: str = ""
    """A remark if an angle is more than a turn, and so may be meant in degrees; else empty."""

    def too_much(self) -> Refusal:
        """Build the refusal for values after the last parameter."""
        count = len(self.values) + self.beyond
        return _error(f"{self.command.name} takes {self.command.takes()}, got {count}")


class Table:
    """The commands of one protocol, by name in lower case, in the order of the table."""

    def __init__(self, commands: dict[str, Command]) -> None:
        self.commands = commands
        self._ranges = {
            command.name: [(each, *each.bounds) for each in (*command.parameters, *command.optional)]
            for command in commands.values()
        }
        self.parse = lru_cache(_CACHED_LINES)(self._parse)
        """Parse a line, without its end; OVERLONG stands for one that was too long."""
        self.find = lru_cache(_CACHED_LINES)(self._find)
        """Return the command with this name; letter case and runs of blanks do not count."""

    def _find(self, spelling: bytes) -> Command | None:
        return self.commands.get(" ".join(_words(spelling)).lower())

    def meant(self, spelling: bytes) -> str | None:
        """Return the name that a misspelt one is like."""
        name = " ".join(_words(spelling[:LONGEST_LOOKED_UP])).lower()
        return next(iter(get_close_matches(name, self.commands, 1, ALIKE)), None)

    def _parse(self, line: bytes) -> Request | Refusal:
        if line == OVERLONG:
            return _error(f"a line of more than {MAX_LINE_BYTES} bytes")
        spelling, colon, rest = line.partition(b":")
        command = self.find(spelling)
        if command is None:
            if _HELP in self.commands and (asked := _ASKS_HELP.match(line)):
                return Request(self.commands[_HELP], (), " ".join(_words(line[asked.end() :])))
            return _unknown(self.why_unknown(line))
        if colon and b":" in rest:
            return _unknown("more than one ':'")
        if not command.parameters:
            if command.phrase:
                return Request(command, (), " ".join(_words(rest)))
            return Request(command, (), "")
        words = _split(rest)
        has_optional = len(words) > len(command.parameters)
        if len(words) < len(command.parameters) + has_optional * len(command.optional):
            return _error(f"{command.name} takes {command.takes()}, got {len(words)}{_commas(rest)}")
        values, in_degrees = [], ""
        for (quantity, low, high), word in zip(self._ranges[command.name], words, strict=False):
            try:
                value = float(word)
            except ValueError:
                value = nan
            in_range = low <= value <= high and not (quantity.integer and value != int(value))
            if not in_range or NOT_DECIMAL.search(word):
                return _error(quantity.refusal(word))
            if quantity.unit == "rad" and abs(value) > tau and not in_degrees:
                in_degrees = (
                    f"{quantity.name} = {value:.7g} is more than a turn: angles are in rad, not in degrees"
                )
            values.append(value)
        return Request(command, tuple(values), "", len(words) - len(values), in_degrees)

    def why_unknown(self, line: bytes) -> str:
        """Return the reason for which a line names no command."""
        spelling, colon, _ = line.partition(b":")
        if not line.strip(b" \t:"):
            return "empty line"
        words = _words(spelling)
        if not words:
            return "no command before the colon"
        for count in range(len(words) - 1, 0, -1):
            command = self.commands.get(" ".join(words[:count]).lower())
            if command is not None and not colon and command.parameters:
                return f"expected a colon behind '{command.name}'"
        if words[0].startswith("<"):
            return "no such command; messages in XML go to a robot with --protocol krc4"
        meant = self.meant(spelling)
        return f"no such command; did you mean {meant}" if meant else "no such command; help lists them"


def with_hint(reason: str, request: Request) -> str:
    """Return the reason of a refusal, with a hint if angles may be in degrees."""
    return f"{reason}; {request.in_degrees}" if request.in_degrees else reason


@cache
def load_table(name: str) -> Table:
    """Return the table protocol/NAME.toml."""
    rows = tomllib.loads(data_folder("iiwa_sim.protocol").joinpath(f"{name}.toml").read_text("utf-8"))
    known = msgspec.convert(rows["value"], dict[str, Quantity])

    def quantities(kind: type[_Quantities], names: str) -> _Quantities:
        return kind(msgspec.structs.replace(known[each], name=each) for each in names.split())

    commands = msgspec.convert(rows["command"], dict[str, Command], dec_hook=quantities)
    return Table({name: msgspec.structs.replace(each, name=name) for name, each in commands.items()})


class ErrorCode(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An error code explained; each value begins in lower case and ends without a full stop."""

    meaning: str
    cause: str
    """The usual cause."""
    remedy: str


@cache
def load_error_codes() -> Mapping[int, ErrorCode]:
    """Return the rows of protocol/errors.toml by code, in the order of the table."""
    text = data_folder("iiwa_sim.protocol").joinpath("errors.toml").read_bytes()
    return {int(code): row for code, row in msgspec.toml.decode(text, type=dict[str, ErrorCode]).items()}


def helped(table: Table, phrase: str, example: str) -> str:
    """Return the answer to `help : PHRASE`.

    For a command that is its usage, for an error code its meaning, else the names that are like the phrase.
    Without a phrase the commands are named, for `extensions` those that the original does not know; `example`
    is one that takes parameters. Raises `Refused` if no name is like the phrase, and for a number that is no
    code.
    """
    named = [
        ", ".join(command.name for command in table.commands.values() if command.extension is extension)
        for extension in (False, True)
    ]
    if not phrase:
        more = f", help : {EXTENSIONS} more of them" if named[1] else ""
        hint = f"help : {example} tells its usage{more}, help : 3021 what a code of get error means"
        return f"{named[0]} ({hint})"
    if phrase.lower() == EXTENSIONS:
        return f"{EXTENSIONS}: {named[1] or 'none'}"
    if phrase.isdecimal():
        codes = load_error_codes()
        row = codes.get(int(phrase))
        if row is None:
            reason = f"no such error code: there are {', '.join(map(str, codes))}"
            raise Refused(COMMUNICATION_FAILURE, reason)
        return f"{phrase}: {row.meaning}; usual cause: {row.cause}; what to do: {row.remedy}"
    command = table.commands.get(phrase.lower())
    if command is not None:
        return f"{command.usage()}; {command.summary}{' (extension)' if command.extension else ''}"
    alike = ", ".join(name for name in table.commands if phrase.lower() in name)
    alike = alike or table.meant(phrase.lower().encode()) or ""
    if not alike:
        raise Refused(COMMUNICATION_FAILURE, "no such command")
    return f"alike: {alike}"


def _in_series(quantities: Iterable[Quantity]) -> Iterator[tuple[str, Quantity]]:
    """Yield the quantities with their names, j0 to j6 as `j0..j6`."""
    for _, group in groupby(quantities, lambda each: each.name.rstrip("0123456789")):
        first, *others = group
        yield (f"{first.name}..{others[-1].name}" if others else first.name), first


def _unit_and_range(quantity: Quantity, name: str) -> str:
    unit = "" if quantity.unit == "1" else quantity.unit
    return ", ".join(part for part in (unit, msgspec.structs.replace(quantity, name=name).range) if part)


def _split(text: bytes) -> list[bytes]:
    return [word for word in text.replace(b"\t", b" ").split(b" ") if word]


def _words(text: bytes) -> list[str]:
    return [word.decode("ascii", "backslashreplace") for word in _split(text)]


def _commas(text: bytes) -> str:
    """Return a hint for parameters with commas."""
    return "; no commas: blanks between values, a point in a decimal" if b"," in text else ""


def _unknown(reason: str) -> Refusal:
    return Refusal(UNKNOWN_COMMAND, COMMUNICATION_FAILURE, reason)


def _error(reason: str) -> Refusal:
    return Refusal(ERROR, COMMUNICATION_FAILURE, reason)

"""The table of the text protocol: its commands, and how a line is parsed by them.

A line reads `command : parameters`. Letter case is ignored, any run of blanks and tabs counts as one blank. A
line without a known command (empty, `:`, more than one `:`) is answered `unknown command`. A line with wrong
parameters (too few, no number, out of range) is answered `error`. Values behind the last parameter are
counted: the session ignores or rejects them. Parameters behind a command that takes none are ignored.
"""

import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from difflib import get_close_matches
from functools import cache, lru_cache
from itertools import groupby
from math import inf, nextafter, tau
from typing import Any, NamedTuple

import msgspec

from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, Refused
from iiwa_sim.protocols.decimals import parse_decimal, quoted
from iiwa_sim.protocols.lines import MAX_LINE_BYTES, OVERLONG
from iiwa_sim.settings import data_folder

UNKNOWN_COMMAND = "unknown command"
ERROR = "error"
LONGEST_LOOKED_UP = 40
"""Bytes of a misspelt name for which a similar one is looked up."""
ALIKE = 0.75
"""Least similarity of a name, from 0 to 1, to be shown as a hint."""

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
        """The range, such as `above 0 and up to 1`; empty if the table gives none."""
        limits = ("above", self.above), ("at least", self.minimum), ("up to", self.maximum)
        return " and ".join(f"{word} {limit:g}" for word, limit in limits if limit is not None)

    @property
    def bounds(self) -> tuple[float, float]:
        """The least and the greatest value, both in range."""
        low = -inf if self.minimum is None else self.minimum
        low = low if self.above is None else max(low, nextafter(self.above, inf))
        return low, inf if self.maximum is None else self.maximum


class _Reply(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    words: tuple[str, ...] = ()
    values: tuple[Quantity, ...] = ()
    list: tuple[Quantity, ...] = ()
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
    parameters: tuple[Quantity, ...] = ()
    optional: tuple[Quantity, ...] = ()
    phrase: str = ""
    kind: str = ""
    """The kind of a move, else empty."""
    in_tool: bool = False
    extension: bool = False
    name: str = ""

    def takes(self) -> str:
        """Return the parameters of the command by name and number: `x y z speed: 4 values`."""
        names = [name for name, _ in _in_series(self.parameters)]
        names += [f"({each.name})" for each in self.optional]
        more = f" or {len(self.parameters) + len(self.optional)}" if self.optional else ""
        return f"{' '.join(names)}: {len(self.parameters)}{more} value{'s' * (len(names) > 1)}"

    def usage(self) -> str:
        """Return the usage of the command, with units, ranges and reply."""
        takes = [f"[{self.phrase}]"] if self.phrase else []
        takes += [_with_unit(name, each) for name, each in _in_series(self.parameters)]
        takes += [f"({_with_unit(each.name, each)})" for each in self.optional]
        gives = " ".join(f"{name}[{each.unit}]" for name, each in _in_series(self.reply.values))
        for each in self.reply.list:
            gives = f"{_with_unit(each.name, each)} ..."
        gives = gives or " / ".join(self.reply.words) or "text"
        return f"{self.name}{' : ' if takes else ''}{' '.join(takes)} -> {gives}"


class Refusal(NamedTuple):
    """A line that is refused before it reaches the controller."""

    reason: str
    reply: str = ERROR
    code: int = COMMUNICATION_FAILURE


class Request(NamedTuple):
    """A parsed line: the command with its numbers or its words."""

    command: Command
    values: tuple[float, ...]
    phrase: str
    beyond: int = 0
    """Number of values after the last parameter."""
    in_degrees: str = ""
    """A remark if an angle is more than a turn, and so may be meant in degrees; else empty."""

    def with_hint(self, reason: str) -> str:
        """Return the reason of a refusal, with the remark."""
        return "; ".join(filter(None, (reason, self.in_degrees)))


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
            return Refusal(f"a line of more than {MAX_LINE_BYTES} bytes")
        spelling, _, rest = line.partition(b":")
        command = self.find(spelling)
        if command is None:
            if asked := _ASKS_HELP.match(line):
                return Request(self.commands["help"], (), " ".join(_words(line[asked.end() :])))
            return Refusal(self.why_unknown(line), UNKNOWN_COMMAND)
        if b":" in rest:
            return Refusal("more than one ':'", UNKNOWN_COMMAND)
        if not command.parameters:
            return Request(command, (), " ".join(_words(rest)) if command.phrase else "")
        commas = "; no commas: blanks between values, a point in a decimal"
        words, values, in_degrees = _split(rest), list[float](), ""
        has_optional = len(words) > len(command.parameters)
        if len(words) < len(command.parameters) + has_optional * len(command.optional):
            reason = f"{command.name} takes {command.takes()}, got {len(words)}"
            return Refusal(reason + commas * (b"," in rest))
        for (quantity, low, high), word in zip(self._ranges[command.name], words, strict=False):
            try:
                value = parse_decimal(word)
            except ValueError as fault:
                return Refusal(f"{quantity.name} = {fault}{commas * (b',' in word)}")
            if not low <= value <= high or (quantity.integer and value != int(value)):
                wanted = "a whole number" if low <= value <= high else quantity.range
                return Refusal(f"{quantity.name} = {quoted(word)}: expected {wanted}")
            if quantity.unit == "rad" and abs(value) > tau and not in_degrees:
                in_degrees = (
                    f"{quantity.name} = {value:.7g} is more than a turn: angles are in rad, not in degrees"
                )
            values.append(value)
        return Request(command, tuple(values), "", len(words) - len(values), in_degrees)

    def why_unknown(self, line: bytes) -> str:
        """Return the reason for which a line names no command."""
        spelling, colon, _ = line.partition(b":")
        words = _words(spelling)
        if not words:
            return "no command"
        if words[0].startswith("<"):
            return "no such command; messages in XML go to a robot with --protocol krc4"
        for count in range(len(words) - 1, 0, -1):
            command = self.commands.get(" ".join(words[:count]).lower())
            if command is not None and not colon and command.parameters:
                return f"expected a colon behind '{command.name}'"
        meant = self.meant(spelling)
        return f"no such command; did you mean {meant}" if meant else "no such command; help lists them"


@cache
def load_table(name: str) -> Table:
    """Return the table protocol/NAME.toml."""
    rows = tomllib.loads(data_folder("iiwa_sim.protocol").joinpath(f"{name}.toml").read_text("utf-8"))
    known = {name: row | {"name": name} for name, row in rows["value"].items()}

    def converted(row: dict[str, Any]) -> dict[str, Any]:
        """Put quantities in place of their names."""
        named = row.keys() & {"parameters", "optional", "values", "list"}
        return row | {key: [known[name] for name in row[key].split()] for key in named}

    return Table(
        {
            name: msgspec.convert(converted(row) | {"name": name, "reply": converted(row["reply"])}, Command)
            for name, row in rows["command"].items()
        }
    )


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


def helped(table: Table, phrase: str) -> str:
    """Return the answer to `help : PHRASE`.

    A command is answered by its usage, an error code by its meaning, another phrase by the names that are
    like it, no phrase by all commands. Raises `Refused` if no name is like the phrase, and for an unknown
    code.
    """
    if not phrase:
        hint = "help : lin move tells its usage, help : 3021 what an error code means"
        return f"{', '.join(table.commands)} ({hint})"
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


def _with_unit(name: str, quantity: Quantity) -> str:
    unit = "" if quantity.unit == "1" else quantity.unit
    return f"{name}[{', '.join(filter(None, (unit, quantity.range)))}]"


def _split(text: bytes) -> list[bytes]:
    return [word for word in text.replace(b"\t", b" ").split(b" ") if word]


def _words(text: bytes) -> list[str]:
    return [word.decode("ascii", "backslashreplace") for word in _split(text)]

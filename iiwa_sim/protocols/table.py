"""A protocol table: the commands of a line protocol, and how a line is parsed by them.

A line reads `command : parameters`. Letter case is ignored, any run of blanks and tabs counts as one blank. A
line that names no command (empty, `:`, more than one `:`) is answered `unknown command`, one with wrong
parameters (too few, no number, out of range) `error`. Values behind the last parameter are counted: whoever
carries out the request ignores or refuses them. Parameters behind a command that takes none are ignored.
Phrases, such as a name, are in UTF-8; all else is ASCII.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from importlib.resources import files
from math import inf, nan, nextafter, tau
from types import MappingProxyType
from typing import NamedTuple

import msgspec

from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, Refused
from iiwa_sim.protocols.decimals import NOT_DECIMAL, NotANumberError, parse_decimal, quoted
from iiwa_sim.protocols.lines import MAX_LINE_BYTES, OVERLONG

BETWEEN_PHRASES = "="
"""Stands in a line between two phrases of one command."""


class Quantity(NamedTuple):
    """A number on the wire: `above < value`, `minimum <= value`, `value <= maximum` where they are given."""

    name: str
    unit: str
    meaning: str
    above: float | None
    minimum: float | None
    maximum: float | None
    integer: bool

    @property
    def range(self) -> str:
        """The range as an inequality, such as `0 < speed <= 1`; empty where the table gives none."""
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
        """Why a word is refused that is no number in range."""
        try:
            value = parse_decimal(word)
        except NotANumberError as fault:
            return f"{self.name} = {fault}{commas(word)}"
        if self.integer and value != int(value):
            return f"{self.name} = {quoted(word)}: expected a whole number"
        parts = (
            f"above {self.above:g}" if self.above is not None else "",
            f"at least {self.minimum:g}" if self.minimum is not None else "",
            f"up to {self.maximum:g}" if self.maximum is not None else "",
        )
        return f"{self.name} = {quoted(word)}: expected {' and '.join(part for part in parts if part)}"


class Command(NamedTuple):
    """One command of the table.

    It takes numbers (`parameters`, and `optional` ones, all or none of them), words (`phrase` names them),
    words and then numbers, or nothing. `phrase` may name two, as `command = reply`, which a line has in the
    same form. It answers one of `reply_words`, numbers (`reply_values`), any number
    of the same (`reply_list`) or a line of prose.
    """

    name: str
    summary: str
    mode: str
    requirements: tuple[str, ...]
    extension: bool
    parameters: tuple[Quantity, ...]
    phrase: str
    reply_words: tuple[str, ...]
    reply_values: tuple[Quantity, ...]
    optional: tuple[Quantity, ...]
    reply_list: Quantity | None

    @property
    def phrases(self) -> tuple[str, ...]:
        """The names of its phrases, in the order of a line."""
        return tuple(each.strip() for each in self.phrase.split(BETWEEN_PHRASES)) if self.phrase else ()

    def takes(self) -> str:
        """The parameters of the command by name and number: `x y z speed: 4 values`."""
        names = [each.name for each in _in_series(self.parameters)]
        names += [f"({each.name})" for each in self.optional]
        more = f" or {len(self.parameters) + len(self.optional)}" if self.optional else ""
        phrase = f"{self.phrase} and " if self.phrase else ""
        plural = "" if len(self.parameters) == 1 and not more else "s"
        return f"{phrase}{' '.join(names)}: {len(self.parameters)}{more} value{plural}"

    def usage(self) -> str:
        """How to write the command, with units and ranges, and what it answers."""
        takes = " ".join(f"{each.name}[{_unit_and_range(each)}]" for each in _in_series(self.parameters))
        takes += "".join(f" ({each.name}[{_unit_and_range(each)}])" for each in self.optional)
        takes = " ".join(part for part in (f"[{self.phrase}]" if self.phrase else "", takes) if part)
        gives = " ".join(f"{each.name}[{each.unit}]" for each in _in_series(self.reply_values))
        if self.reply_list is not None:
            gives = f"{self.reply_list.name}[{_unit_and_range(self.reply_list)}] ..."
        gives = gives or " / ".join(self.reply_words) or "text"
        return f"{self.name}{' : ' if takes else ''}{takes} -> {gives}"


def _in_series(quantities: Sequence[Quantity]) -> list[Quantity]:
    """The quantities, with j0 to j6 merged into `j0..j6` where they differ only in their number."""
    series: list[list[Quantity]] = []
    for each in quantities:
        if series and _follows(series[-1][-1], each):
            series[-1].append(each)
        else:
            series.append([each])
    return [
        run[0] if len(run) == 1 else run[0]._replace(name=f"{run[0].name}..{run[-1].name}") for run in series
    ]


def _follows(one: Quantity, other: Quantity) -> bool:
    stem = one.name.rstrip("0123456789")
    number = one.name.removeprefix(stem)
    return (
        number != ""
        and other.name == f"{stem}{int(number) + 1}"
        and one._replace(name="", meaning="") == other._replace(name="", meaning="")
    )


def _unit_and_range(quantity: Quantity) -> str:
    unit = "" if quantity.unit == "1" else quantity.unit
    return ", ".join(part for part in (unit, quantity.range) if part)


def commas(text: bytes) -> str:
    """A hint for parameters with commas."""
    return "; no commas: blanks between values, a point in a decimal" if b"," in text else ""


LONGEST = 40
"""Longest spelling that is looked up; longer ones are no slips and would cost too much in a flood of
noise."""


class Names:
    """Finds the name that differs in one letter: wrong, missing, superfluous, or swapped with the next.
    Blanks and letter case do not count."""

    def __init__(self, names: Iterable[str]) -> None:
        # Two words that differ in one letter are equal after removing one letter from each.
        self._by_rest: dict[str, str] = {}
        for name in names:
            for rest in _rests(name.replace(" ", "")):
                self._by_rest.setdefault(rest, name)

    def nearest(self, spelling: bytes) -> str | None:
        """The name that may be meant; None if none is near."""
        if len(spelling) > LONGEST:
            return None
        written = spelling.decode("ascii", "replace").replace(" ", "").replace("\t", "").lower()
        found = (self._by_rest[rest] for rest in _rests(written) if rest in self._by_rest)
        return next(found, None)


def _rests(word: str) -> Iterator[str]:
    """The word, and all words that result from removing one letter."""
    yield word
    for place in range(len(word)):
        yield word[:place] + word[place + 1 :]


UNKNOWN_COMMAND = "unknown command"
ERROR = "error"

_HELP = "help"
_ASKS_HELP = re.compile(rb"[ \t]*(?:help(?=[ \t?])|\?)[ \t?]*:?", re.IGNORECASE)  # `help lin move`, `?`
_CACHED_LINES = 1024
_LONGEST_ARM_M = 3.0
_IN_RAD = "angles are in rad, not in degrees"


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
    """A remark where an angle is more than a turn, and so may be meant in degrees; else empty."""

    @property
    def phrases(self) -> tuple[str, ...]:
        """The phrases of the line, one for each that the command names; fewer where a sign is missing."""
        between = len(self.command.phrases) - 1
        return tuple(each.strip() for each in self.phrase.split(BETWEEN_PHRASES, between))

    def too_much(self) -> Refusal:
        """The refusal for values after the last parameter."""
        count = len(self.values) + self.beyond
        return _error(f"{self.command.name} takes {self.command.takes()}, got {count}")


class Table:
    """The commands of one protocol, by name in lower case, in the order of the table."""

    def __init__(self, commands: dict[str, Command]) -> None:
        self.commands = commands
        self._names = Names(commands)
        self._ranges = {
            command.name: [(each, *each.bounds) for each in (*command.parameters, *command.optional)]
            for command in commands.values()
        }
        self._by_spelling: dict[bytes, Command] = {}
        self._lines: dict[bytes, Request | Refusal] = {}
        self._forget_lines()

    def parse(self, line: bytes) -> Request | Refusal:
        """Parse a line, without its end; OVERLONG stands for one that was too long."""
        known = self._lines.get(line)
        return known if known is not None else self._parse(line)

    def find(self, spelling: bytes) -> Command | None:
        """The command with this name; letter case and runs of blanks do not count."""
        command = self._by_spelling.get(spelling)
        if command is None:
            command = self.commands.get(" ".join(_words(spelling)).lower())
            if command is not None:
                if len(self._by_spelling) >= _CACHED_LINES:
                    self._by_spelling.clear()
                self._by_spelling[spelling] = command
        return command

    def meant(self, spelling: bytes) -> str | None:
        """The name of the command that a misspelt name may stand for."""
        return self._names.nearest(spelling)

    def _parse(self, line: bytes) -> Request | Refusal:
        spelling, colon, rest = line.partition(b":")
        command = self.find(spelling)
        if command is None:
            if _HELP in self.commands and (asked := _ASKS_HELP.match(line)):
                return Request(self.commands[_HELP], (), _phrase(_split(line[asked.end() :])))
            return _unknown(self._why_unknown(line))
        if colon and b":" in rest:
            return _unknown("more than one ':'")
        if not command.parameters:
            if command.phrase:
                return Request(command, (), _phrase(_split(rest)))
            return self._remember(line, Request(command, (), ""))
        words = _split(rest)
        quantities = command.parameters
        phrase = ""
        if command.phrase:  # the part of the line that holds numbers
            named, words = words[: -len(quantities)], words[-len(quantities) :]
            if not named:
                return _error(f"{command.name} takes {command.takes()}")
            phrase = _phrase(named)
        if len(words) > len(quantities):
            quantities += command.optional
        if len(words) < len(quantities):
            return _error(f"{command.name} takes {command.takes()}, got {len(words)}{commas(rest)}")
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
                in_degrees = f"{quantity.name} = {value:.7g} is more than a turn: {_IN_RAD}"
            values.append(value)
        request = Request(command, tuple(values), phrase, len(words) - len(values), in_degrees)
        if (
            phrase
            and len(command.phrases) > 1
            and not (len(request.phrases) == len(command.phrases) and all(request.phrases))
        ):
            return _error(f"{command.name} takes {command.takes()}")
        return request

    def _why_unknown(self, line: bytes) -> str:
        spelling, colon, _ = line.partition(b":")
        if not line.strip(b" \t:"):
            return "empty line"
        words = _words(spelling)
        if not words:
            return "no command before the colon"
        for count in range(len(words) - 1, 0, -1):
            command = self.commands.get(" ".join(words[:count]).lower())
            if command is not None and not colon and (command.parameters or command.phrase):
                return f"expected a colon behind '{command.name}'"
        if words[0].startswith("<"):
            return "no such command; messages in XML go to a robot with --protocol krc4"
        meant = self._names.nearest(spelling)
        return f"no such command; did you mean {meant}" if meant else "no such command; help lists them"

    def _remember(self, line: bytes, request: Request) -> Request:
        if len(self._lines) >= _CACHED_LINES:
            self._forget_lines()
        self._lines[line] = request
        return request

    def _forget_lines(self) -> None:
        self._lines.clear()
        self._lines[OVERLONG] = _error(f"a line of more than {MAX_LINE_BYTES} bytes")


def _split(text: bytes) -> list[bytes]:
    return [word for word in text.replace(b"\t", b" ").split(b" ") if word]


def _words(text: bytes) -> list[str]:
    return [word.decode("ascii", "backslashreplace") for word in _split(text)]


def _phrase(words: list[bytes]) -> str:
    return " ".join(word.decode("utf-8", "backslashreplace") for word in words)


def _in_metres(request: Request) -> str:
    """A hint for a place within the foot of the robot, which may be meant in metres; empty without one."""
    names = [each.name for each in request.command.parameters[:3]]
    place = request.values[:3]
    if names == ["x", "y", "z"] and any(place) and all(abs(each) <= _LONGEST_ARM_M for each in place):
        shown = " ".join(f"{each:.7g}" for each in place)
        return f"{shown} is within the robot's foot: places are in mm, not in m"
    return ""


def with_hint(reason: str, request: Request) -> str:
    """The reason of a refusal, with a hint where angles may be in degrees or places in metres."""
    return "; ".join(each for each in (reason, request.in_degrees, _in_metres(request)) if each)


def _unknown(reason: str) -> Refusal:
    return Refusal(UNKNOWN_COMMAND, COMMUNICATION_FAILURE, reason)


def _error(reason: str) -> Refusal:
    return Refusal(ERROR, COMMUNICATION_FAILURE, reason)


class TableError(Exception):
    """A protocol table is wrong. One line names file, key and what was expected."""


class _ValueRow(msgspec.Struct, forbid_unknown_fields=True):
    unit: str
    meaning: str
    above: float | None = None
    minimum: float | None = None
    maximum: float | None = None
    integer: bool = False


class _ReplyRow(msgspec.Struct, forbid_unknown_fields=True):
    words: tuple[str, ...] = ()
    values: str = ""
    list: str = ""
    prose: bool = False


class _CommandRow(msgspec.Struct, forbid_unknown_fields=True):
    summary: str
    mode: str
    requirements: list[str]
    reply: _ReplyRow
    parameters: str = ""
    each_joint: str = ""
    optional: str = ""
    phrase: str = ""
    extension: bool = False


class _TableRows(msgspec.Struct, forbid_unknown_fields=True):
    title: str
    source: str
    value: dict[str, _ValueRow]
    command: dict[str, _CommandRow]


@cache
def load_table(name: str, joints: int = 0) -> Table:
    """The table protocol/NAME.toml, for a robot with `joints` joints.

    Raises TableError if the table is wrong, or if it depends on the number of joints and none was given.
    """
    text = files("iiwa_sim.protocol").joinpath(f"{name}.toml").read_bytes()
    return read_table(text, f"{name}.toml", joints)


def read_table(text: bytes, source: str, joints: int = 0) -> Table:
    """The table of a TOML text; `source` names the text in errors."""
    try:
        rows = msgspec.toml.decode(text, type=_TableRows)
    except msgspec.DecodeError as fault:
        raise TableError(f"{source}: {fault}") from None
    return Table(
        {name: _command(source, name, row, rows.value, joints) for name, row in rows.command.items()}
    )


def _command(source: str, name: str, row: _CommandRow, values: dict[str, _ValueRow], joints: int) -> Command:
    def quantities(key: str, names: str) -> tuple[Quantity, ...]:
        for each in names.split():
            if each not in values:
                raise TableError(f"{source}: command.{name}.{key}: {each} has no row in [value]")
        return tuple(Quantity(each, *msgspec.structs.astuple(values[each])) for each in names.split())

    if name != " ".join(name.lower().split()):
        raise TableError(f"{source}: command.{name}: expected a name in lower case with single blanks")
    parameters = quantities("parameters", row.parameters)
    if row.each_joint:
        listed = quantities("each_joint", row.each_joint)
        if len(listed) > 1 or parameters:
            raise TableError(f"{source}: command.{name}.each_joint: expected one value, and no parameters")
        if not joints:
            raise TableError(f"{source}: command.{name}.each_joint: expected to be told how many there are")
        parameters = tuple(listed[0]._replace(name=f"{listed[0].name}{place}") for place in range(joints))
    if row.optional and not row.parameters:
        raise TableError(f"{source}: command.{name}.optional: expected parameters, too")
    if row.optional and row.phrase:
        raise TableError(f"{source}: command.{name}.optional: expected no phrase with it")
    reply = row.reply
    if (bool(reply.words), bool(reply.values), bool(reply.list), reply.prose).count(True) != 1:
        raise TableError(f"{source}: command.{name}.reply: expected one of words, values, list, prose")
    listed = quantities("reply.list", reply.list)
    if len(listed) > 1:
        raise TableError(f"{source}: command.{name}.reply.list: expected one value")
    return Command(
        name=name,
        summary=row.summary,
        mode=row.mode,
        requirements=tuple(row.requirements),
        extension=row.extension,
        parameters=parameters,
        phrase=row.phrase,
        reply_words=reply.words,
        reply_values=quantities("reply.values", reply.values),
        optional=quantities("optional", row.optional),
        reply_list=listed[0] if listed else None,
    )


class ErrorCode(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One row of the table; each value begins in lower case and ends without a full stop."""

    meaning: str
    cause: str
    """What usually causes it."""
    remedy: str
    """What to do."""

    def told(self, code: int) -> str:
        """All of it in one line."""
        return f"{code}: {self.meaning}; usual cause: {self.cause}; what to do: {self.remedy}"


@cache
def load_error_codes() -> Mapping[int, ErrorCode]:
    """The rows by code, in the order of the table. Raises TableError where it is wrong."""
    return read_error_codes(files("iiwa_sim.protocol").joinpath("errors.toml").read_bytes())


def read_error_codes(text: bytes) -> Mapping[int, ErrorCode]:
    """The rows from their TOML text."""
    try:
        rows = msgspec.toml.decode(text, type=dict[str, ErrorCode])
    except msgspec.DecodeError as fault:
        raise TableError(f"errors.toml: {fault}") from None
    for number in rows:
        if not number.isdecimal():
            raise TableError(f"errors.toml: {number}: expected a number")
    return MappingProxyType({int(number): row for number, row in rows.items()})


EXTENSIONS = "extensions"
"""`help : extensions` names the commands that the original does not know."""


def helped(table: Table, phrase: str, example: str) -> str:
    """What `help : PHRASE` answers: the usage of that command, or the names that are like the phrase.

    Of an error code it tells meaning, usual cause and what to do. Without a phrase the commands are named,
    for `extensions` those that are some; `example` is one that takes parameters. Raises `Refused` where no
    name is like the phrase, and for a number that is no code.
    """
    if not phrase:
        return _overview(table, example)
    if phrase.lower() == EXTENSIONS:
        return f"{EXTENSIONS}: {_named(table, extensions=True) or 'none'}"
    if phrase.isdecimal():
        return _error_code(phrase)
    command = table.commands.get(phrase.lower())
    if command is not None:
        return _usage(command)
    alike = _alike(table, phrase.lower())
    if not alike:
        raise Refused(COMMUNICATION_FAILURE, "no such command")
    return f"alike: {alike}"


def _overview(table: Table, example: str) -> str:
    """The names of the commands in one line, and how to learn more."""
    more = f", help : {EXTENSIONS} more of them" if _named(table, extensions=True) else ""
    hint = f"help : {example} tells its usage{more}, help : 3021 what a code of get error means"
    return f"{_named(table, extensions=False)} ({hint})"


def _named(table: Table, *, extensions: bool) -> str:
    return ", ".join(command.name for command in table.commands.values() if command.extension is extensions)


def _error_code(phrase: str) -> str:
    """What a code means."""
    codes = load_error_codes()
    for code, row in codes.items():
        if phrase == str(code):
            return row.told(code)
    raise Refused(COMMUNICATION_FAILURE, f"no such error code: there are {', '.join(map(str, codes))}")


def _usage(command: Command) -> str:
    """How to write one command and what it does."""
    return f"{command.usage()}; {command.summary}{' (extension)' if command.extension else ''}"


def _alike(table: Table, phrase: str) -> str:
    """The names of commands with these letters, or of the one that differs in a letter; empty for none."""
    return ", ".join(name for name in table.commands if phrase in name) or table.meant(phrase.encode()) or ""

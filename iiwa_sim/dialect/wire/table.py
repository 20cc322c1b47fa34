"""A protocol table: the commands of a line protocol, and how a line is parsed by them.

A line reads `command : parameters`. Letter case is ignored, any run of blanks and tabs counts as one blank. A
line that names no command (empty, `:`, more than one `:`) is answered `unknown command`, one with wrong
parameters (too few, no number, out of range) `error`. Values behind the last parameter are counted: whoever
carries out the request ignores or refuses them. Parameters behind a command that takes none are ignored.
"""

from collections.abc import Sequence
from math import isfinite, tau
from typing import NamedTuple

from iiwa_sim.controller.errors import COMMUNICATION_FAILURE
from iiwa_sim.dialect.wire.decimals import DECIMAL, quoted
from iiwa_sim.dialect.wire.lines import MAX_LINE_BYTES, OVERLONG
from iiwa_sim.dialect.wire.names import Names

UNKNOWN_COMMAND = "unknown command"
ERROR = "error"

BETWEEN_PHRASES = "="
"""Stands in a line between two phrases of one command."""

_CACHED_LINES = 1024
_LONGEST_ARM_M = 3.0
_IN_RAD = "angles are in rad, not in degrees"


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

    def expectation(self, value: float) -> str:
        """Message for a value that is out of range; empty if it is in range."""
        if not isfinite(value):
            return "expected a finite number"
        if self.integer and value != int(value):
            return "expected a whole number"
        too_low = (self.above is not None and value <= self.above) or (
            self.minimum is not None and value < self.minimum
        )
        if not too_low and (self.maximum is None or value <= self.maximum):
            return ""
        parts = (
            f"above {self.above:g}" if self.above is not None else "",
            f"at least {self.minimum:g}" if self.minimum is not None else "",
            f"up to {self.maximum:g}" if self.maximum is not None else "",
        )
        return f"expected {' and '.join(part for part in parts if part)}"


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
        """Its parameters by name and number: `x y z speed: 4 values`."""
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
        """Its phrases, one for each that the command names; fewer where a sign between them is missing."""
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
            return _unknown(self._why_unknown(line))
        if colon and b":" in rest:
            return _unknown("more than one ':'")
        if not command.parameters:
            if command.phrase:
                return Request(command, (), " ".join(_words(rest)))
            return self._remember(line, Request(command, (), ""))
        words = rest.replace(b"\t", b" ").split(b" ")
        words = [word for word in words if word]
        quantities = command.parameters
        phrase = ""
        if command.phrase:  # the part of the line that holds numbers
            named, words = words[: -len(quantities)], words[-len(quantities) :]
            if not named:
                return _error(f"{command.name} takes {command.takes()}")
            phrase = " ".join(word.decode("ascii", "backslashreplace") for word in named)
        if len(words) > len(quantities):
            quantities += command.optional
        if len(words) < len(quantities):
            return _error(f"{command.name} takes {command.takes()}, got {len(words)}{_commas(rest)}")
        values, in_degrees = [], ""
        for quantity, word in zip(quantities, words, strict=False):
            if not DECIMAL.fullmatch(word):
                return _error(f"{quantity.name} = {quoted(word)}: expected a number{_commas(word)}")
            value = float(word)
            if expected := quantity.expectation(value):
                return _error(f"{quantity.name} = {quoted(word)}: {expected}")
            if quantity.unit == "rad" and abs(value) > tau and not in_degrees:
                in_degrees = f"{quantity.name} = {value:.7g} is more than a turn: {_IN_RAD}"
            values.append(value)
        request = Request(command, tuple(values), phrase, len(words) - len(values), in_degrees)
        if len(command.phrases) > 1 and not (
            len(request.phrases) == len(command.phrases) and all(request.phrases)
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
            return "no such command; messages in XML go to a robot with --dialect krc4"
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


def _words(text: bytes) -> list[str]:
    return [word for word in text.replace(b"\t", b" ").decode("ascii", "backslashreplace").split(" ") if word]


def _in_metres(request: Request) -> str:
    """A hint for a place within the foot of the robot, which may be meant in metres; empty without one."""
    names = [each.name for each in request.command.parameters[:3]]
    place = request.values[:3]
    if names == ["x", "y", "z"] and any(place) and all(abs(each) <= _LONGEST_ARM_M for each in place):
        shown = " ".join(f"{each:.7g}" for each in place)
        return f"{shown} is within the robot's foot: places are in mm, not in m"
    return ""


def with_hint(reason: str, request: Request) -> str:
    """Why a request is refused, and what to say of its angles and its place."""
    return "; ".join(each for each in (reason, request.in_degrees, _in_metres(request)) if each)


def _commas(text: bytes) -> str:
    """A hint for parameters with commas."""
    return "; no commas: blanks between values, a point in a decimal" if b"," in text else ""


def _unknown(reason: str) -> Refusal:
    return Refusal(UNKNOWN_COMMAND, COMMUNICATION_FAILURE, reason)


def _error(reason: str) -> Refusal:
    return Refusal(ERROR, COMMUNICATION_FAILURE, reason)

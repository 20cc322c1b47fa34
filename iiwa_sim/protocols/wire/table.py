"""A protocol table: the commands of a line protocol, and how a line is parsed by them.

A line reads `command : parameters`. Letter case is ignored, any run of blanks and tabs counts as one blank. A
line that names no command (empty, `:`, more than one `:`) is answered `unknown command`, one with wrong
parameters (too few, no number, out of range) `error`. Values behind the last parameter are counted: whoever
carries out the request ignores or refuses them. Parameters behind a command that takes none are ignored.
Phrases, such as a name, are in UTF-8; all else is ASCII.
"""

from math import nan, tau
from typing import NamedTuple

from iiwa_sim.controller.errors import COMMUNICATION_FAILURE
from iiwa_sim.protocols.wire.command import BETWEEN_PHRASES, Command, commas
from iiwa_sim.protocols.wire.decimals import NOT_DECIMAL
from iiwa_sim.protocols.wire.lines import MAX_LINE_BYTES, OVERLONG
from iiwa_sim.protocols.wire.names import Names

UNKNOWN_COMMAND = "unknown command"
ERROR = "error"

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

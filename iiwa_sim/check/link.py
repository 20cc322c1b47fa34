"""Probes, findings, and the connection to a server that may be a real robot.

Without permission nothing is sent that could move the robot.
"""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import Enum
from typing import NamedTuple

from iiwa_sim.client.connection import Connection
from iiwa_sim.protocols.decimals import readable
from iiwa_sim.protocols.table import load_table
from iiwa_sim.transcript.lines import Kind, Transcript
from iiwa_sim.transcript.replay import connected
from iiwa_sim.transcript.texts import command_of, wire_bytes

TIMEOUT_S = 3.0
"""Seconds for a reply, also of a server that needs a second to turn to its next client."""
COMMANDS = load_table("iiwa").commands
HARMLESS = frozenset(
    name for name in COMMANDS if name in ("hello", "help", "stop", "bye") or name.startswith(("get ", "is "))
)
"""Commands that change neither the robot's motion, nor its outputs, nor its errors."""
NONSENSE = frozenset({"", "get", "get status now", "no such command"})
"""Lines that no server should know."""

_END = re.compile(rb"\r\n|\n\r|\r|\n")


class Verdict(Enum):
    """Whose behaviour the server shows. The values stand in the report."""

    ORIGINAL = "as the original"
    OURS = "as iiwa-sim"
    DEVIATION = "DEVIATION"
    UNTRIED = "not tried"


class Finding(NamedTuple):
    """The verdict on a probe, and what was observed."""

    verdict: Verdict
    seen: str = ""


SAME, OURS = Finding(Verdict.ORIGINAL), Finding(Verdict.OURS)


def deviates(seen: str) -> Finding:
    """The server behaves neither like the original nor like iiwa-sim."""
    return Finding(Verdict.DEVIATION, seen)


def untried(why: str) -> Finding:
    """The probe could not be made."""
    return Finding(Verdict.UNTRIED, why)


def same_unless(wrong: list[str]) -> Finding:
    """The server behaves like the original, unless anything is wrong."""
    return deviates("; ".join(wrong)) if wrong else SAME


class Probe(NamedTuple):
    """One question to a server, with what is known of the original."""

    event: str
    """The input, or what happens."""
    original: str
    """The original's behaviour; empty for a dialogue, which tells it line by line."""
    ask: Callable[["Link"], Finding]
    """Asks the server; raises OSError for a reply that does not come."""
    ours: str = ""
    """The behaviour of iiwa-sim and its reason; empty if it is the original's."""
    moves: bool = False
    """True if it needs a move command."""


class NotAllowed(Exception):
    """An internal error: a line that may move the robot was about to be sent without permission."""


def commands_of(transcript: Transcript) -> list[str]:
    """Return the commands that a transcript sends, line by line."""
    return [_command(wire_bytes(step.text)) for step in transcript.steps if step.kind is Kind.SAID]


class Link:
    """A server, and what may be sent to it."""

    def __init__(self, host: str, port: int, allow_motion: bool, timeout_s: float = TIMEOUT_S) -> None:
        self.host = host
        self.port = port
        self.allow_motion = allow_motion
        self.timeout_s = timeout_s
        self._known: dict[str, bool] = {}

    @contextmanager
    def talk(self) -> Iterator["Talk"]:
        """A new connection, closed at the end. Raises TranscriptFault if there can be none."""
        talk = Talk(self, connected(self.host, self.port, self.timeout_s))
        try:
            yield talk
        finally:
            talk.connection.close()

    def knows(self, command: str) -> bool:
        """Return True if the server has a harmless command: others are answered `unknown command`."""
        if command not in self._known:
            with self.talk() as talk:
                self._known[command] = talk.ask(command) != "unknown command"
        return self._known[command]


class Talk:
    """One connection, on which forbidden lines are not sent."""

    def __init__(self, link: Link, connection: Connection) -> None:
        self.connection = connection
        self._link = link
        self._line = b""

    def send(self, data: bytes) -> None:
        """Send bytes unchanged; a line may be sent in pieces. Raises NotAllowed before anything is sent."""
        *lines, self._line = _END.split(self._line + data)
        commands = [_command(line) for line in lines]
        begun = _command(self._line)
        harmless = (HARMLESS | NONSENSE).issuperset(commands) and any(
            name.startswith(begun) for name in HARMLESS
        )
        if not (harmless or self._link.allow_motion):
            raise NotAllowed(data.decode("ascii", "backslashreplace"))
        self.connection.send(data)

    def reply(self, timeout_s: float | None = None) -> str:
        """Return the next line, escaped. Raises OSError."""
        return readable(self.connection.read_line(timeout_s))

    def ask(self, line: str) -> str:
        """Send a line, with the line end of most drivers, and return its reply. Raises OSError."""
        self.send(line.encode() + b"\r\n")
        return self.reply()

    def is_in_step(self) -> bool:
        """Return True if the next reply belongs to the next line."""
        try:
            return self.ask("hello") == "hello"
        except OSError:
            return False

    def numbers(self, command: str) -> list[float]:
        """Return the numbers in the reply to a command. Raises OSError for another reply."""
        reply = self.ask(command)
        try:
            return [float(word) for word in reply.split()]
        except ValueError:
            raise OSError(f"expected numbers for '{command}', got '{reply}'") from None


def _command(line: bytes) -> str:
    return command_of(line.decode("ascii", "backslashreplace"))

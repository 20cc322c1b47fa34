"""Probes, their verdicts, and the connection to a server that may be a real robot.

Without permission nothing is sent that could move the robot.
"""

import re
from collections.abc import Callable
from contextlib import closing
from enum import Enum
from typing import NamedTuple

from iiwa_sim.client.connection import Connection
from iiwa_sim.protocols.decimals import readable
from iiwa_sim.protocols.table import load_table
from iiwa_sim.transcript.replay import connected
from iiwa_sim.transcript.texts import command_of

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


class NotAllowed(Exception):
    """An internal error: a line that may move the robot was about to be sent without permission."""


class Talk:
    """One connection, on which forbidden lines are not sent."""

    def __init__(self, connection: Connection, allow_motion: bool) -> None:
        self.connection = connection
        self._allow_motion = allow_motion
        self._line = b""

    def close(self) -> None:
        """Close the connection."""
        self.connection.close()

    def send(self, data: bytes) -> None:
        """Send bytes unchanged; a line may be sent in pieces. Raises NotAllowed before anything is sent."""
        *lines, self._line = _END.split(self._line + data)
        begun = _command(self._line)
        harmless = not any(map(moves, lines)) and any(name.startswith(begun) for name in HARMLESS)
        if not (harmless or self._allow_motion):
            raise NotAllowed(data.decode("ascii", "backslashreplace"))
        self.connection.send(data)

    def reply(self, timeout_s: float | None = None) -> str:
        """Return the next line, escaped. Raises OSError."""
        return readable(self.connection.read_line(timeout_s))

    def ask(self, line: str) -> str:
        """Send a line, with the line end of most drivers, and return its reply. Raises OSError."""
        self.send(line.encode() + b"\r\n")
        return self.reply()


class Link(NamedTuple):
    """A server, and what may be sent to it."""

    host: str
    port: int
    allow_motion: bool
    timeout_s: float = TIMEOUT_S

    def talk(self) -> "closing[Talk]":
        """Return the context of a new connection. Raises TranscriptFault if there can be none."""
        return closing(Talk(connected(self.host, self.port, self.timeout_s), self.allow_motion))

    def knows(self, command: str) -> bool:
        """Return True if the server has a harmless command: others are answered `unknown command`."""
        with self.talk() as talk:
            return talk.ask(command) != "unknown command"


class Probe(NamedTuple):
    """One question to a server, with what is known of the original."""

    event: str
    """The input, or what happens."""
    original: str
    """The original's behaviour; empty for a dialogue, which tells it line by line."""
    ask: Callable[[Link], Finding | str]
    """Asks the server; a text is a deviation, and so is an OSError, as for a reply that does not come."""
    ours: str = ""
    """The behaviour of iiwa-sim and its reason; empty if it is the original's."""


def moves(line: bytes) -> bool:
    """Return True if a line could move the robot, or change its outputs or errors."""
    return _command(line) not in HARMLESS | NONSENSE


def _command(line: bytes) -> str:
    return command_of(line.decode("ascii", "backslashreplace"))

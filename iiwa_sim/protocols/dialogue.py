"""The lines of all connections, for listeners such as transcripts and reports of failed tests.

A line is reported when it is carried out, with its reply right after it, so a reply belongs to the line
before it of the same session even if lines were pipelined. Telnet's own commands are not reported.
"""

import time
from collections.abc import Callable
from enum import Enum
from typing import NamedTuple


class Direction(Enum):
    """The direction of a line. The values are the marks of `protocol/transcripts`."""

    FROM_CLIENT = ">"
    TO_CLIENT = "<"
    EVENT = "#"
    """Something that happens, said by nobody."""
    ON_WIRE = "~"
    """What a wire fault makes of the reply before it."""


class DialogueLine(NamedTuple):
    """One line of a dialogue."""

    session: str
    """HOST:PORT of the client, or another name for whatever the line is about."""
    direction: Direction
    text: str
    """The line without its end, escaped to printable ASCII. KRC4 messages are in the form of
    `protocols/krc4_xml.py`."""
    tick: int
    """The robot's tick, of which there are 1 / tick_s in a simulated second."""
    instant_ns: int
    """Real time by `time.monotonic_ns`."""
    reason: str = ""
    """Why a line was refused, with the reply to it; empty for all others."""
    protocol: str = ""
    """The protocol of a client that has just connected, one of `iiwa_sim.protocols.ports`."""


Listener = Callable[[DialogueLine], None]


class Dialogue:
    """Calls its listeners with each line in order, inside the event loop.

    Exceptions of a listener are not caught: a listener must not fail.
    """

    def __init__(self, tick: Callable[[], int]) -> None:
        """`tick` returns the robot's present tick."""
        self.listeners: list[Listener] = []
        self._tick = tick

    def exchange(self, session: str, line: str, reply: str, reason: str = "") -> None:
        """A client's line and its reply; the `reason` where that is a refusal."""
        self._tell(session, Direction.FROM_CLIENT, line)
        self._tell(session, Direction.TO_CLIENT, reply, reason)

    def event(self, session: str, text: str, protocol: str = "") -> None:
        """Something that is no line, such as a client that connects (in `protocol`) or disconnects."""
        self._tell(session, Direction.EVENT, text, protocol=protocol)

    def on_wire(self, session: str, text: str) -> None:
        """What goes over the wire instead of the reply before."""
        self._tell(session, Direction.ON_WIRE, text)

    def _tell(
        self, session: str, direction: Direction, text: str, reason: str = "", protocol: str = ""
    ) -> None:
        if self.listeners:
            said = DialogueLine(session, direction, text, self._tick(), time.monotonic_ns(), reason, protocol)
            for listener in self.listeners:
                listener(said)

"""What is said on all connections, for whoever wants to hear it: transcripts, reports of failed tests.

A line is told when it is carried out and its reply right behind it, so a reply belongs to the line before it
of the same session, also where lines were sent in a hurry. Telnet's own commands are not told.
"""

import time
from collections.abc import Callable
from enum import Enum
from typing import NamedTuple


class Direction(Enum):
    """Who speaks. The values are the marks of `protocol/transcripts`."""

    FROM_CLIENT = ">"
    TO_CLIENT = "<"
    EVENT = "#"
    """Nobody: something happens."""
    ON_WIRE = "~"
    """Nobody: what a fault makes of the reply before on its way."""


class Said(NamedTuple):
    """One line of a dialogue."""

    session: str
    """HOST:PORT of the client, or the name of whatever else speaks or is met with."""
    direction: Direction
    text: str
    """Without its line end; what is not printable ASCII is escaped. KRC4 messages: see `krc4_short`."""
    tick: int
    """The robot's, of which there are 1 / tick_s in a simulated second."""
    instant_ns: int
    """Of `time.monotonic_ns`."""
    dialect: str = ""
    """Of a client that has just connected: what it speaks, one of `iiwa_sim.dialect.ports`."""


Listener = Callable[[Said], None]


class Dialogue:
    """Tells its listeners what is said, in the order in which it happens, inside the loop.

    What a listener raises is not caught: it must not fail.
    """

    def __init__(self, tick: Callable[[], int]) -> None:
        """`tick` gives the robot's present one."""
        self.listeners: list[Listener] = []
        self._tick = tick

    def exchange(self, session: str, line: str, reply: str) -> None:
        """A client's line and its reply."""
        self._tell(session, Direction.FROM_CLIENT, line)
        self._tell(session, Direction.TO_CLIENT, reply)

    def event(self, session: str, text: str, dialect: str = "") -> None:
        """Something that is no line, such as a client that comes, in its dialect, or goes."""
        self._tell(session, Direction.EVENT, text, dialect)

    def on_wire(self, session: str, text: str) -> None:
        """What goes over the wire in place of the reply before."""
        self._tell(session, Direction.ON_WIRE, text)

    def _tell(self, session: str, direction: Direction, text: str, dialect: str = "") -> None:
        if self.listeners:
            said = Said(session, direction, text, self._tick(), time.monotonic_ns(), dialect)
            for listener in self.listeners:
                listener(said)

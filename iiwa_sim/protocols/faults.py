"""Canned replies of the iiwa's protocol: what a test has answered in place of the robot.

The command is not carried out. Replies that are set for one command take its lines in the order in which they
were set, each as many as it is for; then the robot answers again.
"""

import re
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from random import Random
from typing import NamedTuple, Protocol

from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.protocols.lines import WONT_TIMING_MARK
from iiwa_sim.protocols.table import load_table
from iiwa_sim.wording import harmless, shortened

UNTIL_CLEARED = 0
"""Given in place of a number of lines: until it is cleared."""
_PROTOCOL = "iiwa"


@dataclass
class _Reply:
    text: str
    left: int | None  # lines; None for any number


class CannedReplies:
    """Replies that a test has laid down for one robot, for all its clients together."""

    def __init__(self) -> None:
        self.heard = True
        """Whether the robot speaks the iiwa's protocol."""
        self._replies: dict[str, deque[_Reply]] = {}
        self.any = False
        """Whether one is set: asked for at each line."""

    def set(self, command: str, reply: str, times: int = 1) -> None:
        """Have the next `times` lines of a command answered by `reply`, 0 for all until `clear`.

        Raises ValueError for a command there is not, a reply that is not one line of printable ASCII, a
        number below 0, and where the iiwa's protocol is not spoken: KRC4 messages cannot be canned.
        """
        if not self.heard:
            raise ValueError(f"reply to {_quoted(command)}: expected a robot that speaks {_PROTOCOL}")
        table = load_table(_PROTOCOL)
        known = table.find(command.encode("ascii", "backslashreplace"))
        if known is None:
            meant = table.meant(command.encode("ascii", "backslashreplace"))
            hint = f"; did you mean {meant}" if meant else ""
            raise ValueError(f"command {_quoted(command)}: expected a command of the robot's port{hint}")
        if not (reply.isascii() and reply.isprintable()):
            raise ValueError(f"reply {_quoted(reply)}: expected one line of printable ASCII")
        if times < 0:
            raise ValueError(f"times={times}: expected 0 or more")
        waiting = self._replies.setdefault(known.name, deque())
        waiting.append(_Reply(reply, times or None))
        self.any = True

    def take(self, command: str) -> str | None:
        """The reply to the next line of a command, by its name in the table; None where the robot answers."""
        waiting = self._replies.get(command)
        if waiting is None:
            return None
        first = waiting[0]
        if first.left is not None:
            first.left -= 1
            if first.left == 0:
                waiting.popleft()
                if not waiting:
                    del self._replies[command]
                    self.any = bool(self._replies)
        return first.text

    def clear(self) -> None:
        """None any more."""
        self._replies.clear()
        self.any = False


def _quoted(text: str) -> str:
    return f"'{shortened(harmless(text), 60)}'"


_LONGEST_TOLD = 80  # characters of a reply shown in the log


class Send(NamedTuple):
    """Send bytes in one write."""

    data: bytes


class Wait(NamedTuple):
    """Wait for real seconds: a driver knows no other time."""

    seconds: float


class Close:
    """Close the connection by FIN. Commands without a reply get none."""


class Reset:
    """Reset the connection by RST. Data that the client has not received is lost."""


Step = Send | Wait | Close | Reset


def text_of(step: Step, reply: bytes) -> str:
    """A step as text for people."""
    match step:
        case Send(data):
            text = data.decode("ascii", "backslashreplace")
            text = text.replace("\r", "\\r").replace("\n", "\\n")
            return "the reply" if data == reply else f"'{shortened(text, _LONGEST_TOLD)}'"
        case Wait(seconds):
            return f"{seconds:g} s of silence"
        case Close():
            return "the end (FIN)"
        case Reset():
            return "the end (RST)"


EVERY = 0
"""Stands for all connections, present and future."""
NEXT = -1
"""Stands for the next connection that will be opened."""
LONGEST_WAIT_S = 3600.0

# A reply of the iiwa's protocol (a WONT_TIMING_MARK is none), or of KRC4.
_REPLIES = re.compile(rb"\xff[^\n]{2}|<Res>.*?</Res>|[^\xff\n]*\n")
# The bytes that frame a reply, which a garbled reply keeps.
_FRAMED = re.compile(rb"(<Res>|)(.*?)(</Res>|[\r\n]*)", re.DOTALL)
_PRINTABLE = range(33, 127)


class Fault(Protocol):
    """What is done to one reply."""

    def steps(self, reply: bytes, random: Random) -> list[Step]:
        """The steps that replace sending this reply."""


class Pass(NamedTuple):
    """The reply is sent unchanged."""

    def steps(self, reply: bytes, _random: Random) -> list[Step]:
        """The steps that replace sending this reply."""
        return [Send(reply)]


class Delay(NamedTuple):
    """The reply is delayed, and so are later ones."""

    seconds: float

    def steps(self, reply: bytes, _random: Random) -> list[Step]:
        """The steps that replace sending this reply."""
        return [Wait(self.seconds), Send(reply)]


class Split(NamedTuple):
    """The first bytes of the reply are sent, and the rest after a pause. A reply that is too short is sent
    whole."""

    byte: int
    pause_s: float

    def steps(self, reply: bytes, _random: Random) -> list[Step]:
        """The steps that replace sending this reply."""
        if self.byte >= len(reply):
            return [Send(reply)]
        return [Send(reply[: self.byte]), Wait(self.pause_s), Send(reply[self.byte :])]


class Drop(NamedTuple):
    """The reply is not sent."""

    def steps(self, _reply: bytes, _random: Random) -> list[Step]:
        """The steps that replace sending this reply."""
        return []


class Garble(NamedTuple):
    """Each byte of the reply is replaced by another printable one, except for its line end or the tags
    round it."""

    def steps(self, reply: bytes, random: Random) -> list[Step]:
        """The steps that replace sending this reply."""
        begin, text, end = _framed(reply)
        noise = bytes(random.choice([b for b in _PRINTABLE if b != byte]) for byte in text)
        return [Send(begin + noise + end)]


def _framed(reply: bytes) -> tuple[bytes, bytes, bytes]:
    found = _FRAMED.fullmatch(reply)
    assert found is not None  # anything matches
    begin, text, end = found.groups()
    return begin, text, end


class CloseBefore(NamedTuple):
    """The connection is closed instead of sending the reply."""

    def steps(self, _reply: bytes, _random: Random) -> list[Step]:
        """The steps that replace sending this reply."""
        return [Close()]


class CloseAfter(NamedTuple):
    """The connection is closed after the reply."""

    def steps(self, reply: bytes, _random: Random) -> list[Step]:
        """The steps that replace sending this reply."""
        return [Send(reply), Close()]


class ResetBefore(NamedTuple):
    """The connection is reset instead of sending the reply."""

    def steps(self, _reply: bytes, _random: Random) -> list[Step]:
        """The steps that replace sending this reply."""
        return [Reset()]


class Silence(NamedTuple):
    """Lines are neither answered nor carried out; they wait until the fault is cleared."""

    def steps(self, reply: bytes, _random: Random) -> list[Step]:
        """The steps that replace sending this reply."""
        return [Send(reply)]  # replies of lines that were carried out before


FAULTS: dict[type, tuple[str, ...]] = {
    kind: kind._fields
    for kind in (Pass, Delay, Split, Drop, Garble, CloseBefore, CloseAfter, ResetBefore, Silence)
}
"""The kinds of faults, with the names of their numbers."""


class Peer(Protocol):
    """A connection as its server has it."""

    faulted: bool
    """Whether a fault is set for it: looked at with each of its lines, so it is told when that changes."""

    def go_on(self) -> None:
        """Answer waiting lines, now that no fault holds them back."""

    def take(self, steps: list[Step]) -> None:
        """Queue these steps after those that are pending."""


@dataclass
class _Rule:
    fault: Fault
    connection: int
    left: int | None  # replies left; None for any number


class WireFaults:
    """The wire faults of one robot's servers, and their connections, numbered from 1 as they come."""

    def __init__(self, tell: Callable[[str, str], None] = lambda _name, _what: None) -> None:
        """`tell` is called with the name of a connection and what goes over its wire instead of a reply."""
        self._tell = tell
        self._rules: list[_Rule] = []  # in the order in which they were set
        self._peers: dict[int, tuple[Peer, str, str]] = {}
        self._silent: set[int] = set()  # connections whose lines wait, as has been reported
        self._count = 0
        self._random = Random(0)
        self.canned = CannedReplies()
        """Replies that are given in place of the robot's."""

    def seed(self, seed: int) -> None:
        """Restart the random numbers for garbled replies; a seed always gives the same ones."""
        self._random = Random(seed)

    def arrives(self, peer: Peer, name: str, protocol: str = "") -> int:
        """Register a connection; returns its number. `protocol` is given where a robot has several."""
        self._count += 1
        self._peers[self._count] = (peer, name, protocol)
        for rule in self._rules:
            if rule.connection == NEXT:
                rule.connection = self._count
        peer.faulted = self._first(self._count) is not None
        return self._count

    def leaves(self, connection: int) -> None:
        """Forget a connection and its faults."""
        del self._peers[connection]
        self._silent.discard(connection)
        self._rules = [rule for rule in self._rules if rule.connection != connection]

    def connections(self) -> dict[int, str]:
        """The connections: numbers, and names with the protocol where there are several."""
        return {
            number: f"{name} ({protocol})" if protocol else name
            for number, (_, name, protocol) in self._peers.items()
        }

    def peers(self) -> list[tuple[str, str]]:
        """Who is connected: names, and the protocol of each where there are several."""
        return [(name, protocol) for _, name, protocol in self._peers.values()]

    def set(self, fault: Fault, connection: int = EVERY, replies: int = UNTIL_CLEARED) -> None:
        """Apply a fault to the next `replies` replies of a connection, or of all.

        Raises `Refused` if there is no such connection.
        """
        if connection not in (EVERY, NEXT):
            self._peers_of(connection)
        self._rules.append(_Rule(fault, connection, replies or None))
        self._tell_peers()

    def end(self, step: Close | Reset, connection: int = EVERY) -> None:
        """End a connection, after replies that are delayed. Raises `Refused` if there is no such
        connection."""
        for peer, name, _ in self._peers_of(connection):
            self._tell(name, text_of(step, b""))
            peer.take([step])

    def clear(self) -> None:
        """Remove all faults and canned replies. Replies that are delayed already keep their delay."""
        self.canned.clear()
        self._rules.clear()
        self._silent.clear()
        self._tell_peers()
        for peer, _, _ in list(self._peers.values()):
            peer.go_on()

    def silences(self, connection: int) -> bool:
        """Whether the next line of a connection, which is there, has to wait."""
        rule = self._first(connection)
        silent = rule is not None and isinstance(rule.fault, Silence)
        if silent and connection not in self._silent:
            self._silent.add(connection)
            self._tell(self._peers[connection][1], "no answer")
        return silent

    def steps(self, connection: int, replies: bytes) -> Iterator[Step]:
        """The steps for replies, up to where the connection ends."""
        for reply in _REPLIES.findall(replies):
            rule = None if reply == WONT_TIMING_MARK else self._first(connection)
            if rule is None:
                yield Send(reply)
                continue
            if rule.left is not None:
                rule.left -= 1
                if rule.left == 0:
                    self._rules.remove(rule)
                    self._tell_peers()
            made = rule.fault.steps(reply, self._random)
            if made != [Send(reply)]:
                told = ", ".join(text_of(step, reply) for step in made) or "nothing"
                self._tell(self._peers[connection][1], told)
            for step in made:
                yield step
                if isinstance(step, Close | Reset):
                    return

    def _first(self, connection: int) -> _Rule | None:
        for rule in self._rules:
            if rule.connection in (EVERY, connection):
                return rule
        return None

    def _tell_peers(self) -> None:
        for connection, (peer, _, _) in self._peers.items():
            peer.faulted = self._first(connection) is not None

    def _peers_of(self, connection: int) -> list[tuple[Peer, str, str]]:
        if connection == EVERY:
            return list(self._peers.values())
        if connection not in self._peers:
            there_are = f"there are {', '.join(map(str, self._peers))}" if self._peers else "there are none"
            raise Refused(EXECUTION, f"no connection {connection}: {there_are}")
        return [self._peers[connection]]

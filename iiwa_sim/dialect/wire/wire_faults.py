r"""Faults on the wire: replies that come late, in pieces, garbled or not at all, and connections that end.

A fault is set for a connection and for a number of replies. Of the faults set for a connection, the one that
was set first takes each reply until it has had its number; then the next one. So faults can be lined up: let
two replies pass, then drop one. What becomes of a reply is said in steps, which a shell with sockets takes
one after the other; so replies stay in their order whatever happens to them.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from random import Random
from typing import NamedTuple, Protocol

from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.dialect.wire.canned import UNTIL_CLEARED, CannedReplies
from iiwa_sim.dialect.wire.lines import WONT_TIMING_MARK
from iiwa_sim.wording import shortened

EVERY = 0
"""Stands for all connections, present and future."""
NEXT = -1
"""Stands for the connection that comes next."""
LONGEST_WAIT_S = 3600.0

# Of the iiwa, where WONT_TIMING_MARK is no reply, and of KRC4.
_REPLIES = re.compile(rb"\xff[^\n]{2}|<Res>.*?</Res>|[^\xff\n]*\n")
# By which a driver tells where a reply begins and ends, and what is between.
_FRAMED = re.compile(rb"(<Res>|)(.*?)(</Res>|[\r\n]*)", re.DOTALL)
_PRINTABLE = range(33, 127)
_LONGEST_TOLD = 80  # characters of what was sent


class Send(NamedTuple):
    """Bytes in a write of their own."""

    data: bytes


class Wait(NamedTuple):
    """Real time before the next step: what is late by it is late for the driver, which knows no other."""

    seconds: float


class Close:
    """The end of the connection, in good order: FIN. What waits for an answer gets none."""


class Reset:
    """The end of the connection as of a crash: RST. What the client has not received yet is lost."""


Step = Send | Wait | Close | Reset


class Fault(Protocol):
    """What becomes of one reply."""

    def steps(self, reply: bytes, random: Random) -> list[Step]:
        """What is done in place of sending this reply."""


class Pass(NamedTuple):
    """Nothing."""

    def steps(self, reply: bytes, _random: Random) -> list[Step]:
        """What is done in place of sending this reply."""
        return [Send(reply)]


class Delay(NamedTuple):
    """It comes later, and so do those behind it."""

    seconds: float

    def steps(self, reply: bytes, _random: Random) -> list[Step]:
        """What is done in place of sending this reply."""
        return [Wait(self.seconds), Send(reply)]


class Split(NamedTuple):
    """Its first bytes come, and the rest after a pause. One that has no more bytes comes whole."""

    byte: int
    pause_s: float

    def steps(self, reply: bytes, _random: Random) -> list[Step]:
        """What is done in place of sending this reply."""
        if self.byte >= len(reply):
            return [Send(reply)]
        return [Send(reply[: self.byte]), Wait(self.pause_s), Send(reply[self.byte :])]


class Drop(NamedTuple):
    """It does not come."""

    def steps(self, _reply: bytes, _random: Random) -> list[Step]:
        """What is done in place of sending this reply."""
        return []


class Garble(NamedTuple):
    """Each of its bytes is another printable one, but for its line end, or the tags round it."""

    def steps(self, reply: bytes, random: Random) -> list[Step]:
        """What is done in place of sending this reply."""
        begin, text, end = _framed(reply)
        noise = bytes(random.choice([b for b in _PRINTABLE if b != byte]) for byte in text)
        return [Send(begin + noise + end)]


def _framed(reply: bytes) -> tuple[bytes, bytes, bytes]:
    found = _FRAMED.fullmatch(reply)
    assert found is not None  # anything matches
    begin, text, end = found.groups()
    return begin, text, end


class CloseBefore(NamedTuple):
    """The connection is closed in its place."""

    def steps(self, _reply: bytes, _random: Random) -> list[Step]:
        """What is done in place of sending this reply."""
        return [Close()]


class CloseAfter(NamedTuple):
    """The connection is closed behind it."""

    def steps(self, reply: bytes, _random: Random) -> list[Step]:
        """What is done in place of sending this reply."""
        return [Send(reply), Close()]


class ResetBefore(NamedTuple):
    """The connection is reset in its place."""

    def steps(self, _reply: bytes, _random: Random) -> list[Step]:
        """What is done in place of sending this reply."""
        return [Reset()]


class Silence(NamedTuple):
    """Lines are not answered, nor carried out, but wait until the fault is cleared."""

    def steps(self, reply: bytes, _random: Random) -> list[Step]:
        """What is done in place of sending this reply."""
        return [Send(reply)]  # of what was carried out before


FAULTS: dict[type, tuple[str, ...]] = {
    kind: kind._fields
    for kind in (Pass, Delay, Split, Drop, Garble, CloseBefore, CloseAfter, ResetBefore, Silence)
}
"""All there are, and what each is made of."""


class Peer(Protocol):
    """A connection, as its shell has it."""

    def go_on(self) -> None:
        """Answer what waits, if it is no more kept from it."""

    def take(self, steps: list[Step]) -> None:
        """Take these steps, behind those that are still to be taken."""


@dataclass
class _Rule:
    fault: Fault
    connection: int
    left: int | None  # replies; None for any number


class WireFaults:
    """The faults of one robot's servers, and their connections, which are numbered from 1 as they come."""

    def __init__(self, tell: Callable[[str, str], None] = lambda _name, _what: None) -> None:
        """`tell` is told of whom something befalls, and what then goes over the wire in place of a reply."""
        self._tell = tell
        self._rules: list[_Rule] = []  # as they were set
        self._peers: dict[int, tuple[Peer, str, str]] = {}
        self._silent: set[int] = set()  # where lines wait, which has been told
        self._count = 0
        self._random = Random(0)
        self.canned = CannedReplies()
        """What is answered in place of the robot."""

    def seed(self, seed: int) -> None:
        """Garble from now on as every run with this seed does."""
        self._random = Random(seed)

    def arrives(self, peer: Peer, name: str, dialect: str = "") -> int:
        """The number of a new connection; `dialect` is what it speaks, where there are several."""
        self._count += 1
        self._peers[self._count] = (peer, name, dialect)
        for rule in self._rules:
            if rule.connection == NEXT:
                rule.connection = self._count
        return self._count

    def leaves(self, connection: int) -> None:
        """A connection is gone, and so are its faults."""
        del self._peers[connection]
        self._silent.discard(connection)
        self._rules = [rule for rule in self._rules if rule.connection != connection]

    def connections(self) -> dict[int, str]:
        """Who is connected: numbers, and names with the dialect where there are several."""
        return {
            number: f"{name} ({dialect})" if dialect else name
            for number, (_, name, dialect) in self._peers.items()
        }

    def set(self, fault: Fault, connection: int = EVERY, replies: int = UNTIL_CLEARED) -> None:
        """Have a fault befall the next `replies` of a connection, in all where that stands for several.

        Raises `Refused` where there is no such connection.
        """
        if connection not in (EVERY, NEXT):
            self._peers_of(connection)
        self._rules.append(_Rule(fault, connection, replies or None))

    def end(self, step: Close | Reset, connection: int = EVERY) -> None:
        """End a connection now, behind replies that are late; raises `Refused` where there is none such."""
        for peer, name, _ in self._peers_of(connection):
            self._tell(name, _text(step, b""))
            peer.take([step])

    def clear(self) -> None:
        """No faults nor canned replies any more. What is late already comes when it would have come."""
        self.canned.clear()
        self._rules.clear()
        self._silent.clear()
        for peer, _, _ in list(self._peers.values()):
            peer.go_on()

    def concerns(self, connection: int) -> bool:
        """Whether any fault is set for a connection."""
        return self._first(connection) is not None

    def silences(self, connection: int, waiting: bool = True) -> bool:
        """Whether a connection's next line has to wait; `waiting` if there is one."""
        rule = self._first(connection)
        silent = rule is not None and isinstance(rule.fault, Silence)
        if silent and waiting and connection not in self._silent:
            self._silent.add(connection)
            self._tell(self._peers[connection][1], "no answer")
        return silent

    def steps(self, connection: int, replies: bytes) -> Iterator[Step]:
        """What becomes of replies, up to where the connection ends."""
        for reply in _REPLIES.findall(replies):
            rule = None if reply == WONT_TIMING_MARK else self._first(connection)
            if rule is None:
                yield Send(reply)
                continue
            if rule.left is not None:
                rule.left -= 1
                if rule.left == 0:
                    self._rules.remove(rule)
            made = rule.fault.steps(reply, self._random)
            if made != [Send(reply)]:
                told = ", ".join(_text(step, reply) for step in made) or "nothing"
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

    def _peers_of(self, connection: int) -> list[tuple[Peer, str, str]]:
        if connection == EVERY:
            return list(self._peers.values())
        if connection not in self._peers:
            there_are = f"there are {', '.join(map(str, self._peers))}" if self._peers else "there are none"
            raise Refused(EXECUTION, f"no connection {connection}: {there_are}")
        return [self._peers[connection]]


def _text(step: Step, reply: bytes) -> str:
    """A step, for people."""
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

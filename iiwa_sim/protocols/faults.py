"""Wire faults and canned replies for tests.

A wire fault delays, splits, garbles or drops a reply, or ends the connection. It is set for a connection and
for a number of replies. The fault that was set first applies to each reply until it has had its number of
replies; then the next one applies: let two replies pass, then drop one. A fault turns a reply into steps,
which the server carries out in order, and so replies keep their order.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from math import inf
from random import Random
from typing import Annotated, Protocol

import msgspec

from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.protocols.decimals import readable
from iiwa_sim.protocols.ports import IIWA
from iiwa_sim.protocols.table import load_table
from iiwa_sim.wording import shortened

EVERY = 0
"""Stands for all connections, present and future."""
NEXT = -1
"""Stands for the next connection that will be opened."""
UNTIL_CLEARED = 0
"""Stands for any number of replies."""
Seconds = Annotated[float, msgspec.Meta(ge=0.0, le=3600.0)]

_LONGEST_SHOWN = 80  # characters of a reply shown in the log
_PRINTABLE = range(33, 127)
# The bytes that frame a reply, which a garbled reply keeps.
_FRAMED = re.compile(rb"(<Res>|)(.*?)(</Res>|[\r\n]*)\Z", re.DOTALL)


class End(Enum):
    """The end of a connection; the values are the texts of the dialogue."""

    FIN = "the end (FIN)"
    """Commands without a reply get none."""
    RST = "the end (RST)"
    """Data that the client has not received is lost."""


Step = bytes | float | End
"""Bytes that a server sends, real seconds that it waits, or the end of the connection."""


class Pass(msgspec.Struct, frozen=True, tag_field="type", tag=True):
    """The reply is sent unchanged."""


class Delay(msgspec.Struct, frozen=True, tag_field="type", tag=True):
    """The reply is delayed, and commands behind it wait."""

    seconds: Seconds


class Split(msgspec.Struct, frozen=True, tag_field="type", tag=True):
    """The first bytes of the reply are sent, and the rest after a pause. A shorter reply is sent whole."""

    byte: Annotated[int, msgspec.Meta(ge=1)]
    pause_s: Seconds


class Drop(msgspec.Struct, frozen=True, tag_field="type", tag=True):
    """The reply is not sent."""


class Garble(msgspec.Struct, frozen=True, tag_field="type", tag=True):
    """Each byte of the reply is replaced by another printable one, except for its line end or its tags."""


class CloseBefore(msgspec.Struct, frozen=True, tag_field="type", tag=True):
    """The connection is closed instead of sending the reply."""


class CloseAfter(msgspec.Struct, frozen=True, tag_field="type", tag=True):
    """The connection is closed after the reply."""


class ResetBefore(msgspec.Struct, frozen=True, tag_field="type", tag=True):
    """The connection is reset instead of sending the reply."""


class Silence(msgspec.Struct, frozen=True, tag_field="type", tag=True):
    """Lines are neither answered nor carried out; they wait until the fault is cleared."""


Fault = Pass | Delay | Split | Drop | Garble | CloseBefore | CloseAfter | ResetBefore | Silence
"""The fault for one reply; in JSON with its name as `type`: `{"type": "Delay", "seconds": 0.2}`."""


class Peer(Protocol):
    """A connection as its server has it."""

    def go_on(self) -> None:
        """Answer waiting lines, now that no fault holds them back."""

    def end(self, how: End) -> None:
        """End the connection."""


@dataclass
class Rule:
    """A fault for the next replies of a connection."""

    fault: Fault
    connection: int
    left: float
    """Replies left; infinite for any number."""


class CannedReplies:
    """Replies of the iiwa's protocol that a test has set for one robot, for all its clients together.

    Replies for one command answer its lines in the order in which they were set, each for its number of
    lines. Then the robot answers again.
    """

    def __init__(self) -> None:
        self.is_served = True
        """True if the robot speaks the iiwa's protocol."""
        self.replies: dict[str, list[tuple[str, float]]] = {}
        """By command: each text with its number of lines, infinite for any."""

    def set(self, command: str, reply: str, times: int = 1) -> None:
        """Answer the next `times` lines of a command by `reply`, 0 for all, without executing them.

        Raises ValueError for an unknown command, a reply that is not one line of printable ASCII, or a number
        below 0. It is also raised without the iiwa's protocol: KRC4 messages cannot be canned.
        """
        table, spelling = load_table(IIWA), command.encode("ascii", "backslashreplace")
        known = table.find(spelling)
        if not self.is_served or known is None:
            reason = table.why_unknown(spelling) if self.is_served else f"expected a robot that speaks {IIWA}"
            raise ValueError(f"command {command!r:.60}: {reason}")
        if not (reply.isascii() and reply.isprintable()):
            raise ValueError(f"reply {reply!r:.60}: expected one line of printable ASCII")
        if times < 0:
            raise ValueError(f"times={times}: expected 0 or more")
        self.replies.setdefault(known.name, []).append((reply, times or inf))

    def take(self, command: str) -> str | None:
        """Return the reply to the next line of a command, by its name; None if the robot answers."""
        waiting = self.replies.get(command)
        if not waiting:
            return None
        text, left = waiting[0]
        waiting[:1] = [] if left == 1 else [(text, left - 1)]
        return text


class WireFaults:
    """Wire faults of one robot's servers, and their connections, numbered from 1 as they come."""

    def __init__(self, report: Callable[[str, str], None] = lambda _name, _what: None) -> None:
        """`report` is called with the name of a connection and the text of what replaces a reply."""
        self.rules: list[Rule] = []
        """The faults in the order in which they were set."""
        self.peers: dict[int, tuple[Peer, str]] = {}
        """The connections by number, each with its name."""
        self.canned = CannedReplies()
        """Replies that are given in place of the robot's."""
        self._report = report
        self._count = 0
        self._random = Random(0)

    def seed(self, seed: int) -> None:
        """Restart the random numbers for garbled replies; a seed always gives the same ones."""
        self._random = Random(seed)

    def arrives(self, peer: Peer, name: str) -> int:
        """Register a connection; returns its number."""
        self._count += 1
        self.peers[self._count] = (peer, name)
        for rule in self.rules:
            if rule.connection == NEXT:
                rule.connection = self._count
        return self._count

    def leaves(self, connection: int) -> None:
        """Forget a connection and its faults."""
        del self.peers[connection]
        self.rules = [rule for rule in self.rules if rule.connection != connection]

    def set(self, fault: Fault, connection: int = EVERY, replies: int = UNTIL_CLEARED) -> None:
        """Apply a fault to the next `replies` replies of a connection, or of all.

        Raises `Refused` if there is no such connection.
        """
        if connection != NEXT:
            self._peers_of(connection)
        self.rules.append(Rule(fault, connection, replies or inf))

    def end(self, how: End, connection: int = EVERY) -> None:
        """End a connection, or all. Raises `Refused` if there is no such connection."""
        for peer, name in self._peers_of(connection):
            self._report(name, how.value)
            peer.end(how)

    def clear(self) -> None:
        """Remove all faults and canned replies. Replies that are delayed already keep their delay."""
        self.canned.replies.clear()
        self.rules.clear()
        for peer, _ in list(self.peers.values()):
            peer.go_on()

    def next_of(self, connection: int) -> Rule | None:
        """Return the fault for the next reply of a connection, if there is one."""
        return next((rule for rule in self.rules if rule.connection in (EVERY, connection)), None)

    def steps(self, connection: int, rule: Rule, reply: bytes) -> list[Step]:
        """Return the steps that replace sending a reply."""
        rule.left -= 1
        if rule.left == 0:
            self.rules.remove(rule)
        steps = _steps(rule.fault, reply, self._random)
        if steps != [reply]:
            text = ", ".join(_text_of(step, reply) for step in steps) or "nothing"
            self._report(self.peers[connection][1], text)
        return steps

    def _peers_of(self, connection: int) -> list[tuple[Peer, str]]:
        if connection == EVERY:
            return list(self.peers.values())
        if connection not in self.peers:
            there_are = ", ".join(map(str, self.peers)) or "none"
            raise Refused(EXECUTION, f"no connection {connection}: there are {there_are}")
        return [self.peers[connection]]


def _steps(fault: Fault, reply: bytes, random: Random) -> list[Step]:
    match fault:
        case Delay(seconds):
            return [seconds, reply]
        case Split(byte, pause_s) if byte < len(reply):
            return [reply[:byte], pause_s, reply[byte:]]
        case Drop():
            return []
        case Garble():
            begin, text, end = next(_FRAMED.finditer(reply)).groups()
            noise = bytes(random.choice([b for b in _PRINTABLE if b != byte]) for byte in text)
            return [begin + noise + end]
        case CloseBefore():
            return [End.FIN]
        case CloseAfter():
            return [reply, End.FIN]
        case ResetBefore():
            return [End.RST]
    return [reply]


def _text_of(step: Step, reply: bytes) -> str:
    """Return a step as text for people."""
    if isinstance(step, End):
        return step.value
    if isinstance(step, bytes):
        return "the reply" if step == reply else f"'{shortened(readable(step), _LONGEST_SHOWN)}'"
    return f"{step:g} s of silence"

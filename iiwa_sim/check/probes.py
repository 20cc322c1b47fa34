"""Probes of lines, numbers and connections of a server, which may be a real robot.

Without permission no probe sends anything that could move the robot. `protocol/transcripts/lines.txt` has
what a dialogue can tell.
"""

import re
import time
from collections.abc import Callable
from enum import Enum
from typing import NamedTuple

from iiwa_sim.client.connection import Connection
from iiwa_sim.protocols.decimals import readable
from iiwa_sim.transcript.replay import connected
from iiwa_sim.transcript.texts import TranscriptFault

TIMEOUT_S = 3.0
"""Seconds for a reply, also of a server that needs a second to turn to its next client."""
PIECE_S = 0.03
"""Seconds between two pieces of a line, so that they travel in separate packets."""
PIPELINED = 200
_ANY = re.compile(rb"(.+)", re.DOTALL)


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


class Link(NamedTuple):
    """A server, and what may be sent to it."""

    host: str
    port: int
    allow_motion: bool
    timeout_s: float = TIMEOUT_S

    def talk(self) -> Connection:
        """Open a connection. Raises TranscriptFault if there can be none."""
        return connected(self.host, self.port, self.timeout_s)

    def knows(self, command: str) -> bool:
        """Return True if the server has a harmless command: others are answered `unknown command`."""
        with self.talk() as talk:
            return ask(talk, command) != "unknown command"


class Probe(NamedTuple):
    """One question to a server, with the known behaviour of the original."""

    event: str
    """The input, or what happens."""
    original: str
    """The original's behaviour; empty for a dialogue, which has it line by line."""
    ask: Callable[[Link], Finding | str]
    """Asks the server; a text is a deviation, and so is an OSError, as for a reply that does not come."""
    ours: str = ""
    """The behaviour of iiwa-sim and its reason; empty if it is the original's."""


def ask(talk: Connection, line: str, end: bytes = b"\r\n") -> str:
    """Send a line and return its reply, escaped. Raises OSError."""
    talk.send(line.encode() + end)
    return readable(talk.read())


def _one_write(link: Link) -> Finding | str:
    with link.talk() as talk:
        for _ in range(20):
            talk.send(b"hello\r\n")
            got = talk.read(_ANY)
            if got != b"hello\r\n":
                return f"hello was answered {got!r}: a driver that compares with 'hello\\r\\n' fails"
    return SAME


def _line_ends(link: Link) -> Finding | str:
    for end in (b"\n", b"\r", b"\r\n", b"\n\r"):
        with link.talk() as talk:
            reply = ask(talk, "get status", end)
            if reply != "stopped" or not _is_in_step(talk):
                return f"'get status' with {repr(end)[2:-1]} was answered '{reply}', or twice"
    return SAME


def _split_lines(link: Link) -> Finding | str:
    with link.talk() as talk:
        for piece in (b"get s", b"tat", b"us\r", b"\n"):
            talk.send(piece)
            time.sleep(PIECE_S)
        if (reply := readable(talk.read())) != "stopped":
            return f"'get status', sent in pieces, was answered '{reply}'"
        return SAME if _is_in_step(talk) else "\\r\\n, its halves sent one after the other, are two line ends"


def _blanks(link: Link) -> Finding | str:
    with link.talk() as talk:
        replies = {ask(talk, line) for line in ("get  status", "get\tstatus")}
    known = {"unknown command": SAME, "stopped": OURS}
    return known.get("".join(replies), f"blanks between words: {sorted(replies)}")


def _pipelined(link: Link) -> Finding | str:
    with link.talk() as talk:
        talk.send(b"hello\r\nget status\r\n" * PIPELINED)
        for number in range(2 * PIPELINED):
            if (reply := readable(talk.read())) != ("hello", "stopped")[number % 2]:
                return f"reply {number + 1} of {2 * PIPELINED} is '{reply}': lines in a hurry get lost"
    return SAME


def _takes(*taken: str, but: tuple[str, ...] = (), has_ours: bool = False) -> Callable[[Link], Finding | str]:
    """Check which parameters the server takes; `has_ours` if iiwa-sim does the opposite.

    `{start}` stands for the present place, with room for one more number. `is reachable` tells without a
    move. Without it, moves to the present place are sent.
    """

    def find(link: Link) -> Finding | str:
        asks = link.knows("is reachable")
        if not (asks or link.allow_motion):
            why = "every command with parameters moves this server's robot: --allow-motion tries it"
            return Finding(Verdict.UNTRIED, why)
        wrong = []
        with link.talk() as talk:
            start = ask(talk, "get tool frame") + ("" if asks else " 0.05")
            for each in (*taken, *but):
                values = each.format(start=start)
                is_taken = ask(talk, f"{'is reachable' if asks else 'ptp move'} : {values}") != "error"
                if is_taken != (each in taken):
                    wrong.append(f"'{values}' is {'taken' if is_taken else 'refused'}")
        return OURS if has_ours and len(wrong) == len(taken) else "; ".join(wrong) or SAME

    return find


def _second_client(link: Link) -> Finding | str:
    with link.talk() as first:
        ask(first, "hello")
        try:
            with link.talk() as second:
                second.send(b"hello\r\n")
                try:
                    second.read(timeout_s=link.timeout_s / 2)
                except TimeoutError:
                    first.close()
                    second.read()
                    return SAME
                return OURS if _is_in_step(first) else "the first client is not answered any more"
        except TranscriptFault as fault:
            return str(fault)


def _is_in_step(talk: Connection) -> bool:
    """Return True if the next reply belongs to the next line."""
    try:
        return ask(talk, "hello") == "hello"
    except OSError:
        return False


_NUMBERS = tuple(f"{{start}} {word}" for word in ("1", "1.", "+.5", "1e1", "1E-5"))
_NO_NUMBERS = tuple(f"{{start}} {word}" for word in ("1_0", "1,5", "0x10", "one"))

PROBES = (
    Probe("any reply", "text and \\r\\n, in one write", _one_write),
    Probe("a line that ends with \\n, \\r, \\r\\n or \\n\\r", "each is one line end", _line_ends),
    Probe("a line that comes in pieces", "it counts when its end has come", _split_lines),
    Probe(
        "blanks and tabs between the words of a command",
        "are not ignored",
        _blanks,
        "any run of them counts as one, as Appendix B says",
    ),
    Probe("hundreds of lines at once", "are answered one by one, in their order", _pipelined),
    Probe(
        "too few parameters, or words for numbers",
        "`error`",
        _takes(but=("1 2 3", "a b c d e f 0.05 0")),
    ),
    Probe(
        "too many parameters",
        "those beyond are ignored",
        _takes("{start} 0 0 0", has_ours=True),
        "the same, with a warning in the log; with --strict `error`",
    ),
    Probe(
        "`NaN`, `Infinity` as a parameter",
        "are taken",
        _takes("{start} NaN", "{start} Infinity", has_ours=True),
        "`error`",
    ),
    Probe(
        "numbers as Java writes them: 1, 1., +.5, 1e1, 1E-5",
        "are taken, and 1_0, 1,5, 0x10 are not",
        _takes(*_NUMBERS, but=_NO_NUMBERS),
    ),
    Probe(
        "a second client",
        "waits until the first has gone",
        _second_client,
        "is served at the same time; --exclusive does as the original",
    ),
)

"""The dialogue of all clients with one robot: one log for assertions, reports, the backdoor and files.

A line is added when it is carried out, with its reply, so a reply belongs to its line even if lines were
pipelined. Telnet's own commands are not in it.
"""

import logging
import time
from collections import Counter, deque
from collections.abc import Callable, Collection
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import msgspec

MOST = 100_000
"""Entries kept; a repeated exchange, as of a polling driver, is one entry."""
REPORTED = 300
"""Entries in a report, or in one answer to `since`: the newest ones."""
SHOWN = 12
"""Commands that the message of an assertion names, the most frequent ones."""

logger = logging.getLogger(__name__)
__tracebackhide__ = True  # pytest shows the line of the test instead


class Direction(StrEnum):
    """The direction of a line, by its mark in `protocol/transcripts`; `ON_WIRE` is the effect of a fault."""

    FROM_CLIENT = ">"
    TO_CLIENT = "<"
    EVENT = "#"
    ON_WIRE = "~"


class DialogueLine(msgspec.Struct, frozen=True, omit_defaults=True):
    """A line of the dialogue, or an event."""

    time_s: float
    """Simulated time (s)."""
    session: str
    """HOST:PORT of the client, or another name of the line's subject."""
    mark: Direction
    text: str
    """The line without its end, escaped to printable ASCII; KRC4 messages in short form (`krc4_xml`)."""
    reason: str = ""
    """The reason of a rejection, with the reply."""
    protocol: str = ""
    """The protocol of a client that has just connected, one of `iiwa_sim.protocols.ports`."""
    instant_ns: int = 0
    """Real time by `time.monotonic_ns`."""


class Exchange(NamedTuple):
    """A line of a client, or a KRC4 message in its short form, and the reply before any wire fault."""

    session: str
    """HOST:PORT of the client."""
    command: str
    """The name of the command as in protocol/iiwa.toml, or of a KRC4 message such as GOA; else the line."""
    line: str
    reply: str


class RecentLines(msgspec.Struct, frozen=True):
    """Some of the lines, oldest first."""

    next: int
    """The number to ask for next."""
    lines: list[DialogueLine]


@dataclass
class _Entry:
    """An event, or a line with its reply; it may be repeated."""

    content: tuple[str, ...]
    """An `Exchange`, or session, mark and text of an event."""
    number: int
    """Number of its last repetition among all entries, from 0."""
    lines: tuple[DialogueLine, ...]
    """The last repetition."""
    times: int = 1


class Dialogue:
    """The dialogue in all protocols. From `remember` on it is kept and can be read from any thread.

    A line is kept before its reply is sent: a client that has the reply finds its line here. `listeners` are
    called with each line in order, inside the event loop, and must not fail.
    """

    def __init__(self, time_s: Callable[[], float], names: Callable[[], Collection[str]] = tuple) -> None:
        """`time_s` returns simulated time (s), `names` those of all commands."""
        self.listeners: list[Callable[[DialogueLine], None]] = []
        self._time_s, self._names = time_s, names
        self._entries: deque[_Entry] | None = None
        self._count = 0
        self._began_ns = time.monotonic_ns()

    @property
    def is_active(self) -> bool:
        """True if lines are kept or logged, or there are listeners."""
        return self._entries is not None or bool(self.listeners) or logger.isEnabledFor(logging.DEBUG)

    def exchange(self, session: str, line: str, reply: str, reason: str = "", command: str = "") -> None:
        """Add a client's line and the reply; `reason` is that of a rejection, `command` a known name."""
        if self.is_active:
            sent = self._notify(session, Direction.FROM_CLIENT, line)
            answer = self._notify(session, Direction.TO_CLIENT, reply, reason=reason)
            self._keep(Exchange(session, command or line, line, reply), sent, answer)
            if not reason:
                fields = {"session": session, "line": line, "reply": reply}
                logger.debug("%s '%s' -> %s", session, line, reply, extra={"fields": fields})

    def event(self, session: str, text: str, protocol: str = "", mark: Direction = Direction.EVENT) -> None:
        """Add an event, such as a client that connects (in `protocol`) or disconnects."""
        if self.is_active:
            self._keep((session, mark, text), self._notify(session, mark, text, protocol=protocol))

    def remember(self) -> None:
        """Keep the dialogue from now on; robots of the fixture do from the start."""
        if self._entries is None:
            self._entries = deque(maxlen=MOST)

    def forget(self) -> None:
        """Forget all lines, and keep those from now on."""
        self._entries = deque(maxlen=MOST)

    def exchanges(self) -> list[Exchange]:
        """Return all lines and their replies, in the order in which they were carried out.

        Raises RuntimeError if `remember` was not called, or if there were more exchanges than are kept.
        """
        if self._entries is None:
            raise RuntimeError("nothing is remembered: call dialogue.remember() before the driver connects")
        if len(self._entries) == MOST:
            raise RuntimeError(f"{MOST} exchanges or more: call dialogue.forget() ahead of what counts")
        entries = list(self._entries)
        return [e.content for e in entries if isinstance(e.content, Exchange) for _ in range(e.times)]

    def commands(self) -> list[str]:
        """Return the names of all commands in their order: `["hello", "lin move", "get status"]`.

        A line that is no command stands there as it was sent. Raises RuntimeError as `exchanges`.
        """
        return [each.command for each in self.exchanges()]

    def assert_said(self, what: str, times: int | None = None) -> None:
        """Raise an AssertionError with the commands that clients sent, unless one of them is `what`.

        `what` is the name of a command or a whole line; letter case and blanks do not count. With `times` it
        is expected exactly so often, 0 for never; without it at least once. Raises ValueError if `what` is no
        command and no line that was sent, and RuntimeError as `exchanges`.
        """
        wanted = _normal(what)
        found = sum(wanted in (_normal(each.command), _normal(each.line)) for each in self.exchanges())
        if not found and ":" not in what and wanted not in map(_normal, self._names()):
            raise ValueError(f"'{what}': expected the name of a command, such as lin move, or a whole line")
        if found != times if times is not None else not found:
            often = "at least once" if times is None else f"{times} times"
            counted = Counter(self.commands()).most_common(SHOWN)
            sent = ", ".join(f"{name} ({count} times)" for name, count in counted) or "nothing"
            raise AssertionError(f"expected '{what}' {often}, was said {found} times; commands: {sent}")

    def since(self, number: int) -> RecentLines:
        """Return the newest lines from entry `number` on, with the number to ask for next."""
        newest = [each for each in list(self._entries or ())[-REPORTED:] if each.number >= number]
        return RecentLines(self._count, [line for each in newest for line in each.lines])

    def report(self) -> str:
        """Return the newest entries as text, with simulated and real seconds."""
        lines = ["simulated      real"]
        for entry in list(self._entries or ())[-REPORTED:]:
            sent, *answers = entry.lines
            when = f"{sent.time_s:9.3f} {(sent.instant_ns - self._began_ns) * 1e-9:9.3f}"
            lines.append(f"{when}  {sent.session} {sent.mark} {sent.text}")
            lines += [f"{'':{21 + len(sent.session)}} {line.mark} {line.text}" for line in answers]
            if entry.times > 1:
                lines[-1] += f"  ({entry.times} times)"
        return "\n".join(lines) if len(lines) > 1 else "nothing was said"

    def _notify(self, session: str, mark: Direction, text: str, **more: str) -> DialogueLine:
        entry = DialogueLine(self._time_s(), session, mark, text, instant_ns=time.monotonic_ns(), **more)
        for listener in self.listeners:
            listener(entry)
        return entry

    def _keep(self, content: tuple[str, ...], *lines: DialogueLine) -> None:
        entries = self._entries
        if entries and entries[-1].content == content:
            entries[-1].number, entries[-1].lines = self._count, lines
            entries[-1].times += 1
        elif entries is not None:
            entries.append(_Entry(content, self._count, lines))
        self._count += 1


def _normal(text: str) -> str:
    return " ".join(text.lower().replace(":", " : ").split())

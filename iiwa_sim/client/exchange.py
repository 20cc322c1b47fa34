r"""A command out, its reply in: what both clients share, without sockets.

A `Request` is a line to be sent and what reads its reply; a `Conversation` turns lines into bytes and bytes
into replies, and notices when the other side is out of step. A reply may end with `\n`, `\r`, `\r\n` or
`\n\r`.
"""

import math
import re
from collections.abc import Callable, Sequence
from typing import Generic, NamedTuple, TypeVar

from iiwa_sim.client.faults import CommandError, ReplyError, UnknownCommandError

MAX_REPLY_BYTES = 65536
CLOSED = "this connection is closed; reconnect() opens another"

_REASON = "its log has the reason"
_END = re.compile(rb"[\r\n]")
_PARTNER = {b"\r": b"\n", b"\n": b"\r"}

T = TypeVar("T")


class Request(NamedTuple, Generic[T]):
    """A line, and what makes a value of its reply or raises ValueError where that does not fit."""

    line: str
    read: Callable[[str], T]

    def result(self, reply: str) -> T:
        """The value. Raises CommandError and UnknownCommandError for refusals, ReplyError for nonsense."""
        if reply == "unknown command":
            raise UnknownCommandError(f"the server answered unknown command to {self.line!r}; {_REASON}")
        if reply == "error":
            raise CommandError(f"the server answered error to {self.line!r}; {_REASON}")
        try:
            return self.read(reply)
        except ValueError:
            raise ReplyError(f"{self.line!r} was answered {reply!r}") from None


def request(read: Callable[[str], T], name: str, *values: float) -> Request[T]:
    """A command with its parameters. Raises ValueError for values that are not finite."""
    if not all(map(math.isfinite, values)):
        raise ValueError(f"{name}: expected finite numbers, got {values}")
    words = [str(value) if isinstance(value, int) else repr(float(value)) for value in values]
    return Request(f"{name} : {' '.join(words)}" if words else name, read)


def phrase(read: Callable[[str], T], name: str, words: str) -> Request[T]:
    """A command that takes words, on one line."""
    return Request(" ".join(f"{name} : {words}".split()), read)


def exactly(count: int, name: str, values: Sequence[float]) -> list[float]:
    """The values as floats. Raises ValueError where there are more or fewer than `count`."""
    if len(values) != count:
        raise ValueError(f"{name}: expected {count} numbers, got {len(values)}")
    return [float(value) for value in values]


class ReplyLines:
    """Bytes in, lines out."""

    def __init__(self) -> None:
        self._heard = b""
        self._partner = b""  # would complete the line end of the last reply

    def feed(self, data: bytes) -> None:
        """Takes in what came."""
        self._heard += data

    @property
    def unread(self) -> bytes:
        """What has come and is not taken out yet."""
        if self._heard:
            if self._partner:
                self._heard = self._heard.removeprefix(self._partner)
            self._partner = b""
        return self._heard

    def take(self) -> bytes | None:
        """The next line, without its end; None until it is complete."""
        end = _END.search(self.unread)
        if end is None:
            return None
        line, self._heard = self._heard[: end.start()], self._heard[end.end() :]
        self._partner = _PARTNER[end.group()]
        return line


class Conversation:
    """One connection's lines, each to be answered before the next is said."""

    def __init__(self) -> None:
        self._asked = ""
        self._replies = ReplyLines()

    def say(self, line: str) -> bytes:
        """The bytes of a line. Raises ReplyError if something was said that nobody asked for."""
        if unasked := self._replies.unread:
            raise ReplyError(f"{unasked[:80]!r} came unasked, before {line!r}")
        self._asked = line
        return line.encode() + b"\r\n"

    def hear(self, data: bytes) -> str | None:
        """The reply, once what came completes it.

        Raises ConnectionResetError at the end of the stream (b""), or of patience.
        """
        self._replies.feed(data)
        reply = self._replies.take()
        if reply is not None:
            return reply.decode("ascii", "replace").strip()
        if not data or len(self._replies.unread) > MAX_REPLY_BYTES:
            raise ConnectionResetError(f"the connection ended before the answer to {self._asked!r}")
        return None

r"""The iiwa's line protocol for clients: a line out, a line in.

A reply may end with `\n`, `\r`, `\r\n` or `\n\r`.
"""

import re
from collections.abc import Callable
from typing import TypeVar

from iiwa_sim.client.errors import CommandError, UnknownCommandError
from iiwa_sim.client.exchange import Conversation, Language, Request, refuse_endless
from iiwa_sim.client.readers import one_of

_REASON = "its log has the reason"
_END = re.compile(rb"[\r\n]")
_PARTNER = {b"\r": b"\n", b"\n": b"\r"}

T = TypeVar("T")


def request(read: Callable[[str], T], name: str, *values: float) -> Request[str, str, T]:
    """The request for a command with parameters. Raises ValueError for values that are not finite."""
    refuse_endless(name, values)
    words = [str(value) if isinstance(value, int) else repr(float(value)) for value in values]
    return Request(f"{name} : {' '.join(words)}" if words else name, read)


def phrase(read: Callable[[str], T], name: str, words: str) -> Request[str, str, T]:
    """The request for a command that takes words, on one line."""
    return Request(" ".join(f"{name} : {words}".split()), read)


class ReplyLines:
    """Splits received bytes into lines."""

    def __init__(self) -> None:
        self._heard = b""
        self._partner = b""  # would complete the line end of the last reply

    def feed(self, data: bytes) -> None:
        """Add received bytes."""
        self._heard += data

    @property
    def unread(self) -> bytes:
        """Received bytes that have not been taken as a line."""
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


class LineConversation(Conversation[str, str]):
    """The requests and answers of one connection in lines."""

    def __init__(self) -> None:
        self._replies = ReplyLines()
        super().__init__(self._replies)

    def _written(self, said: str) -> bytes:
        return said.encode() + b"\r\n"

    def _answer(self, said: str) -> str | None:
        line = self._replies.take()
        if line is None:
            return None
        reply = line.decode("ascii", "replace").strip()
        if reply == "unknown command":
            raise UnknownCommandError(f"the server answered unknown command to {said!r}; {_REASON}")
        if reply == "error":
            raise CommandError(f"the server answered error to {said!r}; {_REASON}")
        return reply


def _at_rest(reply: str) -> bool:
    return one_of("moving", "stopped")(reply) == "stopped"


IIWA = Language(LineConversation, request(_at_rest, "get status"))
"""The iiwa's line protocol."""

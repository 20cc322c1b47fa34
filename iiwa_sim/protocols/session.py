"""The interface between a shell and a session: one connection in one protocol, without its socket."""

from collections.abc import Callable
from typing import Any, Protocol


class Pending(Protocol):
    """Something that a reply waits for, such as an asyncio.Future."""

    def done(self) -> bool:
        """Whether it has happened."""

    def add_done_callback(self, callback: Callable[[Any], object], /) -> None:
        """Register a function to be called when it has happened."""


class Session(Protocol):
    """Takes bytes, split anywhere, and returns replies on request."""

    @property
    def waiting(self) -> object:
        """The commands that wait for their reply, or the next of them; false where none does."""

    @property
    def closing(self) -> bool:
        """Whether the session ends: the shell sends the replies there are, then closes."""

    @property
    def pending(self) -> Pending | None:
        """What the next reply waits for; until it is done there is nothing to answer."""

    @property
    def awaits(self) -> bool:
        """Whether the newest move is the client's own, and it waits for its end: it asks again and again."""

    def receive(self, data: bytes) -> None:
        """Take bytes from the client."""

    def end(self) -> None:
        """Notice that the client sends no more."""

    def answer(self, most: int = ...) -> bytes:
        """The replies to some of the waiting commands, at most `most`."""

    def lost(self) -> None:
        """Notice that the connection has gone."""

"""What a shell wants of a session: one connection in one dialect, without its socket."""

from collections.abc import Callable
from typing import Any, Protocol


class Pending(Protocol):
    """What a reply waits for, such as an asyncio.Future."""

    def done(self) -> bool:
        """Whether it is there."""

    def add_done_callback(self, callback: Callable[[Any], object], /) -> None:
        """Call back once it is there."""


class Session(Protocol):
    """Takes in bytes, split anywhere, and gives replies when it is asked for them."""

    @property
    def waiting(self) -> bool:
        """Whether commands wait for their reply."""

    @property
    def closing(self) -> bool:
        """Whether the session ends: what is answered is to be sent, then the connection to be closed."""

    @property
    def pending(self) -> Pending | None:
        """What the next reply waits for: while that is not done, there is nothing to answer."""

    def receive(self, data: bytes) -> None:
        """Take in bytes of the client."""

    def end(self) -> None:
        """Learn that the client sends no more."""

    def answer(self, most: int = ...) -> bytes:
        """The replies to some of the waiting commands, to `most` of them at most."""

    def lost(self) -> None:
        """Learn that the connection is gone."""

"""What a server of lines wants of a conversation."""

import asyncio
from typing import Any, Protocol, runtime_checkable


class LineSession(Protocol):
    """One client's conversation, without sockets."""

    @property
    def waiting(self) -> bool:
        """Whether lines wait for their answer."""

    @property
    def closing(self) -> bool:
        """Whether the client said good-bye: what is answered is to be sent, then the connection closed."""

    def receive(self, data: bytes) -> None:
        """Take in bytes, split anywhere."""

    def end(self) -> None:
        """Learn that the client sends no more: a rest without a line end is a line."""

    def answer(self, most: int = ...) -> bytes:
        """The replies to some of the waiting lines, to `most` of them at most."""

    def lost(self) -> None:
        """Learn that the connection is gone."""


@runtime_checkable
class PatientSession(LineSession, Protocol):
    """A conversation in which the answer to a line may take its time."""

    @property
    def pending(self) -> asyncio.Future[Any] | None:
        """What the next reply waits for: while that is not done, there is nothing to answer."""

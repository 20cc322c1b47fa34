"""The logic of requests and answers that all clients share, without sockets.

A `Request` is what is sent, with a function that reads the answer. A `Conversation` turns requests into bytes
and received bytes into answers, and detects refusals and a server that is out of step. A `Language` describes
a protocol to a connection.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from math import isfinite
from typing import Generic, NamedTuple, Protocol, TypeVar

from iiwa_sim.client.errors import ReplyError

MAX_REPLY_BYTES = 65536
CLOSED = "this connection is closed; reconnect() opens another"

Said = TypeVar("Said")
Answer = TypeVar("Answer")
T = TypeVar("T")


class Request(NamedTuple, Generic[Said, Answer, T]):
    """What is sent, and a function that reads the answer, which raises ValueError for a malformed one."""

    said: Said
    read: Callable[[Answer], T]

    def result(self, answer: Answer) -> T:
        """The value of an answer. Raises ReplyError for a malformed one."""
        try:
            return self.read(answer)
        except ValueError:
            raise ReplyError(f"{self.said!r} was answered {answer!r}") from None


class ReceivedBytes(Protocol):
    """The received bytes of a protocol."""

    def feed(self, data: bytes) -> None:
        """Add received bytes."""

    @property
    def unread(self) -> bytes:
        """Bytes that belong to no answer and may not stand between answers."""


class Conversation(ABC, Generic[Said, Answer]):
    """The requests of one connection; each is answered before the next is sent."""

    def __init__(self, received: ReceivedBytes) -> None:
        self._received = received
        self._said: Said | None = None

    def say(self, said: Said) -> bytes:
        """The bytes of a request. Raises ReplyError if unexpected bytes were received before."""
        if unasked := self._received.unread:
            raise ReplyError(f"{unasked[:80]!r} came unasked, before {said!r}")
        self._said = said
        return self._written(said)

    def hear(self, data: bytes) -> Answer | None:
        """The answer to the last request once `data` completes it, else None.

        Raises CommandError for a refusal, ReplyError for bytes that cannot be the answer, and
        ConnectionResetError at the end of the stream (b"").
        """
        assert self._said is not None, "nothing was said"
        self._received.feed(data)
        try:
            answer = self._answer(self._said)
        except ValueError as fault:
            raise ReplyError(f"{self._said!r} was answered with {fault}") from None
        if answer is None and (not data or len(self._received.unread) > MAX_REPLY_BYTES):
            raise ConnectionResetError(f"the connection ended before the answer to {self._said!r}")
        return answer

    @abstractmethod
    def _written(self, said: Said) -> bytes:
        """The bytes of a request."""

    @abstractmethod
    def _answer(self, said: Said) -> Answer | None:
        """Take the answer out of the received bytes; None until it is complete.

        Raises CommandError for a refusal, and ValueError, quoting the bytes, for something that is no answer.
        """


class Language(NamedTuple, Generic[Said, Answer]):
    """A protocol, as far as a connection needs it."""

    conversation: Callable[[], Conversation[Said, Answer]]
    """Makes the conversation for a new connection."""
    at_rest: Request[Said, Answer, bool]
    """The request that asks whether the robot is at rest."""


def exactly(count: int, name: str, values: Sequence[float]) -> list[float]:
    """The values as floats. Raises ValueError unless there are exactly `count`."""
    if len(values) != count:
        raise ValueError(f"{name}: expected {count} numbers, got {len(values)}")
    return [float(value) for value in values]


def refuse_endless(name: str, values: Iterable[float]) -> None:
    """Raises ValueError for values that are not finite."""
    numbers = tuple(values)
    if not all(map(isfinite, numbers)):
        raise ValueError(f"{name}: expected finite numbers, got {numbers}")

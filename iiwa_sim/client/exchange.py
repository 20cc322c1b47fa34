"""A request out, its answer in: what all clients share, whatever the protocol, without sockets.

A `Request` is what is said, and what makes a value of the answer. A `Conversation` turns what is said into
bytes and the bytes that come into answers, and notices refusals, and when the other side is out of step. A
protocol is a `Language`: what a connection needs to know of it.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from math import isfinite
from typing import Generic, NamedTuple, Protocol, TypeVar

from iiwa_sim.client.faults import ReplyError

MAX_REPLY_BYTES = 65536
CLOSED = "this connection is closed; reconnect() opens another"

Said = TypeVar("Said")
Answer = TypeVar("Answer")
T = TypeVar("T")


class Request(NamedTuple, Generic[Said, Answer, T]):
    """What is said, and what makes a value of its answer or raises ValueError where that does not fit."""

    said: Said
    read: Callable[[Answer], T]

    def result(self, answer: Answer) -> T:
        """The value. Raises ReplyError for nonsense."""
        try:
            return self.read(answer)
        except ValueError:
            raise ReplyError(f"{self.said!r} was answered {answer!r}") from None


class Heard(Protocol):
    """The bytes that have come."""

    def feed(self, data: bytes) -> None:
        """Takes in what came."""

    @property
    def unread(self) -> bytes:
        """What was not taken out as an answer, nor may stand between two of them."""


class Conversation(ABC, Generic[Said, Answer]):
    """One connection's requests, each to be answered before the next is said."""

    def __init__(self, heard: Heard) -> None:
        self._heard = heard
        self._said: Said | None = None

    def say(self, said: Said) -> bytes:
        """The bytes of a request. Raises ReplyError if something came that nobody asked for."""
        if unasked := self._heard.unread:
            raise ReplyError(f"{unasked[:80]!r} came unasked, before {said!r}")
        self._said = said
        return self._written(said)

    def hear(self, data: bytes) -> Answer | None:
        """The answer to what was said last, once what came completes it.

        Raises CommandError where it is a refusal, ReplyError where it cannot be the answer, and
        ConnectionResetError at the end of the stream (b""), or of patience.
        """
        assert self._said is not None, "nothing was said"
        self._heard.feed(data)
        try:
            answer = self._answer(self._said)
        except ValueError as fault:
            raise ReplyError(f"{self._said!r} was answered with {fault}") from None
        if answer is None and (not data or len(self._heard.unread) > MAX_REPLY_BYTES):
            raise ConnectionResetError(f"the connection ended before the answer to {self._said!r}")
        return answer

    @abstractmethod
    def _written(self, said: Said) -> bytes:
        """A request as it goes over the wire."""

    @abstractmethod
    def _answer(self, said: Said) -> Answer | None:
        """Takes the answer out of what was heard; None until it is complete.

        Raises CommandError for a refusal, and ValueError, with words for what came, for what is no answer.
        """


class Language(NamedTuple, Generic[Said, Answer]):
    """A protocol, as a connection knows it."""

    conversation: Callable[[], Conversation[Said, Answer]]
    """Begins one, on a connection just opened."""
    at_rest: Request[Said, Answer, bool]
    """Asks whether the robot is."""


def exactly(count: int, name: str, values: Sequence[float]) -> list[float]:
    """The values as floats. Raises ValueError where there are more or fewer than `count`."""
    if len(values) != count:
        raise ValueError(f"{name}: expected {count} numbers, got {len(values)}")
    return [float(value) for value in values]


def refuse_endless(name: str, values: Iterable[float]) -> None:
    """Raises ValueError for values that are not finite."""
    numbers = tuple(values)
    if not all(map(isfinite, numbers)):
        raise ValueError(f"{name}: expected finite numbers, got {numbers}")

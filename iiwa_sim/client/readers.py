"""Readers of replies: each turns the text into a value and raises ValueError for a text that does not fit."""

import math
from collections.abc import Callable, Iterable
from typing import TypeVar

from iiwa_sim.client.replies import LastError, Reachability

T = TypeVar("T")


def nothing(word: str) -> Callable[[str], None]:
    """A reader for a reply that is just this word."""

    def read(text: str) -> None:
        if text != word:
            raise ValueError(text)

    return read


def one_of(*words: str) -> Callable[[str], str]:
    """A reader for a reply that is one of these words."""

    def read(text: str) -> str:
        if text not in words:
            raise ValueError(text)
        return text

    return read


def text(reply: str) -> str:
    """Reads any text."""
    return reply


def numbers(make: Callable[[Iterable[float]], T], count: int) -> Callable[[str], T]:
    """A reader for exactly `count` finite numbers."""
    return lambda reply: make(_each(reply, number, count))


def integers(make: Callable[[Iterable[int]], T], count: int) -> Callable[[str], T]:
    """A reader for exactly `count` integers."""
    return lambda reply: make(_each(reply, integer, count))


def number(reply: str) -> float:
    """Reads one finite number."""
    value = float(_plain(reply))
    if not math.isfinite(value):
        raise ValueError(reply)
    return value


def integer(reply: str) -> int:
    """Reads one integer."""
    return int(_plain(reply))


def state(reply: str) -> bool:
    """Reads the state of an input or an output: 1 is True, 0 is False."""
    if reply not in ("0", "1"):
        raise ValueError(reply)
    return reply == "1"


def states(reply: str) -> tuple[bool, ...]:
    """Reads any number of 1 and 0."""
    return tuple(state(word) for word in reply.split())


def last_error(reply: str) -> LastError:
    """Reads a code and a reason."""
    code, _, reason = reply.partition(" ")
    return LastError(_code(code), reason)


def reachability(reply: str) -> Reachability:
    """Reads `reachable`, or `unreachable` with a code and a reason."""
    if reply == "reachable":
        return Reachability(True, 0, "")
    verdict, _, why = reply.partition(" ")
    code, _, reason = why.partition(" ")
    if verdict != "unreachable":
        raise ValueError(reply)
    return Reachability(False, _code(code), reason)


def _each(reply: str, read: Callable[[str], T], count: int) -> list[T]:
    words = reply.split()
    if len(words) != count:
        raise ValueError(reply)
    return [read(word) for word in words]


def _plain(word: str) -> str:
    """The word. Raises ValueError for underscores and digits of other scripts, which Python would accept."""
    if "_" in word or not word.isascii():
        raise ValueError(word)
    return word


def _code(word: str) -> int:
    if not (word.isascii() and word.isdigit()):
        raise ValueError(word)
    return int(word)

"""From the text of a reply to a value; each raises ValueError where the text does not fit."""

import math
from collections.abc import Callable, Iterable
from typing import TypeVar

from iiwa_sim.client.replies import LastError, Reachability

T = TypeVar("T")


def nothing(word: str) -> Callable[[str], None]:
    """That word, of which there is nothing to be told."""

    def read(text: str) -> None:
        if text != word:
            raise ValueError(text)

    return read


def one_of(*words: str) -> Callable[[str], str]:
    """Any of these words."""

    def read(text: str) -> str:
        if text not in words:
            raise ValueError(text)
        return text

    return read


def text(reply: str) -> str:
    """Whatever it says."""
    return reply


def numbers(make: Callable[[Iterable[float]], T], count: int) -> Callable[[str], T]:
    """So many finite numbers."""
    return lambda reply: make(_each(reply, number, count))


def integers(make: Callable[[Iterable[int]], T], count: int) -> Callable[[str], T]:
    """So many whole numbers."""
    return lambda reply: make(_each(reply, integer, count))


def number(reply: str) -> float:
    """One finite number."""
    value = float(_plain(reply))
    if not math.isfinite(value):
        raise ValueError(reply)
    return value


def integer(reply: str) -> int:
    """One whole number."""
    return int(_plain(reply))


def state(reply: str) -> bool:
    """1 or 0, on or off."""
    if reply not in ("0", "1"):
        raise ValueError(reply)
    return reply == "1"


def states(reply: str) -> tuple[bool, ...]:
    """Any number of 1 and 0."""
    return tuple(state(word) for word in reply.split())


def last_error(reply: str) -> LastError:
    """A code and a reason."""
    code, _, reason = reply.partition(" ")
    return LastError(_code(code), reason)


def reachability(reply: str) -> Reachability:
    """`reachable`, or `unreachable` with a code and a reason."""
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
    """What holds no underscores and digits of other scripts, which Python would take in a number."""
    if "_" in word or not word.isascii():
        raise ValueError(word)
    return word


def _code(word: str) -> int:
    if not (word.isascii() and word.isdigit()):
        raise ValueError(word)
    return int(word)

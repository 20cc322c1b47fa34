"""How much of the same is told: what recurs hundreds of times a second must leave the log readable."""

import threading
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Generic, TypeVar

SECOND_NS = 1_000_000_000

Kind = TypeVar("Kind", bound=Hashable)


class Throttle(Generic[Kind]):
    """Of each kind the first few in a second are told. The second begins with the first of them.

    How many more there were is told before anything else is, of whatever kind. Threads may share one.
    """

    def __init__(self, most: int, tell_untold: Callable[[Kind, int], None] | None = None) -> None:
        """`most` is how many are told; `tell_untold` is called with a kind and how many were not."""
        self._most = most
        self._tell_untold = tell_untold
        self._seconds: dict[Kind, _Second] = {}  # in the order in which they began
        self._changed = threading.Lock()

    def count(self, kind: Kind, now_ns: int) -> int | None:
        """The how manieth in its second this one is, from 1 on; None if it is not to be told."""
        for over, untold in self._over(now_ns):
            if self._tell_untold is not None:
                self._tell_untold(over, untold)
        with self._changed:
            second = self._seconds.setdefault(kind, _Second(now_ns + SECOND_NS))
            if second.told >= self._most:
                second.untold += 1
                return None
            second.told += 1
            return second.told

    def _over(self, now_ns: int) -> list[tuple[Kind, int]]:
        """The kinds whose second is over and of which some were not told, with their number; each once."""
        found = []
        with self._changed:
            while self._seconds:
                first = next(iter(self._seconds))
                if self._seconds[first].until_ns > now_ns:
                    break
                untold = self._seconds.pop(first).untold
                if untold:
                    found.append((first, untold))
        return found


@dataclass
class _Second:
    """Of one kind: until when it lasts, and how many were told in it and not told."""

    until_ns: int
    told: int = 0
    untold: int = 0

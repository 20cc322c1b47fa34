"""Throttles repeated messages: an event that recurs hundreds of times a second must leave the log
readable."""

import threading
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Generic, TypeVar

SECOND_NS = 1_000_000_000

Kind = TypeVar("Kind", bound=Hashable)


class Throttle(Generic[Kind]):
    """Lets through the first few events of each kind per second, which begins with the first of them.

    The number of suppressed events is reported before the next event of any kind. Threads may share one.
    """

    def __init__(self, most: int, tell_untold: Callable[[Kind, int], None] | None = None) -> None:
        """`most` is the number let through; `tell_untold` is called with a kind and the number suppressed."""
        self._most = most
        self._tell_untold = tell_untold
        self._seconds: dict[Kind, _Second] = {}  # in the order of their beginning
        self._changed = threading.Lock()

    def count(self, kind: Kind, now_ns: int) -> int | None:
        """The number of this event in its second, from 1; None if it is to be suppressed."""
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
        """The kinds whose second is over, with the number of suppressed events if any; each once."""
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
    """One kind's second: when it ends, how many events were let through, and how many suppressed."""

    until_ns: int
    told: int = 0
    untold: int = 0

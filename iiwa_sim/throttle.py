"""Throttles repeated messages: an event that recurs hundreds of times a second must leave the log
readable."""

from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

SECOND_NS = 1_000_000_000

Kind = TypeVar("Kind", bound=Hashable)


class Throttle(Generic[Kind]):
    """Lets through the first few events of each kind per second, which begins with the first of them.

    The number of suppressed events is reported before the next event of any kind. Threads may share one.
    """

    def __init__(self, most: int, tell_untold: Callable[[Kind, int], None] = lambda *_: None) -> None:
        """`most` is the number let through; `tell_untold` is called with a kind and the number suppressed."""
        self._most = most
        self._tell_untold = tell_untold
        self._seconds: dict[Kind, tuple[int, int]] = {}  # when it ends, and its events

    def count(self, kind: Kind, now_ns: int) -> int | None:
        """The number of this event in its second, from 1; None if it is to be suppressed."""
        while self._seconds:
            over, (until_ns, events) = next(iter(self._seconds.items()))
            if until_ns > now_ns:
                break
            if self._seconds.pop(over, None) and events > self._most:
                self._tell_untold(over, events - self._most)
        until_ns, events = self._seconds.get(kind, (now_ns + SECOND_NS, 0))
        self._seconds[kind] = until_ns, events + 1
        return events + 1 if events < self._most else None

"""A set of numbers that takes no more room the more of them follow each other."""

from bisect import bisect_right
from collections.abc import Iterable


class Numbers:
    """Whole numbers, kept as ranges."""

    def __init__(self) -> None:
        self._firsts: list[int] = []
        self._lasts: list[int] = []  # of the same ranges; there is a number between two of them

    def __contains__(self, number: int) -> bool:
        before = bisect_right(self._firsts, number)
        return before > 0 and number <= self._lasts[before - 1]

    def __len__(self) -> int:
        """How many ranges there are."""
        return len(self._firsts)

    def update(self, numbers: Iterable[int]) -> None:
        """Add these."""
        for number in numbers:
            self._add(number)

    def drop_up_to(self, number: int) -> None:
        """Take out all up to this one."""
        gone = bisect_right(self._lasts, number)
        del self._firsts[:gone], self._lasts[:gone]
        if self._firsts:
            self._firsts[0] = max(self._firsts[0], number + 1)

    def clear(self) -> None:
        """Take out all."""
        self._firsts.clear()
        self._lasts.clear()

    def _add(self, number: int) -> None:
        at = bisect_right(self._firsts, number)
        if at and number <= self._lasts[at - 1]:
            return
        continues = at > 0 and self._lasts[at - 1] == number - 1
        leads_on = at < len(self._firsts) and self._firsts[at] == number + 1
        if continues and leads_on:
            del self._firsts[at], self._lasts[at - 1]
        elif continues:
            self._lasts[at - 1] = number
        elif leads_on:
            self._firsts[at] = number
        else:
            self._firsts.insert(at, number)
            self._lasts.insert(at, number)

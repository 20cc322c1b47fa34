"""Time that passes only when a test says so, and a robot that counts its ticks."""

from __future__ import annotations

from collections.abc import Callable

SECOND_NS = 1_000_000_000
MS_NS = 1_000_000


class HandTime:
    """A source of time, with the timer that goes with it."""

    def __init__(self) -> None:
        self.now_ns = 77 * SECOND_NS
        self.asked_ns: int | None = None
        self.wake: Callable[[], None] | None = None

    def now(self) -> int:
        return self.now_ns

    def open(self, wake: Callable[[], None]) -> HandTime:
        self.wake = wake
        return self

    def wake_at(self, instant_ns: int) -> None:
        self.asked_ns = instant_ns

    def close(self) -> None:
        self.wake = self.asked_ns = None

    def pass_until_woken(self, late_ns: int = 0) -> None:
        assert self.asked_ns is not None
        assert self.wake is not None
        self.now_ns = max(self.now_ns, self.asked_ns) + late_ns
        self.asked_ns = None
        self.wake()

    def pass_until(self, instant_ns: int) -> None:
        """Wakes the clock whenever it has asked for it, up to an instant."""
        while self.asked_ns is not None and max(self.now_ns, self.asked_ns) <= instant_ns:
            self.pass_until_woken()
        self.now_ns = instant_ns


class CountedRobot:
    """Moves for a number of ticks that a test sets."""

    def __init__(self, time: HandTime, tick_takes_ns: int = 0) -> None:
        self.at_ns: list[int] = []
        """When the ticks were made."""
        self.left = 0
        """Ticks until it has stopped."""
        self.accepted = 0
        """Moves that it was given."""
        self.waits = False
        """Whether only a command can end its motion."""
        self.rests = False
        """Whether ticks may be left out."""
        self.skipped = 0
        """Ticks that were."""
        self._time = time
        self._tick_takes_ns = tick_takes_ns

    def step(self) -> None:
        self.at_ns.append(self._time.now_ns)
        self._time.now_ns += self._tick_takes_ns
        if self.left and not self.waits:
            self.left -= 1

    @property
    def ticks(self) -> int:
        return len(self.at_ns)

    @property
    def moving(self) -> bool:
        return self.left > 0

    @property
    def under_way(self) -> bool:
        return self.moving and not self.waits

    @property
    def resting(self) -> bool:
        return self.rests and not self.moving

    def skip(self, ticks: int) -> None:
        assert self.resting
        self.skipped += ticks

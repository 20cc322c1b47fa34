"""Time that a test advances."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

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

    def call_at(self, when_s: float, wake: Callable[[], None]) -> Any:
        self.asked_ns, self.wake = round(1e9 * when_s), wake
        return self

    def cancel(self) -> None:
        self.wake = self.asked_ns = None

    def pass_until_woken(self, late_ns: int = 0) -> None:
        assert self.asked_ns is not None
        assert self.wake is not None
        self.now_ns = max(self.now_ns, self.asked_ns) + late_ns
        self.asked_ns = None
        self.wake()

    def pass_until(self, instant_ns: int) -> None:
        """Wake the clock whenever it has asked for it, up to an instant."""
        while self.asked_ns is not None and max(self.now_ns, self.asked_ns) <= instant_ns:
            self.pass_until_woken()
        self.now_ns = instant_ns

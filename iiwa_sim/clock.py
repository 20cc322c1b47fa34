"""When the next tick happens: real time, at absolute deadlines, with a bounded catch-up."""

import logging
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass

from iiwa_sim.timer import Timer, open_timer

MIN_RATE_HZ = 100
MAX_RATE_HZ = 1000
DEFAULT_RATE_HZ = 500

CATCH_UP_TICKS = 10
"""Ticks made up for at once. A virtual machine that stalls for 100 ms must not answer with a burst of 50
ticks, which would keep clients waiting and show them a robot that jumps: what lies further back is
dropped."""

_SECOND_NS = 1_000_000_000

logger = logging.getLogger(__name__)


class RealTimeClock:
    """Makes `rate_hz` steps a second while the asyncio loop runs.

    Deadlines are absolute: a late tick does not delay the following ones. After a stall at most
    `CATCH_UP_TICKS` are made up for and the rest is dropped, so simulated time then lags behind real time for
    good. `step` may fail: the clock logs the traceback (once a second for a fault that recurs at the same
    place) and goes on.

    `now_ns` and `timer` are the source of time; tests put their own in. Raises ValueError for a rate outside
    100 to 1000 Hz.
    """

    def __init__(
        self,
        rate_hz: int = DEFAULT_RATE_HZ,
        *,
        now_ns: Callable[[], int] = time.monotonic_ns,
        timer: Callable[[Callable[[], None]], Timer] = open_timer,
    ) -> None:
        if not MIN_RATE_HZ <= rate_hz <= MAX_RATE_HZ:
            raise ValueError(f"rate_hz is {rate_hz}, expected {MIN_RATE_HZ} to {MAX_RATE_HZ}")
        self.tick_s = 1.0 / rate_hz
        self.dropped_ticks = 0
        self._period_ns = round(_SECOND_NS / rate_hz)
        self._now_ns = now_ns
        self._open_timer = timer
        self._timer: Timer | None = None
        self._deadline_ns = 0
        self._faults: dict[tuple[str, str, int | None], _Recurring] = {}

    def start(self, step: Callable[[], None]) -> None:
        """Call `step` at every tick, first one period from now. Must be called inside the running loop."""
        self._step = step
        self._timer = self._open_timer(self._wake)
        self._deadline_ns = self._now_ns() + self._period_ns
        self._timer.wake_at(self._deadline_ns)

    def stop(self) -> None:
        """Tick no more. Does nothing if the clock does not run."""
        if self._timer is not None:
            self._timer.close()
            self._timer = None

    def _wake(self) -> None:
        now_ns = self._now_ns()
        due = max(0, (now_ns - self._deadline_ns) // self._period_ns + 1)
        self._deadline_ns += due * self._period_ns
        for _ in range(min(due, CATCH_UP_TICKS)):
            try:
                self._step()
            except Exception as fault:
                recurring = self._recurring(fault)
                if now_ns >= recurring.quiet_until_ns:
                    logger.exception(
                        "internal fault in a tick (%d more since the last one)", recurring.unreported
                    )
                    recurring.quiet_until_ns = now_ns + _SECOND_NS
                    recurring.unreported = 0
                else:
                    recurring.unreported += 1
        if due > CATCH_UP_TICKS:
            self._drop(due - CATCH_UP_TICKS)
        if self._timer is not None:
            self._timer.wake_at(self._deadline_ns)

    def _drop(self, ticks: int) -> None:
        self.dropped_ticks += ticks
        logger.debug("the machine stalled: %d ticks (%.0f ms) dropped", ticks, ticks * self._period_ns * 1e-6)

    def _recurring(self, fault: Exception) -> "_Recurring":
        where = traceback.extract_tb(fault.__traceback__)[-1]
        kind = (type(fault).__name__, where.filename, where.lineno)
        return self._faults.setdefault(kind, _Recurring())


@dataclass
class _Recurring:
    """A kind of fault: until when it is not logged again, and how often it was not."""

    quiet_until_ns: int = 0
    unreported: int = 0

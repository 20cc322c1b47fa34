"""The clock's arithmetic, on a time source of our own; and once on the machine's own timers."""

import asyncio
import logging
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim import timer
from iiwa_sim.clock import CATCH_UP_TICKS, RealTimeClock

SECOND_NS = 1_000_000_000
MS_NS = 1_000_000


class HandTime:
    """Time that passes only when a test says so, with the timer that goes with it."""

    def __init__(self) -> None:
        self.now_ns = 77 * SECOND_NS
        self.wake: Callable[[], None] | None = None
        self.asked_ns: int | None = None

    def open(self, wake: Callable[[], None]) -> "HandTime":
        self.wake = wake
        return self

    def wake_at(self, instant_ns: int) -> None:
        self.asked_ns = instant_ns

    def close(self) -> None:
        self.wake = None

    def pass_until_woken(self, late_ns: int = 0) -> None:
        assert self.asked_ns is not None
        assert self.wake is not None
        self.now_ns = max(self.now_ns, self.asked_ns) + late_ns
        self.asked_ns = None
        self.wake()


class Ticks:
    """Counts ticks, and notes when they happened."""

    def __init__(self, time: HandTime) -> None:
        self._time = time
        self.at_ns: list[int] = []

    def __call__(self) -> None:
        self.at_ns.append(self._time.now_ns)


def started(rate_hz: int, step: Callable[[], None], time: HandTime) -> RealTimeClock:
    clock = RealTimeClock(rate_hz, now_ns=lambda: time.now_ns, timer=time.open)
    clock.start(step)
    return clock


@given(rate_hz=st.integers(100, 1000), late_ns=st.lists(st.integers(0, 900_000), min_size=1, max_size=300))
def test_late_wake_ups_do_not_shift_later_ticks(rate_hz: int, late_ns: list[int]) -> None:
    time = HandTime()
    ticks = Ticks(time)
    start_ns = time.now_ns
    clock = started(rate_hz, ticks, time)
    for late in late_ns:
        time.pass_until_woken(late)
    period_ns = round(SECOND_NS / rate_hz)
    assert ticks.at_ns == [start_ns + n * period_ns + late for n, late in enumerate(late_ns, start=1)]
    assert clock.dropped_ticks == 0


@given(rate_hz=st.integers(100, 1000), stalls_ns=st.lists(st.integers(0, 300 * MS_NS), max_size=50))
def test_every_tick_is_made_or_counted_as_dropped(rate_hz: int, stalls_ns: list[int]) -> None:
    time = HandTime()
    ticks = Ticks(time)
    start_ns = time.now_ns
    clock = started(rate_hz, ticks, time)
    for stall_ns in stalls_ns:
        before = len(ticks.at_ns)
        time.pass_until_woken(stall_ns)
        assert 1 <= len(ticks.at_ns) - before <= CATCH_UP_TICKS
    elapsed_ticks = (time.now_ns - start_ns) // round(SECOND_NS / rate_hz)
    assert len(ticks.at_ns) + clock.dropped_ticks == elapsed_ticks


def test_a_stall_is_caught_up_in_part_and_the_rest_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    time = HandTime()
    ticks = Ticks(time)
    clock = started(500, ticks, time)
    with caplog.at_level(logging.DEBUG):
        time.pass_until_woken(late_ns=120 * MS_NS)  # the tick that was due and 60 more
    assert len(ticks.at_ns) == CATCH_UP_TICKS
    assert clock.dropped_ticks == 61 - CATCH_UP_TICKS
    assert [record.getMessage() for record in caplog.records] == [
        "the machine stalled: 51 ticks (102 ms) dropped"
    ]
    time.pass_until_woken()
    assert len(ticks.at_ns) == CATCH_UP_TICKS + 1


def test_a_wake_up_before_the_deadline_makes_no_tick() -> None:
    time = HandTime()
    ticks = Ticks(time)
    started(500, ticks, time)
    asked_ns = time.asked_ns
    assert time.wake is not None
    time.wake()
    assert ticks.at_ns == []
    assert time.asked_ns == asked_ns


def test_a_failing_tick_is_logged_once_a_second_for_each_kind_and_the_clock_goes_on(
    caplog: pytest.LogCaptureFixture,
) -> None:
    time = HandTime()
    calls = 0

    def step() -> None:
        nonlocal calls
        calls += 1
        if calls % 2:
            raise ZeroDivisionError("odd")
        raise KeyError("even")

    started(500, step, time)
    for _ in range(1000):  # two seconds
        time.pass_until_woken()
    assert calls == 1000
    faults = [record for record in caplog.records if record.levelno == logging.ERROR]
    assert [record.exc_info[0] for record in faults if record.exc_info] == [ZeroDivisionError, KeyError] * 2
    assert "249 more since" in faults[2].getMessage()


def test_a_stopped_clock_makes_no_ticks_and_can_start_again() -> None:
    time = HandTime()
    ticks = Ticks(time)
    clock = started(500, ticks, time)
    clock.stop()
    clock.stop()
    assert time.wake is None
    clock.start(ticks)
    time.pass_until_woken()
    assert len(ticks.at_ns) == 1


@pytest.mark.parametrize("rate_hz", [99, 1001, 0, -500])
def test_a_rate_out_of_range_is_refused(rate_hz: int) -> None:
    with pytest.raises(ValueError, match="expected 100 to 1000"):
        RealTimeClock(rate_hz)


@pytest.mark.parametrize("kind", [timer.LoopTimer, timer.open_timer])
async def test_the_machines_timers_wake_the_clock(kind: Callable[[Callable[[], None]], timer.Timer]) -> None:
    done = asyncio.Event()
    ticks = 0

    def step() -> None:
        nonlocal ticks
        ticks += 1
        if ticks == 20:
            done.set()

    clock = RealTimeClock(1000, timer=kind)
    clock.start(step)
    try:
        async with asyncio.timeout(30):
            await done.wait()
    finally:
        clock.stop()


@pytest.mark.parametrize("kind", [timer.LoopTimer, timer.open_timer])
async def test_a_timer_forgets_the_instant_it_was_set_to_before(
    kind: Callable[[Callable[[], None]], timer.Timer],
) -> None:
    loop = asyncio.get_running_loop()
    woken_at: asyncio.Future[float] = loop.create_future()
    own = kind(lambda: woken_at.set_result(loop.time()))  # a second call would raise
    later_s = loop.time() + 0.05
    own.wake_at(1)
    own.wake_at(round(later_s * 1e9))
    try:
        async with asyncio.timeout(30):
            assert await woken_at >= later_s - 1e-6
    finally:
        own.close()

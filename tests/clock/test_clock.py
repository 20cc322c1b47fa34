"""The clock's arithmetic, on a time source of our own; and once on the machine's own timers."""

from __future__ import annotations

import asyncio
import logging
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.clock.clock import (
    CATCH_UP_WAKES,
    HOLD_NS,
    REST_SLEEP_NS,
    SLICE_NS,
    Clock,
    StillMoving,
)
from iiwa_sim.clock.pace import FAST, REAL, STEPPED, Pace, pace
from tests.clock.hand_time import MS_NS, SECOND_NS, HandTime


class CountedRobot:
    """Moves for a number of ticks that a test sets."""

    def __init__(self, time: HandTime, tick_takes_ns: int = 0) -> None:
        self.at_ns: list[int] = []
        """Times of the ticks."""
        self.left = 0
        """Ticks until it has stopped."""
        self.accepted = 0
        """Moves that it was given."""
        self.waits = False
        """True if only a command can end its motion."""
        self.rests = False
        """True if ticks may be left out."""
        self.skipped = 0
        """Ticks that were."""
        self._time = time
        self._tick_takes_ns = tick_takes_ns

    def step(self, at_most: int = 1) -> int:
        assert at_most > 0
        self.at_ns.append(self._time.now_ns)
        self._time.now_ns += self._tick_takes_ns
        if self.left and not self.waits:
            self.left -= 1
        return 1

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


def started(robot: CountedRobot, time: HandTime, rate_hz: int = 500, pace: Pace = REAL) -> Clock:
    clock = Clock(rate_hz, pace, now_ns=time.now, call_at=time.call_at)
    clock.start(robot)
    return clock


@given(rate_hz=st.integers(100, 1000), late_ns=st.lists(st.integers(0, 900_000), min_size=1, max_size=300))
def test_late_wake_ups_do_not_shift_later_ticks(rate_hz: int, late_ns: list[int]) -> None:
    time = HandTime()
    robot = CountedRobot(time)
    start_ns = time.now_ns
    clock = started(robot, time, rate_hz)
    for late in late_ns:
        time.pass_until_woken(late)
    period_ns = round(SECOND_NS / rate_hz)
    assert robot.at_ns == [start_ns + n * period_ns + late for n, late in enumerate(late_ns, start=1)]
    assert clock.dropped_ticks == 0


multiples = st.floats(0.01, 100.0).map(lambda speed: pace(f"{speed:.6f}x"))
paces = st.one_of(st.sampled_from([REAL, FAST]), multiples)


@given(
    rate_hz=st.integers(100, 1000), pace=paces, stalls_ns=st.lists(st.integers(0, 300 * MS_NS), max_size=50)
)
def test_every_tick_of_a_pace_is_made_or_counted_as_dropped(
    rate_hz: int, pace: Pace, stalls_ns: list[int]
) -> None:
    time = HandTime()
    robot = CountedRobot(time)
    start_ns = time.now_ns
    clock = started(robot, time, rate_hz, pace)
    period_ns = round(SECOND_NS / (rate_hz * pace.speed))
    for stall_ns in stalls_ns:
        before, now_ns = robot.ticks, time.now_ns
        time.pass_until_woken(stall_ns)
        at_once = (time.now_ns - stall_ns - now_ns) // period_ns + 1
        assert 1 <= robot.ticks - before <= CATCH_UP_WAKES * max(1, at_once)
    elapsed_ticks = (time.now_ns - start_ns) // period_ns
    assert robot.ticks + clock.dropped_ticks == elapsed_ticks


def test_a_stall_is_caught_up_in_part_and_the_rest_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    time = HandTime()
    robot = CountedRobot(time)
    clock = started(robot, time)
    with caplog.at_level(logging.DEBUG):
        time.pass_until_woken(late_ns=120 * MS_NS)  # the tick that was due and 60 more
    assert robot.ticks == CATCH_UP_WAKES
    assert clock.dropped_ticks == 61 - CATCH_UP_WAKES
    assert [record.getMessage() for record in caplog.records] == [
        "the machine stalled: 51 ticks (102 ms) dropped"
    ]
    time.pass_until_woken()
    assert robot.ticks == CATCH_UP_WAKES + 1


class TestFast:
    """As fast as possible while the robot moves."""

    def test_ticks_follow_each_other_while_the_robot_is_under_way(self) -> None:
        time = HandTime()
        robot = CountedRobot(time, tick_takes_ns=4000)
        clock = started(robot, time, pace=FAST)
        robot.left = 5000
        clock.commanded()
        before_ns = time.now_ns
        while robot.moving:
            time.pass_until_woken()
        assert robot.ticks == 5000
        assert time.now_ns - before_ns == 5000 * 4000, "ten seconds in the time the ticks need"

    def test_at_rest_ticks_come_in_real_time_and_the_machine_sleeps(self) -> None:
        time = HandTime()
        robot = CountedRobot(time)
        started(robot, time, pace=FAST)
        time.pass_until(time.now_ns + 10 * SECOND_NS)
        assert robot.ticks == 5000
        assert len(set(robot.at_ns)) == 10 * SECOND_NS // REST_SLEEP_NS

    def test_time_stands_still_while_a_driver_sends_moves(self) -> None:
        time = HandTime()
        robot = CountedRobot(time)
        clock = started(robot, time, pace=FAST)
        start_ns = time.now_ns
        for _ in range(10):
            robot.left += 100
            robot.accepted += 1
            clock.commanded()
            time.pass_until(time.now_ns + HOLD_NS - 1)
        assert robot.ticks == 0
        time.pass_until_woken()
        assert robot.ticks == 1000
        assert time.now_ns == start_ns + 9 * (HOLD_NS - 1) + HOLD_NS

    def test_time_continues_for_a_driver_that_sends_no_more(self) -> None:
        time = HandTime()
        robot = CountedRobot(time)
        clock = started(robot, time, pace=FAST)
        for _ in range(2):
            robot.left = 100
            robot.accepted += 1
            clock.commanded(awaited=True)
            assert time.asked_ns == time.now_ns + HOLD_NS, "what is accepted now is held"
            clock.commanded(awaited=True)
            assert time.asked_ns == 1, "at once"
            time.pass_until_woken()
            assert robot.left == 0
        clock.commanded(awaited=True)
        assert robot.ticks == 200


class TestAdvance:
    """Ticks that are asked for."""

    @pytest.mark.parametrize("pace", [REAL, FAST, STEPPED])
    @pytest.mark.parametrize(("seconds", "ticks"), [(0.0, 0), (0.0021, 2), (3.0, 1500)])
    async def test_advance_makes_just_these_ticks(self, pace: Pace, seconds: float, ticks: int) -> None:
        time = HandTime()
        robot = CountedRobot(time, tick_takes_ns=1000)
        clock = started(robot, time, pace=pace)
        async with asyncio.TaskGroup() as group:
            advanced = group.create_task(clock.advance(seconds))
            await asyncio.sleep(0)
            while not advanced.done():
                before_ns = time.now_ns
                time.pass_until_woken()
                assert time.now_ns - before_ns <= SLICE_NS + 1000, "clients are served in between"
                await asyncio.sleep(0)
                await asyncio.sleep(0)
        assert robot.ticks == ticks

    async def test_a_robot_still_moving_at_the_limit_is_reported(self) -> None:
        time = HandTime()
        robot = CountedRobot(time)
        clock = started(robot, time, pace=STEPPED)
        robot.left = 1000
        waiting = asyncio.ensure_future(clock.run_until_stopped(1.0))
        await asyncio.sleep(0)
        time.pass_until_woken()
        with pytest.raises(StillMoving, match="still moves after 1 s of simulated time"):
            await waiting
        assert robot.ticks == 500

    async def test_a_cancelled_caller_gets_no_more_ticks(self) -> None:
        time = HandTime()
        robot = CountedRobot(time, tick_takes_ns=4000)
        clock = started(robot, time, pace=STEPPED)
        waiting = asyncio.ensure_future(clock.advance(3600.0))
        await asyncio.sleep(0)
        time.pass_until_woken()
        made = robot.ticks
        assert 0 < made < 1800
        waiting.cancel()
        await asyncio.wait([waiting])
        time.pass_until_woken()
        assert (robot.ticks, time.asked_ns) == (made, None)

    async def test_a_stopped_clock_ends_all_waits(self) -> None:
        clock = started(CountedRobot(HandTime()), HandTime(), pace=STEPPED)
        waiting = asyncio.ensure_future(clock.advance(1.0))
        await asyncio.sleep(0)
        clock.stop()
        with pytest.raises(RuntimeError, match="stopped"):
            await waiting
        with pytest.raises(RuntimeError, match="does not run"):
            await clock.advance(1.0)

    async def test_a_time_out_of_range_is_refused(self) -> None:
        clock = started(CountedRobot(HandTime()), HandTime())
        for seconds in (-0.001, 86401.0, float("nan"), float("inf")):
            for wait in (clock.advance, clock.run_until_stopped):
                with pytest.raises(ValueError, match="expected 0 to 86400"):
                    await wait(seconds)


def resting(time: HandTime, pace: Pace = REAL) -> tuple[CountedRobot, Clock]:
    robot = CountedRobot(time)
    robot.rests = True
    return robot, started(robot, time, pace=pace)


class TestRest:
    """Ticks of a resting robot are left out, and made up for at the next question."""

    @given(pace=paces, rest_ns=st.lists(st.integers(0, 10 * SECOND_NS), min_size=1, max_size=20))
    def test_all_ticks_of_a_rest_are_made_on_the_next_question_and_none_is_dropped(
        self, pace: Pace, rest_ns: list[int]
    ) -> None:
        time = HandTime()
        start_ns = time.now_ns
        robot, clock = resting(time, pace)
        period_ns = round(SECOND_NS / (500 * pace.speed))
        for rest in rest_ns:
            time.pass_until(time.now_ns + rest)
            clock.catch_up()
            assert robot.skipped == (time.now_ns - start_ns) // period_ns
        assert (robot.ticks, clock.dropped_ticks) == (0, 0)

    @pytest.mark.parametrize("pace", [REAL, pace("10x")])
    def test_a_move_after_a_rest_begins_at_the_next_tick_of_the_pace(self, pace: Pace) -> None:
        time = HandTime()
        start_ns = time.now_ns
        robot, clock = resting(time, pace)
        time.now_ns += 3600 * SECOND_NS + 100_000
        clock.catch_up()
        robot.left = 5
        robot.accepted += 1
        clock.commanded()
        period_ns = round(SECOND_NS / (500 * pace.speed))
        begun_ns = time.now_ns
        while time.asked_ns is not None:
            time.pass_until_woken()
        assert robot.ticks == 5
        assert robot.skipped * period_ns >= begun_ns - start_ns - period_ns
        assert time.now_ns <= begun_ns + 5 * period_ns + MS_NS
        time.now_ns += SECOND_NS
        clock.catch_up()
        assert 5 + robot.skipped == (time.now_ns - start_ns) // period_ns

    @pytest.mark.parametrize("pace", [REAL, FAST, STEPPED])
    async def test_a_day_of_rest_is_advanced_at_once(self, pace: Pace) -> None:
        time = HandTime()
        robot, clock = resting(time, pace)
        advanced = asyncio.ensure_future(clock.advance(86_400.0))
        await asyncio.sleep(0)
        time.pass_until_woken()
        await advanced
        assert (robot.ticks, robot.skipped) == (0, 86_400 * 500)


@pytest.mark.parametrize("pace", [REAL, FAST, pace("10x")])
def test_a_paused_clock_makes_no_ticks_and_resumes_without_catching_up(pace: Pace) -> None:
    time = HandTime()
    robot = CountedRobot(time)
    clock = started(robot, time, pace=pace)
    time.pass_until(time.now_ns + SECOND_NS)
    clock.pause()
    robot.left, before = 50, robot.ticks
    clock.commanded()
    time.pass_until(time.now_ns + SECOND_NS)
    assert (robot.ticks, clock.paused) == (before, True)
    robot.left = 0
    clock.resume()
    time.pass_until(time.now_ns + SECOND_NS)
    assert robot.ticks - before == pytest.approx(500 * pace.speed, rel=0.001)
    assert not clock.paused


def test_the_pace_changes_in_mid_motion() -> None:
    time = HandTime()
    robot = CountedRobot(time)
    clock = started(robot, time, pace=STEPPED)
    time.pass_until(time.now_ns + SECOND_NS)
    assert robot.ticks == 0
    for changed, ticks in ((REAL, 500), (pace("10x"), 5000), (STEPPED, 0), (FAST, 500)):
        before = robot.ticks
        clock.set_pace(changed)
        time.pass_until(time.now_ns + SECOND_NS)
        assert robot.ticks - before == pytest.approx(ticks, abs=5), changed
        assert clock.pace is changed


def test_a_failing_tick_is_logged_once_a_second_for_each_kind_and_the_clock_continues(
    caplog: pytest.LogCaptureFixture,
) -> None:
    class FailingRobot(CountedRobot):
        def step(self, at_most: int = 1) -> int:
            super().step(at_most)
            if self.ticks % 2:
                raise ZeroDivisionError("odd")
            raise KeyError("even")

    time = HandTime()
    robot = FailingRobot(time)
    started(robot, time)
    for _ in range(1000):  # two seconds
        time.pass_until_woken()
    assert robot.ticks == 1000
    faults = [record for record in caplog.records if record.levelno == logging.ERROR]
    assert [record.exc_info[0] for record in faults if record.exc_info] == [ZeroDivisionError, KeyError] * 2


@pytest.mark.parametrize("fixed", [REAL, FAST, STEPPED, pace("2.5x")])
def test_a_pace_has_a_name(fixed: Pace) -> None:
    assert pace(fixed.name) == fixed


@pytest.mark.parametrize("name", ["", "x", "0x", "0.001x", "101x", "1e1x", "-1x", "nanx", " 10x", "Fast", 10])
def test_an_unknown_pace_is_rejected_with_the_range(name: Any) -> None:
    with pytest.raises(ValueError, match="expected real, a multiple of real time from"):
        pace(name)

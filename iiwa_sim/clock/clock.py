"""The clock makes ticks inside the asyncio loop: at a pace, or many at once on request."""

import asyncio
import logging
import time
import traceback
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import ceil

from iiwa_sim.clock.pace import REAL, Pace
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.controller_group import ControllerGroup
from iiwa_sim.log import Throttle

DEFAULT_RATE_HZ = 500

CATCH_UP_WAKES = 10
"""Most wake-ups whose ticks are made up for at once; the rest is dropped.
After a stall of 100 ms, a burst of 50 ticks would keep clients waiting, and the robot would seem to jump."""

SHORTEST_SLEEP_NS = 1_000_000
"""Shortest time between two wake-ups; if ticks are closer, a wake-up makes several."""

REST_SLEEP_NS = 20_000_000
"""Time between two wake-ups of a fast clock while the robot rests: a test then costs hardly any time."""

SLICE_NS = 5_000_000
"""Time for which a fast clock makes ticks before the loop and other threads get their turn."""

HOLD_NS = 2_000_000
"""A fast clock holds simulated time for so long after a move was accepted.
In real time, a driver sends a sequence of moves within a tick, and the robot blends them: the hold gives the
driver that time. It ends early for a driver that only repeats a question."""

LONGEST_HOLD_NS = 50_000_000
"""Longest hold, for a driver that never stops sending moves."""

LONGEST_ADVANCE_S = 86400.0

AT_ONCE = 1
"""An instant that has passed: the loop gets its turn, no more."""

Stepped = Controller | ControllerGroup
__tracebackhide__ = True
logger = logging.getLogger(__name__)


class StillMoving(TimeoutError):
    """The robot has not stopped within the limit."""


@dataclass
class _Advance:
    """Ticks that are made at once, at any pace, for a caller that waits for them."""

    ticks: int
    until_stopped: bool
    done: asyncio.Future[bool]
    """True if the robot has stopped."""
    made: int = 0

    def go_on(
        self, robot: Stepped, step: Callable[[int], int], now_ns: Callable[[], int], end_ns: int
    ) -> bool:
        """Make ticks of the robot by `step`, until `end_ns`; return True if the advance is over."""
        while not self.done.done():  # or the caller has been cancelled
            if not self.until_stopped and robot.resting:
                robot.skip(self.ticks - self.made)
                self.made = self.ticks
            if self.made >= self.ticks or (self.until_stopped and not robot.moving):
                self.done.set_result(not robot.moving)
                break
            self.made += step(self.ticks - self.made)
            if now_ns() >= end_ns:
                return False
        return True


class Clock:
    """Source of ticks of 1 / `rate_hz` simulated seconds, which the pace spreads over real time.

    - At a multiple of real time there are absolute deadlines: a late tick does not delay the following ones.
      After a stall the clock makes up for ticks up to a bound and drops the rest. Simulated time then lags
      behind for good.
    - `FAST` makes ticks as fast as possible while the robot moves, in slices of 5 ms with the
      loop's turn in between, and in real time while it rests. A driver that sleeps until something has
      happened needs no change. For `HOLD_NS` after a move was accepted time stands still.
    - `STEPPED`, or a clock that is paused, makes none by itself.
    - While the robot is `resting` no timer is set, at any pace. Later the clock makes up for all ticks
      that are due, and drops none. A caller that reads or commands the robot calls `catch_up` before and
      `commanded` after it, or `look`.

    `advance` and `run_until_stopped` make ticks as fast as possible at any pace, in the order in which they
    are called. A fault in a tick is logged, and the clock continues. All methods run inside the loop.
    """

    def __init__(
        self,
        rate_hz: int = DEFAULT_RATE_HZ,
        pace: Pace = REAL,
        *,
        now_ns: Callable[[], int] = time.monotonic_ns,
        call_at: Callable[[float, Callable[[], None]], asyncio.Handle] | None = None,
    ) -> None:
        """`now_ns` and `call_at` are the source of time, by default the system's and the running loop's."""
        self.tick_s = 1.0 / rate_hz
        self.dropped_ticks = 0
        self.rate_hz = rate_hz
        self._now_ns = now_ns
        self._call_at = call_at
        self._timer: asyncio.Handle | None = None
        self._asked_ns = self._deadline_ns = 0  # what the timer is set to; of the next tick at the pace
        self._runs = False
        self.paused = self._idles = False  # idle: no timer is set, since the robot is resting
        self._advances: deque[_Advance] = deque()
        self._held_since_ns: int | None = None
        self._held_until_ns = self._accepted = 0  # accepted moves are no news
        self._faults = Throttle(1)
        self._take(pace)

    def start(self, robot: Stepped) -> None:
        """Make ticks from now on; at a pace the first one period from now. Must be called inside the loop."""
        self._robot, self._accepted = robot, robot.accepted
        self._runs, self._idles = True, False
        self._count_anew()
        self._sleep()

    def stop(self) -> None:
        """Make no more ticks; callers that wait for some get RuntimeError. A stopped clock stays so."""
        self._make_up_for_rest()
        if self._timer is not None:
            self._timer.cancel()
        self._asked_ns, self._runs, self._idles = 0, False, False
        while self._advances:
            done = self._advances.popleft().done
            if not done.done():
                done.set_exception(RuntimeError("the clock was stopped"))

    def drive(self, robot: Stepped) -> None:
        """Step this from the next tick on, in place of what `start` was given."""
        self._make_up_for_rest()
        self._robot = robot
        self._sleep()  # it may be resting where the other was not

    @property
    def ignores_real_time(self) -> bool:
        """Return True if ticks do not follow real time, and may take longer."""
        return bool(self._advances) or self.pace.is_fast or not self.pace.speed

    @property
    def label(self) -> str:
        """The name of the pace, followed by `paused` if the clock is paused."""
        return f"{self.pace.name} paused" if self.paused else self.pace.name

    def set_pace(self, pace: Pace) -> None:
        """Make ticks at another pace from now on. A pause continues."""
        self._make_up_for_rest()
        self._take(pace)
        if self._runs:
            self._accepted = self._robot.accepted
        self._count_anew()
        self._sleep()

    def pause(self) -> None:
        """Make ticks only on request, until `resume`."""
        self._make_up_for_rest()
        self.paused, self._idles = True, False

    def resume(self) -> None:
        """Go on at the pace. Time that has passed since `pause` is not made up for."""
        if self.paused:
            self.paused = False
            self._count_anew()
            self._sleep()

    def commanded(self, awaited: bool = False) -> None:
        """Look for new moves after commands; `awaited` if the sender of the newest one waits for it."""
        if not self._runs or not (self.pace.is_fast or self._idles):
            return
        if self.pace.is_fast and self._accepted != (accepted := self._robot.accepted):
            self._accepted = accepted
            now_ns = self._now_ns()
            if self._held_since_ns is None:
                self._held_since_ns = now_ns
            self._held_until_ns = min(now_ns + HOLD_NS, self._held_since_ns + LONGEST_HOLD_NS)
        elif awaited:
            self._held_until_ns = AT_ONCE
        self._sleep()

    def catch_up(self) -> None:
        """Make the ticks that are due by now, before a caller reads or commands the robot."""
        if self._idles:
            self._make_up_for_rest()
        elif AT_ONCE < self._asked_ns <= self._now_ns() and not self._runs_fast:
            self._wake()  # ticks of a fast clock are never due: `commanded` may hold them

    def look(self) -> None:
        """Catch up, and make the next tick when it is due, whether the robot is resting or not.

        A caller with the robot itself may begin a motion without `commanded`.
        """
        if self._idles:
            self._make_up_for_rest()
            self._idles = False
            self._set_timer(self._deadline_ns)

    async def advance(self, seconds: float) -> None:
        """Make as many ticks as `seconds` (0 to a day, simulated) need, the last one begun counted whole.

        Raises ValueError for a time out of range, and RuntimeError if the clock does not run.
        """
        await self._run(seconds, until_stopped=False)

    async def run_until_stopped(self, limit_s: float) -> float:
        """Make ticks until the robot has stopped, none if it does not move; return the seconds that passed.

        Raises StillMoving if it has not after `limit_s` (0 to a day, simulated); otherwise as `advance`.
        """
        advance = await self._run(limit_s, until_stopped=True)
        if not advance.done.result():
            raise StillMoving(f"the robot still moves after {limit_s:g} s of simulated time")
        return advance.made * self.tick_s

    async def _run(self, seconds: float, *, until_stopped: bool) -> _Advance:
        if not 0.0 <= seconds <= LONGEST_ADVANCE_S:
            raise ValueError(f"{seconds:g} s of simulated time: expected 0 to {LONGEST_ADVANCE_S:g}")
        if not self._runs:
            raise RuntimeError("the clock does not run")
        ticks = ceil(seconds * self.rate_hz - 1e-6)  # 0.07 * 100 is more than 7
        advance = _Advance(ticks, until_stopped, asyncio.get_running_loop().create_future())
        self._make_up_for_rest()
        self._advances.append(advance)
        self._sleep()
        await advance.done
        return advance

    def _take(self, pace: Pace) -> None:
        self.pace = pace
        if pace.speed > 0.0:
            self._period_ns = round(1e9 / (self.rate_hz * pace.speed))
            sleep_ns = REST_SLEEP_NS if pace.is_fast else SHORTEST_SLEEP_NS
            self._ticks_per_wake = max(1, ceil(sleep_ns / self._period_ns))

    def _count_anew(self) -> None:
        """Make the next tick at the pace due one period from now."""
        if self.pace.speed > 0.0:
            self._deadline_ns = self._now_ns() + self._period_ns

    @property
    def _runs_fast(self) -> bool:
        return self.pace.is_fast and not self.paused and self._robot.under_way

    def _sleep(self) -> None:
        """Set the timer to when there is something to do."""
        if not self._runs:
            return
        self._idles = False
        if self._advances:
            instant_ns = AT_ONCE
        elif self._runs_fast:
            instant_ns = AT_ONCE if self._held_since_ns is None else self._held_until_ns
        elif self.paused or not self.pace.speed:
            return  # a wake-up asked for before finds nothing to do
        elif self._robot.resting:
            self._idles = True
            return
        else:
            instant_ns = self._deadline_ns + (self._ticks_per_wake - 1) * self._period_ns
        self._set_timer(instant_ns)

    def _set_timer(self, instant_ns: int) -> None:
        if instant_ns != self._asked_ns:
            if self._timer is not None:
                self._timer.cancel()
            call_at = self._call_at or asyncio.get_running_loop().call_at
            self._asked_ns, self._timer = instant_ns, call_at(instant_ns * 1e-9, self._wake)

    def _wake(self) -> None:
        self._asked_ns = 0
        now_ns = self._now_ns()
        if self._advances:
            if self._advances[0].go_on(self._robot, self._step, self._now_ns, now_ns + SLICE_NS):
                self._advances.popleft()
            self._count_anew()
        elif self._runs_fast:
            if self._held_since_ns is None or now_ns >= self._held_until_ns:
                self._held_since_ns = None
                self._run_fast(now_ns)
                self._count_anew()
        elif not self.paused and self.pace.speed:
            self._make_due(now_ns)
        self._sleep()

    def _run_fast(self, now_ns: int) -> None:
        """Make ticks faster than real time for `SLICE_NS`, or until there is nothing to do."""
        step, robot = self._step, self._robot
        end_ns = now_ns + SLICE_NS
        while robot.under_way and self._now_ns() < end_ns:
            step(self.rate_hz)

    def _make_up_for_rest(self) -> None:
        """Make the ticks for which no timer was set, since the robot was at rest."""
        if self._idles:
            self._make_due(self._now_ns())

    def _make_due(self, now_ns: int) -> None:
        """Make the ticks that are due at the pace."""
        if (due := (now_ns - self._deadline_ns) // self._period_ns + 1) <= 0:
            return
        self._deadline_ns += due * self._period_ns
        if self._robot.resting:
            self._robot.skip(due)
            return
        most = CATCH_UP_WAKES * self._ticks_per_wake
        for _ in range(min(due, most)):
            self._step()
        if (dropped := due - most) > 0:
            self.dropped_ticks += dropped
            dropped_ms = dropped * self._period_ns * 1e-6
            logger.debug("the machine stalled: %d ticks (%.0f ms) dropped", dropped, dropped_ms)

    def _step(self, at_most: int = 1) -> int:
        """Make ticks of the robot, at most so many; return how many."""
        try:
            return self._robot.step(at_most)
        except Exception as fault:
            where = traceback.extract_tb(fault.__traceback__)[-1]
            place = f"{type(fault).__name__} in {where.filename}, line {where.lineno}"
            if self._faults.count(place, self._now_ns()) is not None:
                logger.exception("internal error in a tick")
            return 1

"""Errands: ticks that are made at once, as fast as the machine can, whatever the pace."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from math import ceil

from iiwa_sim.clock.stepped import Stepped

LONGEST_ADVANCE_S = 86400.0


class StillMoving(TimeoutError):
    """The robot has not stopped within the limit."""


@dataclass
class Errand:
    """Ticks that somebody waits for."""

    ticks: int
    until_stopped: bool
    done: asyncio.Future[bool]
    """Whether the robot has stopped."""
    made: int = 0

    def go_on(self, robot: Stepped, step: Callable[[], None], now_ns: Callable[[], int], end_ns: int) -> bool:
        """Make ticks of the robot by `step`, until that time; says whether the errand is over."""
        while not self.done.done():  # or whoever asked has been cancelled
            if not self.until_stopped and robot.resting:
                robot.skip(self.ticks - self.made)
                self.made = self.ticks
            if self.made >= self.ticks or (self.until_stopped and not robot.moving):
                self.done.set_result(not robot.moving)
                break
            step()
            self.made += 1
            if now_ns() >= end_ns:
                return False
        return True


def errand(seconds: float, rate_hz: int, *, until_stopped: bool) -> Errand:
    """An errand of as many ticks as `seconds` (0 to a day, simulated) need, the last one begun counted whole.

    Raises ValueError for a time out of range. To be called inside the loop.
    """
    if not 0.0 <= seconds <= LONGEST_ADVANCE_S:
        raise ValueError(f"{seconds:g} s of simulated time: expected 0 to {LONGEST_ADVANCE_S:g}")
    ticks = ceil(seconds * rate_hz - 1e-6)  # 0.07 * 100 is more than 7
    return Errand(ticks, until_stopped, asyncio.get_running_loop().create_future())

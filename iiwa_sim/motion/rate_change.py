"""A change of the override on the plan under way: as fast as that leaves room for, joint by joint.

From full rate to a pause, and back, that takes little more than the slowest joint under way needs to brake,
or to come to its speed: 0.3 s at most where all joints stop within 0.25 s, as those of an iiwa do.
"""

from math import ceil
from typing import NamedTuple, Protocol

import numpy as np

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.rate_kernel import SPREAD, STEP_S, LoadsAhead

CELL_S = 0.002
"""Length of a cell, about (s): over it the second derivative of the rate is constant."""
SAMPLES = 256
"""Number of samples of the plan, `STEP_S` apart; at least half of them lie ahead."""
LONGEST_STOP_S = 0.1
"""The longest that a stop may take (s), also from a rate that rises."""
LEAST_SLACK_S = 0.005
THERE = 2e-9
"""A rate that is so near to the requested one is equal to it."""
LEVEL = 1e-9
"""A slope of the rate (1/s) below this is 0."""


class PlanAhead(Protocol):
    """A planned motion over its own time."""

    @property
    def version(self) -> int:
        """A number that differs whenever what lies ahead was planned anew."""

    def along(self, times: Array) -> tuple[Array, Array]:
        """Joint positions and their three derivatives (m, 4, n) at rising times (s), and limits (m, 3, n).

        In rad, rad/s, rad/s^2, rad/s^3; the limits are those of velocity, acceleration and jerk there. Before
        the plan begins and behind its end it is at rest.
        """

    def jerks(self, times: Array) -> tuple[Array, Array]:
        """The least and the largest jerks (rad/s^3, m - 1, n) from each of rising times (m,) to the next."""


class Running(NamedTuple):
    """A plan that runs at the override, and where it is."""

    plan: PlanAhead
    time_s: float
    """Planned time now (s)."""
    stop_slope_per_s: float
    """Largest slope of the rate in a stop (1/s)."""
    stop_bend_per_s2: float
    """Largest second derivative of the rate in a stop (1/s^2)."""


class RateChange:
    """A rate of planned time on its way to another one; its integrals over ticks are exact."""

    def __init__(self, tick_s: float, rate: float, slope_per_s: float, goal: float) -> None:
        self.rate, self.slope_per_s = rate, slope_per_s
        self._goal = goal
        self._cells = max(ceil(tick_s / CELL_S - 0.5), 1)  # in a tick
        self._ticks = max(round(CELL_S / tick_s), 1)  # in a cell, where ticks are shorter
        self._step_s = tick_s / self._cells
        self._left = 0  # ticks of the cell under way
        self._bend = 0.0
        self._ahead: LoadsAhead | None = None
        self._version = 0
        self._renew_s = 0.0

    def redirect(self, goal: float) -> None:
        """Head for another rate from the end of the cell under way on: only there is a release known."""
        self._goal = goal

    @property
    def done(self) -> bool:
        """Whether the rate is the requested one, and stays so."""
        return self.rate == self._goal and self.slope_per_s == 0.0

    def step(self, running: Running) -> float:
        """Make one tick; gives the planned time (s) that passes in it."""
        time_s = running.time_s
        for _ in range(self._cells):
            if self.done:
                time_s += self._step_s * self.rate
                continue
            if self._left == 0:
                ahead = self._look(running, time_s)
                self._bend = ahead.bend(time_s, self.rate, self.slope_per_s, self._goal)
                self._left = self._ticks
            time_s += self._advance()
        return time_s - running.time_s

    def _advance(self) -> float:
        h, rate, slope, bend = self._step_s, self.rate, self.slope_per_s, self._bend
        self._left -= 1
        self.rate = rate + h * (slope + 0.5 * h * bend)
        self.slope_per_s = slope + h * bend
        if self._left == 0 and abs(self.slope_per_s) <= LEVEL:
            self.slope_per_s = 0.0
            if abs(self.rate - self._goal) <= THERE:
                self.rate = self._goal
        return h * (rate + h * (0.5 * slope + h * bend / 6.0))

    def _look(self, running: Running, time_s: float) -> LoadsAhead:
        if self._ahead is None or self._version != running.plan.version or time_s > self._renew_s:
            # Always at multiples of the step, so that a plan that did not change has the same samples.
            first = int(time_s / STEP_S) - SPREAD
            slope, bend = running.stop_slope_per_s, running.stop_bend_per_s2
            self._ahead = LoadsAhead(
                _loads(running.plan, STEP_S * np.arange(first, first + SAMPLES + 1, dtype=np.float64)),
                STEP_S * first,
                self._ticks * self._step_s,
                slope,
                bend,
                max(LONGEST_STOP_S - 1.0 / slope - slope / bend, LEAST_SLACK_S),
            )
            self._version, self._renew_s = running.plan.version, STEP_S * (first + SAMPLES // 2)
        return self._ahead


def _loads(plan: PlanAhead, times: Array) -> Array:
    """Velocity and acceleration over the limit of acceleration; both, and the least and the largest jerk till
    the next time, over that of jerk: at times (m + 1,), but for the last one (m, 6 n)."""
    derivatives, limits = plan.along(times[:-1])
    velocity, acceleration = derivatives[:, 1], derivatives[:, 2]
    of_acceleration, of_jerk = limits[:, 1], limits[:, 2]
    parts = [velocity / of_acceleration, acceleration / of_acceleration]
    parts += [each / of_jerk for each in (velocity, acceleration, *plan.jerks(times))]
    return np.ascontiguousarray(np.concatenate(parts, axis=1))

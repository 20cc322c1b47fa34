"""A timing without jerks: one of constant accelerations, seen through a moving average.

Let S(t) be a motion made of stretches of constant acceleration. Its mean over the last `window` seconds,

    s(t) = (I(t) - I(t - window)) / window,   I = integral of S,

is exact to evaluate, takes just `window` longer, and its derivatives are differences of those of S:
ds = (S(t) - S(t - window)) / window, and so on, so that |ddds| <= 2 max|ddS| / window.

At any time S can be continued in another way than was planned: what lies ahead of it is free.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from iiwa_sim.motion.limits import Array

SAME_S = 1e-9


class SmoothStates(NamedTuple):
    """What a smooth timing does at k times: arrays of shape (k,)."""

    s: Array
    ds: Array
    dds: Array
    ddds: Array
    window_start: Array
    """S at the beginning and"""
    window_end: Array
    """at the end of the window averaged over."""


class SmoothTiming:
    """The moving average of a motion given at knots."""

    def __init__(
        self, positions: Sequence[float], speeds: Sequence[float], window_s: float, start_s: float = 0.0
    ) -> None:
        """Knots of S; between two of them the acceleration is constant. The last is at rest.

        The first is at rest, too, or its time `start_s` lies a window before the times that are asked for.
        """
        s, ds = np.array(positions), np.array(speeds)
        times = np.zeros(len(s))
        # Rows: the integral of S - S[0], which stays small in long chains, then S - S[0], its speed and
        # acceleration; columns: knots.
        table = np.zeros((4, len(s)))
        steps = 2.0 * np.diff(s) / (ds[:-1] + ds[1:])
        steps.cumsum(out=times[1:])
        times += start_s
        np.subtract(s, s[0], out=table[1])
        table[2] = ds
        table[3, :-1] = np.diff(ds) / steps
        (steps * (table[1, :-1] + steps * (2.0 * ds[:-1] + ds[1:]) / 6.0)).cumsum(out=table[0, 1:])
        self.window_s = window_s
        self.start: float = positions[0]
        self.end: float = positions[-1]
        self.rest_s = float(times[-1]) + window_s
        self._knots = times, table
        self._speeds = speeds
        self._positions = positions
        # A tick asks for one time: plain floats serve that faster than arrays.
        self._times: list[float] = times.tolist()
        self._pieces: list[list[float]] = table.T.tolist()

    def position(self, time_s: float) -> float:
        """s at a time; exactly that of the last knot from `rest_s` on."""
        if time_s >= self.rest_s:
            return self.end
        return self.start + (self._area(time_s) - self._area(time_s - self.window_s)) / self.window_s

    def positions(self, times: Array) -> Array:
        """The same at rising times (m,), for less where there are many."""
        positions = (self._areas(times) - self._areas(times - self.window_s)) / self.window_s + self.start
        positions[times >= self.rest_s] = self.end
        return positions

    def time_at(self, s: float) -> float:
        """When a position is passed."""
        low, high = self._times[0], self.rest_s
        while high - low > SAME_S:
            middle = (low + high) / 2.0
            if self.position(middle) < s:
                low = middle
            else:
                high = middle
        return high

    def front(self, time_s: float) -> tuple[float, float]:
        """S and its speed at a time between the knots: what comes after it does not show in s yet."""
        k = max(bisect_right(self._times, time_s) - 1, 0)
        step = time_s - self._times[k]
        _, position, speed, acceleration = self._pieces[k]
        if time_s >= self._times[-1]:
            return self.end, 0.0
        return self.start + position + step * (speed + step * acceleration / 2.0), speed + step * acceleration

    def knots_between(self, earliest_s: float, latest_s: float) -> tuple[list[float], list[float], float]:
        """Positions and speeds of the knots from the last up to a time to the last before another, and the
        time of the first of them."""
        first = max(bisect_right(self._times, earliest_s) - 1, 0)
        last = bisect_left(self._times, latest_s)
        return list(self._positions[first:last]), list(self._speeds[first:last]), self._times[first]

    def next_knot(self, time_s: float) -> tuple[float, float, float] | None:
        """Time, position and speed of the first knot at or after a time."""
        k = bisect_right(self._times, time_s)
        if k >= len(self._times):
            return None
        return self._times[k], self._positions[k], self._speeds[k]

    def _areas(self, times: Array) -> Array:
        """The integral of S - S[0] from the first knot to each time."""
        knots, table = self._knots
        inside = times.clip(knots[0], knots[-1])
        k = knots.searchsorted(inside, side="right") - 1
        area, position, speed, acceleration = table.take(k, axis=1)
        step = inside - knots[k]
        areas: Array = area + step * (position + step * (speed / 2.0 + step * acceleration / 6.0))
        areas += (times - inside).clip(0.0) * table[1, -1]  # after the end S stays there
        return areas

    def _area(self, time_s: float) -> float:
        """The integral of S - S[0] from the first knot to a time."""
        if time_s <= self._times[0]:
            return 0.0
        k = bisect_right(self._times, time_s) - 1
        step = time_s - self._times[k]
        area, position, speed, acceleration = self._pieces[k]
        return area + step * (position + step * (speed / 2.0 + step * acceleration / 6.0))

    def states(self, passed: Array, from_s: float) -> SmoothStates:
        """The motion from a time on where dds may be largest, in between, and where it passes given rising s.

        dds is linear between the knots of S, and these a window later. ddds is constant between two of all
        these times; each carries the value that follows it.
        """
        knots, table = self._knots
        window_s = self.window_s
        # Half a window after its knot s passes about the place of that knot.
        times = np.concatenate([knots, knots + window_s / 2.0, knots + window_s, [from_s]])
        times.sort()
        times = times[times.searchsorted(from_s) :]
        both = np.concatenate([times, times - window_s])
        inside = both.clip(knots[0], knots[-1])
        k = knots.searchsorted(inside, side="right") - 1
        area, position, speed, acceleration = table.take(k, axis=1)
        step = inside - knots[k]
        raw = np.empty((3, 2, len(times)))
        flat = raw.reshape(3, -1)
        # After the end S stays there.
        flat[0] = area + step * (position + step * (speed / 2.0 + step * acceleration / 6.0))
        flat[0] += (both - inside).clip(0.0) * table[1, -1]
        flat[1] = position + step * (speed + step * acceleration / 2.0)
        flat[2] = speed + step * acceleration
        s, ds, dds = (raw[:, 0] - raw[:, 1]) / window_s
        ddds = np.zeros(len(times))
        apart = np.diff(times)
        np.divide(np.diff(dds), apart, out=ddds[:-1], where=apart > SAME_S)
        s += self.start
        states = SmoothStates(s, ds, dds, ddds, raw[1, 1] + self.start, raw[1, 0] + self.start)
        passed = passed[passed.searchsorted(s[0], side="right") : passed.searchsorted(s[-1])]
        if not len(passed):
            return states
        after = s.searchsorted(passed, side="right")
        part = (passed - s[after - 1]) / (s[after] - s[after - 1])
        inserted = [array[after - 1] + part * (array[after] - array[after - 1]) for array in states]
        inserted[3] = ddds[after - 1]
        return SmoothStates(
            *(np.insert(array, after, values) for array, values in zip(states, inserted, strict=True))
        )

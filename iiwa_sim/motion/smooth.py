"""A timing without jerks: one of constant accelerations, seen through a moving average.

Let S(t) be a motion made of stretches of constant acceleration. Its mean over the last `window` seconds,

    s(t) = (I(t) - I(t - window)) / window,   I = integral of S,

is exact to evaluate, takes just `window` longer, and its derivatives are differences of those of S:
ds = (S(t) - S(t - window)) / window, and so on, so that |ddds| <= 2 max|ddS| / window.
"""

from bisect import bisect_right
from typing import NamedTuple

import numpy as np

from iiwa_sim.motion.limits import Array


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

    def __init__(self, positions: Array, speeds: Array, window_s: float) -> None:
        """Knots of S, from rest at 0 to rest at 1; between two of them the acceleration is constant."""
        times = np.zeros(len(positions))
        table = np.zeros((4, len(positions)))
        areas, table[1], table[2], accelerations = table[0], positions, speeds, table[3]
        before, after = positions[:-1], positions[1:]
        slow, fast = speeds[:-1], speeds[1:]
        steps = 2.0 * (after - before) / (slow + fast)
        accelerations[:-1] = (fast - slow) / steps
        (steps * (before + steps * (2.0 * slow + fast) / 6.0)).cumsum(out=areas[1:])
        steps.cumsum(out=times[1:])
        self._knots = times, table
        self._window_s = window_s
        self.duration_s = float(times[-1]) + window_s
        # A tick asks for one time: plain floats serve that faster than arrays.
        self._times: list[float] = times.tolist()
        self._pieces: list[list[float]] = table.T.tolist()

    def slower(self, factor: float) -> "SmoothTiming":
        """The same motion taking `factor` times as long."""
        _, (_, positions, speeds, _) = self._knots
        return SmoothTiming(positions, speeds / factor, self._window_s * factor)

    def position(self, time_s: float) -> float:
        """See `Timing`."""
        if time_s >= self.duration_s:
            return 1.0
        return (self._area(time_s) - self._area(time_s - self._window_s)) / self._window_s

    def positions(self, times: Array) -> Array:
        """See `Timing`."""
        positions = (self._areas(times) - self._areas(times - self._window_s)) / self._window_s
        positions[times >= self.duration_s] = 1.0
        return positions

    def _areas(self, times: Array) -> Array:
        """The integral of S from 0 to each time."""
        knots, table = self._knots
        inside = times.clip(0.0, knots[-1])
        k = knots.searchsorted(inside, side="right") - 1
        area, position, speed, acceleration = table.take(k, axis=1)
        step = inside - knots[k]
        areas: Array = area + step * (position + step * (speed / 2.0 + step * acceleration / 6.0))
        areas += (times - inside).clip(0.0)  # after the end S stays 1
        return areas

    def _area(self, time_s: float) -> float:
        """The integral of S from 0 to a time."""
        if time_s <= 0.0:
            return 0.0
        k = bisect_right(self._times, time_s) - 1
        step = time_s - self._times[k]
        area, position, speed, acceleration = self._pieces[k]
        return area + step * (position + step * (speed / 2.0 + step * acceleration / 6.0))

    def extremes(self) -> SmoothStates:
        """The motion where dds is largest: at the knots of S and a window later, between which dds is linear.

        ddds is constant between two of these times; each carries the value that follows it.
        """
        knots, table = self._knots
        window_s = self._window_s
        times = np.concatenate([knots, knots + window_s])
        times.sort()
        both = np.concatenate([times, times - window_s])
        inside = both.clip(0.0, knots[-1])
        k = knots.searchsorted(inside, side="right") - 1
        _, position, speed, acceleration = table.take(k, axis=1)
        step = inside - knots[k]
        raw = np.empty((3, 2, len(times)))
        flat = raw.reshape(3, -1)
        flat[0] = self._areas(both)
        flat[1] = position + step * (speed + step * acceleration / 2.0)
        flat[2] = speed + step * acceleration
        s, ds, dds = (raw[:, 0] - raw[:, 1]) / window_s
        # At a knot itself rounding would decide which acceleration counts; half-way to the next it does not.
        middles = (times[1:] + times[:-1]) / 2.0
        ddds = np.zeros(len(times))
        ddds[:-1] = (self._accelerations(middles) - self._accelerations(middles - window_s)) / window_s
        return SmoothStates(s, ds, dds, ddds, raw[1, 1], raw[1, 0])

    def _accelerations(self, times: Array) -> Array:
        """Those of S, which is at rest before its first knot and after its last."""
        knots, table = self._knots
        accelerations: Array = np.append(table[3], 0.0).take(knots.searchsorted(times) - 1)
        return accelerations

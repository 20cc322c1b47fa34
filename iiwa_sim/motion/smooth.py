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

    def __init__(self, positions: list[float], speeds: list[float], window_s: float) -> None:
        """Knots of S, from rest at 0 to rest at 1; between two of them the acceleration is constant."""
        times, areas, accelerations = [0.0], [0.0], []
        time = area = 0.0
        for k in range(len(positions) - 1):
            speed, position = speeds[k], positions[k]
            step = 2.0 * (positions[k + 1] - position) / (speed + speeds[k + 1])
            acceleration = (speeds[k + 1] - speed) / step
            area += step * (position + step * (speed / 2.0 + step * acceleration / 6.0))
            time += step
            accelerations.append(acceleration)
            times.append(time)
            areas.append(area)
        accelerations.append(0.0)
        self._times, self._areas, self._accelerations = times, areas, accelerations
        self._positions, self._speeds = positions, speeds
        self._window_s = window_s
        self.duration_s = time + window_s

    def slower(self, factor: float) -> "SmoothTiming":
        """The same motion taking `factor` times as long."""
        return SmoothTiming(self._positions, [v / factor for v in self._speeds], self._window_s * factor)

    def position(self, time_s: float) -> float:
        """See `Timing`."""
        if time_s >= self.duration_s:
            return 1.0
        return (self._area(time_s) - self._area(time_s - self._window_s)) / self._window_s

    def _area(self, time_s: float) -> float:
        """The integral of S from 0 to a time."""
        if time_s <= 0.0:
            return 0.0
        k = bisect_right(self._times, time_s) - 1
        step = time_s - self._times[k]
        return self._areas[k] + step * (
            self._positions[k] + step * (self._speeds[k] / 2.0 + step * self._accelerations[k] / 6.0)
        )

    def extremes(self) -> SmoothStates:
        """The motion where dds is largest: at the knots of S and a window later, between which dds is linear.

        ddds is constant between two of these times; each carries the value that follows it.
        """
        knots = np.array(self._times)
        return self._states(np.sort(np.concatenate([knots, knots + self._window_s])))

    def _states(self, times: Array) -> SmoothStates:
        knots = np.array(self._times)
        table = np.array([self._areas, self._positions, self._speeds, self._accelerations])
        both = np.concatenate([times, times - self._window_s])
        inside = both.clip(0.0, knots[-1])
        k = knots.searchsorted(inside, side="right") - 1
        area, position, speed, acceleration = table[:, k]
        step = inside - knots[k]
        raw = np.empty((4, 2, len(times)))
        flat = raw.reshape(4, -1)
        flat[0] = area + step * (position + step * (speed / 2.0 + step * acceleration / 6.0))
        flat[0] += (both - inside).clip(0.0)  # after the end S stays 1
        flat[1] = position + step * (speed + step * acceleration / 2.0)
        flat[2] = speed + step * acceleration
        flat[3] = acceleration * (both == inside)
        s, ds, dds, ddds = (raw[:, 0] - raw[:, 1]) / self._window_s
        return SmoothStates(s, ds, dds, ddds, raw[1, 1], raw[1, 0])

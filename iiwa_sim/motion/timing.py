"""What a timing is: where on a path the robot is at a planned time; and the one of straight joint lines."""

from typing import Protocol

import numpy as np
from ruckig import InputParameter, Result, Ruckig, Trajectory

from iiwa_sim.motion.limits import Array


class Timing(Protocol):
    """s over planned time, from rest at s = 0 to rest at s = 1."""

    @property
    def duration_s(self) -> float:
        """Planned time from start to rest."""

    def position(self, time_s: float) -> float:
        """s at a planned time of at least 0; exactly 1 from `duration_s` on."""

    def positions(self, times: Array) -> Array:
        """The same at rising planned times (m,), for less where there are many."""


class OptimalTiming:
    """The fastest timing under constant limits of s: Ruckig's, for one degree of freedom.

    Along a straight joint line the joints' limits are constant limits of s, so this is what a
    phase-synchronised Ruckig of all joints finds.
    """

    def __init__(self, speed: float, acceleration: float, jerk: float) -> None:
        """Limits of ds/dt (1/s), its rate (1/s^2) and the rate of that (1/s^3), all above 0."""
        task = InputParameter(1)
        task.target_position = [1.0]
        task.max_velocity = [speed]
        task.max_acceleration = [acceleration]
        task.max_jerk = [jerk]
        self._trajectory = Trajectory(1)
        result = Ruckig(1).calculate(task, self._trajectory)
        if result != Result.Working:
            raise ArithmeticError(f"Ruckig: {result} for {speed=} {acceleration=} {jerk=}")
        self.duration_s: float = self._trajectory.duration

    def position(self, time_s: float) -> float:
        """See `Timing`."""
        if time_s >= self.duration_s:
            return 1.0
        s: float = self._trajectory.at_time(time_s)[0][0]
        return s

    def positions(self, times: Array) -> Array:
        """See `Timing`."""
        return np.array([self.position(time_s) for time_s in times.tolist()])


STANDSTILL_RAD = 2e-8
"""Joints that have less to go are there at once: within the limits even if each tick takes them back."""


class AtOnce:
    """The timing of a move that has hardly any way to go."""

    duration_s = 0.0

    def position(self, time_s: float) -> float:
        """See `Timing`."""
        return 1.0 if time_s >= self.duration_s else 0.0

    def positions(self, times: Array) -> Array:
        """See `Timing`."""
        return np.array([self.position(time_s) for time_s in times.tolist()])

"""Time scaling: an override and a stop slow planned time down, so the robot stays on its path.

A planned motion with velocity v, acceleration a and jerk j runs at the rate r of planned time. Then a joint
has the velocity r v, the acceleration r^2 a + r' v and the jerk r^3 j + 3 r r' a + r'' v. Therefore bounds
on r' and r'' are limits of the joints on any path: those of a stop.
"""

import numpy as np
from ruckig import ControlInterface, InputParameter, Result, Ruckig, Trajectory

from iiwa_sim.motion.limits import Array

RISING = 0.25
"""Part of the slope with which a rate rises: a stop that interrupts it takes hardly longer than any other."""


class TimeScaling:
    """Planned time of the running motion, which passes at the rate of the override until a stop."""

    def __init__(self, tick_s: float, largest_slope_per_s: float, largest_bend_per_s2: float) -> None:
        """The bounds are those of the first and the second derivative of the rate."""
        self.tick_s = tick_s
        self.override = 1.0
        """Requested rate, from 0, a pause, to 1."""
        self.time_s = 0.0
        """Planned time since the motion began."""
        self.rate = 1.0
        """Rate at the end of the last tick."""
        self.advance_s = tick_s
        """Planned time that passes in a tick at this rate."""
        self.stopping = False
        """True if the rate falls to 0 for a stop, or has done so."""
        self._slope_per_s = largest_slope_per_s
        self._task = InputParameter(1)
        self._task.control_interface = ControlInterface.Velocity
        self._task.max_jerk = [largest_bend_per_s2]
        self._task.target_acceleration = [0.0]
        self._ruckig = Ruckig(1)
        self._change: Trajectory | None = None  # of planned time since the rate began to change
        self._changed_s = 0.0  # time since then
        self._since_s = 0.0  # planned time at which it did

    @property
    def changing(self) -> bool:
        """True if the rate is changing."""
        return self._change is not None

    @property
    def falling(self) -> bool:
        """True if the rate is above the override, and comes down to it."""
        return self._change is not None and not self.stopping and self.override < self.rate

    @property
    def pausing(self) -> bool:
        """True if planned time stands still because of an override of 0."""
        return self.rate == self.override == 0.0 and self._change is None

    def begin(self, time_s: float = 0.0) -> None:
        """Run from this planned time for a motion from rest, which has the rate of the override at once."""
        self.end()
        self.time_s = time_s

    def restart(self) -> None:
        """Run from 0 for a motion that takes over in mid-motion."""
        self._since_s -= self.time_s
        self.time_s = 0.0

    def end(self) -> None:
        """Take the rate of the override at once, as nothing moves."""
        self.stopping, self._change = False, None
        self._set_rate(self.override)

    def set_override(self, value: float) -> None:
        """Change the rate to `value` (0..1) while a motion runs; during a stop, for the next motion."""
        if value != self.override:
            self.override = value
            if not self.stopping:
                self._change_to(value)

    def stop(self) -> None:
        """Reduce the rate to 0 as fast as its bounds allow."""
        if not self.stopping:
            self.stopping = True
            self._change_to(0.0)

    def rest_s(self) -> float:
        """Return the planned time at which the rate reaches 0, or would after a stop now."""
        if not self.stopping:
            change = self._change_of_rate(0.0)
            return self.time_s + float(change.at_time(change.duration)[0][0])
        return self.time_s if self._change is None else self._at(self._change.duration)

    def step(self) -> None:
        """Make one tick."""
        change = self._change
        if change is None:
            self.time_s += self.advance_s
            return
        self._changed_s += self.tick_s
        if self._changed_s < change.duration:
            (passed,), (self.rate,), _ = change.at_time(self._changed_s)
            self.time_s = self._since_s + passed
            return
        left_s = self._changed_s - change.duration
        self._set_rate(0.0 if self.stopping else self.override)
        self.time_s = self._at(change.duration) + left_s * self.rate
        self._change = None

    @property
    def coming_s(self) -> float:
        """Planned time after the next tick, without a new request until then."""
        if self._change is None:
            return self.time_s + self.advance_s
        after_s, duration = self._changed_s + self.tick_s, self._change.duration
        return self._at(min(after_s, duration) if self.stopping else after_s)

    def ticks(self, count: int) -> Array:
        """Return the planned times of this tick and the following ones while the rate is constant."""
        return self.time_s + self.advance_s * np.arange(count, dtype=np.float64)

    def ticks_until(self, time_s: float) -> int:
        """Return the number of ticks before a planned time while the rate is constant."""
        return max(int((time_s - self.time_s) / self.advance_s), 0) if self.advance_s > 0.0 else 0

    def _set_rate(self, rate: float) -> None:
        self.rate, self.advance_s = rate, self.tick_s * rate

    def _at(self, changed_s: float) -> float:
        """Return the planned time so long after the rate began to change."""
        assert self._change is not None
        return self._since_s + float(self._change.at_time(changed_s)[0][0])

    def _change_to(self, rate: float) -> None:
        self._change = self._change_of_rate(rate)
        self._since_s, self._changed_s = self.time_s, 0.0

    def _change_of_rate(self, rate: float) -> Trajectory:
        """Return planned time from now on, until it has another rate."""
        slope = 0.0
        if self._change is not None:
            slope = self._change.at_time(min(self._changed_s, self._change.duration))[2][0]
        task = self._task
        task.max_acceleration = [self._slope_per_s if rate <= self.rate else RISING * self._slope_per_s]
        task.current_position, task.current_velocity = [0.0], [self.rate]
        task.current_acceleration = [slope]
        task.target_velocity = [rate]
        change = Trajectory(1)
        result = self._ruckig.calculate(task, change)
        if result != Result.Working:
            raise ArithmeticError(f"Ruckig: {result} for a change of the rate from {self.rate} to {rate}")
        return change

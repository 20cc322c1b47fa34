"""The rate of planned time: the override, or 0 after a stop, with bounded derivatives in between.

On a planned motion q(t) with velocity v, acceleration a and jerk j, at the rate r of planned time, joints
have the velocity r v, the acceleration r^2 a + r' v and the jerk r^3 j + 3 r r' a + r'' v. So bounds on r'
and r'' are stop limits of the joints that hold on any path, and the path is never left.
"""

import numpy as np
from ruckig import ControlInterface, InputParameter, Result, Ruckig, Trajectory

from iiwa_sim.motion.even_kernel import EvenTime
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.override import Override
from iiwa_sim.motion.rate_change import PlanAhead, Running


class PlannedTime(EvenTime):
    """Planned time of one motion, tick by tick. The owner of the override steps it before this."""

    def __init__(self, override: Override, largest_slope_per_s: float, largest_bend_per_s2: float) -> None:
        super().__init__(override)
        self.tick_s = override.tick_s
        self.override = override
        """What the rate follows but for a stop; shared with other motions."""
        self._stop_limits = largest_slope_per_s, largest_bend_per_s2
        self._task = InputParameter(1)
        self._task.control_interface = ControlInterface.Velocity
        self._task.max_acceleration = [largest_slope_per_s]
        self._task.max_jerk = [largest_bend_per_s2]
        self._ruckig = Ruckig(1)
        self.start(0.0)

    def start(self, time_s: float) -> None:
        """Run from this planned time."""
        self.time_s = time_s
        self._slowing = None
        self._slowing_s = 0.0

    def begin(self, since_s: float = 0.0) -> None:
        """Run from 0 for a motion from rest, which has the rate of the override at once.

        At the rate before, the motion would have reached `since_s` in this tick.
        """
        before = self.override.rate
        if not self.override.level:
            self.override.settle()
        self.start(since_s * self.override.rate / before if since_s else 0.0)

    def running(self, plan: PlanAhead) -> Running:
        """The running motion for the override: a plan at this planned time."""
        return Running(plan, self.time_s, *self._stop_limits)

    @property
    def standing(self) -> bool:
        """Whether no planned time has passed in the last tick, because of a pause."""
        return self._slowing is None and self.override.advance_s == 0.0

    @property
    def stopped(self) -> bool:
        """Whether the rate has reached 0."""
        return self._slowing is not None and self._slowing_s >= self._slowing.duration

    def stop(self) -> None:
        """Reduce the rate to 0 as fast as its bounds allow."""
        if self._slowing is None:
            self._slowing, self._slowing_s = self._stopping_now(), 0.0

    def rest_s(self) -> float:
        """Planned time at which the rate reaches 0, or would after a stop now."""
        slowing = self._slowing or self._stopping_now()
        rest: float = slowing.at_time(slowing.duration)[0][0]
        return rest

    def _stopping_now(self) -> Trajectory:
        self._task.current_position = [self.time_s]
        self._task.current_velocity = [self.override.rate]
        self._task.current_acceleration = [self.override.slope_per_s]
        self._task.target_velocity = [0.0]
        self._task.target_acceleration = [0.0]
        slowing = Trajectory(1)
        result = self._ruckig.calculate(self._task, slowing)
        if result != Result.Working:
            raise ArithmeticError(f"Ruckig: {result} for a stop at {self.time_s} s")
        return slowing

    def ticks(self, count: int) -> Array:
        """Planned times of this tick and the following ones while the rate is constant."""
        tick_s = self.tick_s * self.override.rate
        return self.time_s + tick_s * np.arange(count, dtype=np.float64)

    def ticks_until(self, time_s: float) -> int:
        """Number of ticks before a planned time while the rate is constant."""
        tick_s = self.override.advance_s
        return max(int((time_s - self.time_s) / tick_s), 0) if tick_s > 0.0 else 0

    @property
    def coming_s(self) -> float:
        """Planned time after the next tick, if nothing is asked for until then."""
        if self._slowing is not None:
            later_s = min(self._slowing_s + self.tick_s, self._slowing.duration)
            return float(self._slowing.at_time(later_s)[0][0])
        override = self.override
        advance_s = override.tick_s * override.rate if override.even else override.advance_s
        return self.time_s + advance_s + override.slope_per_s * self.tick_s * self.tick_s

    def step(self) -> None:
        """Make one tick."""
        if self._slowing is None:
            self.time_s += self.override.advance_s
        else:
            self._slowing_s += self.tick_s
            self.time_s = self._slowing.at_time(min(self._slowing_s, self._slowing.duration))[0][0]

"""The override: the rate at which planned time runs, from 0, a pause, to 1, as planned.

Where the plan under way can be looked at, it changes as fast as that allows (`rate_change.py`). Else it
changes in a way that keeps the limits of every planned motion, wherever on its path the robot is. At the
rate r a joint with the planned velocity v, acceleration a and jerk j sees r v, r^2 a + r' v and
r^3 j + 3 r r' a + r'' v. A motion may use all of its limits V, A = f V and J = g A at r = 1, so there r must
not change at all; the lower r is, the faster it may. That is the shape of r = tanh u: with |u'| <= c and
|u''| <= f g / 2 the accelerations are at most A (r^2 + (1 - r^2) c / f), and the jerks at most
J (r^3 + K r (1 - r^2) + (1 - r^2) / 2) with K = 3 c / g + 2 c^2 / (f g). For r from 0 to 1 neither is more
than the limit if c <= f and K <= 1. As tanh never comes to 1, r is a little more than tanh u: 1 is then
reached, and what a planned motion has to leave free for that is MARGIN of the acceleration, and 1.5 times as
much of the jerk; planners keep 0.99 of the limits.
"""

from math import atanh, sqrt, tanh
from typing import Protocol

from ruckig import InputParameter, Result, Ruckig, RuckigError, Trajectory

from iiwa_sim.motion.courses import JERK_SHARES, SPEED_KEPT
from iiwa_sim.motion.even_kernel import Pace
from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.rate_change import RateChange, Running

MARGIN = 0.005
STRETCH = sqrt(1.0 + MARGIN)


class Runs(Protocol):
    """A motion that may run at the rate."""

    @property
    def running(self) -> Running | None:
        """The running motion; None if there is none, or if it cannot be looked at."""


class Override(Pace):
    """The rate of planned time over ticks; 1 at first."""

    def __init__(self, tick_s: float, limits: JointLimits) -> None:
        """Motions are planned within these limits, or within limits with a larger ratio of acceleration to
        velocity and of jerk to acceleration, as in direct mode."""
        self.tick_s = tick_s
        self.value = 1.0
        """The requested value, which the rate has or approaches."""
        self.rate, self.slope_per_s, self.advance_s = 1.0, 0.0, tick_s
        self.even = self.level = True
        f = float((limits.acceleration / limits.velocity).min())
        g = float((limits.jerk / limits.acceleration).min())
        fastest = f * g / 4.0 * (sqrt(9.0 / g**2 + 8.0 / (f * g)) - 3.0 / g)  # here K is 1
        self._ruckig = Ruckig(1)
        self._task = InputParameter(1)
        self._task.max_velocity = [min(f, fastest)]
        self._task.max_acceleration = [f * g / 2.0]
        self._task.max_jerk = [f * g / 2.0 * g]
        self._begins = False  # another value has been requested since the last tick
        self._on_plan: RateChange | None = None
        self._change: Trajectory | None = None
        self._changed_s = 0.0  # time since the change has begun

    @property
    def changing(self) -> bool:
        """Whether the rate is changing to the requested value."""
        return self._begins or self._on_plan is not None or self._change is not None

    @property
    def settled(self) -> bool:
        """Whether a tick without motion at this rate would change nothing."""
        return self.even and not self.changing and self.advance_s == self.tick_s * self.rate

    @property
    def pausing(self) -> bool:
        """Whether planned time stands still."""
        return self.rate == 0.0 and not self.changing

    def be(self, value: float) -> None:
        """Set the rate (0..1) at once; only at rest."""
        self.value = self.rate = value
        self.slope_per_s, self.even = 0.0, True
        self._begins, self._on_plan, self._change = False, None, None
        self.level = False

    @property
    def part_to_keep(self) -> float:
        """While the rate decreases: requested value divided by the present rate; otherwise 1."""
        if not self.changing or self.value >= self.rate:
            return 1.0
        return self.value / self.rate

    def settle(self) -> None:
        """Set the rate to the requested value, also for this tick; only where nothing moves at the rate."""
        self.be(self.value)
        self.advance_s = self.tick_s * self.rate

    def go_to(self, value: float) -> None:
        """Change the rate to `value` (0..1), as fast as the limits allow."""
        if value != self.value:
            self.value, self.even, self._begins, self.level = value, False, True, False

    def step(self, motion: "Runs | None" = None) -> None:
        """Make one tick; `motion` gives what runs at this rate, or is None."""
        if self.level:
            return
        running = motion.running if motion is not None else None
        if self._begins:
            self._begin(running)
        elif self._on_plan is not None and running is None:
            self.be(self.value)  # what ran has ended or is being stopped: nothing moves at this rate any more
        self.even = not self.changing
        if self._on_plan is not None and running is not None:
            self._step_on_plan(self._on_plan, running)
        elif self._change is not None:
            self._step_anywhere(self._change)
        else:
            self.advance_s = self.tick_s * self.rate
            self.level = self.even

    def _begin(self, running: Running | None) -> None:
        self._begins = False
        if running is not None and self._on_plan is not None:
            self._on_plan.redirect(self.value)
        elif running is not None:
            self._change = None
            self._on_plan = RateChange(self.tick_s, self.rate, self.slope_per_s, self.value)
        elif self._on_plan is not None:
            self.be(self.value)
        else:
            self._change = self._way()
            self._changed_s = 0.0

    def _step_on_plan(self, change: RateChange, running: Running) -> None:
        self.advance_s = change.step(running)
        self.rate, self.slope_per_s = change.rate, change.slope_per_s
        if change.done:
            self._on_plan = None

    def _step_anywhere(self, change: Trajectory) -> None:
        before, middle = self.rate, self._at(self._changed_s + 0.5 * self.tick_s)[0]
        self._changed_s += self.tick_s
        self.rate, self.slope_per_s = self._at(self._changed_s)
        self.advance_s = self.tick_s * (before + 4.0 * middle + self.rate) / 6.0  # Simpson's rule
        if self._changed_s >= change.duration:
            self._change = None

    def _at(self, time_s: float) -> tuple[float, float]:
        """Rate and slope at a time after the beginning of the change."""
        assert self._change is not None
        if time_s >= self._change.duration:
            return self.value, 0.0
        (u,), (speed,), _ = self._change.at_time(time_s)
        part = tanh(u)
        return min(max(STRETCH * part, 0.0), 1.0), STRETCH * (1.0 - part * part) * speed

    def _way(self) -> Trajectory:
        """The way from where the rate is now, which is even but for a way before this one."""
        task = self._task
        u, speed, acceleration = _place(self.rate), 0.0, 0.0
        if self._change is not None:
            u, speed, acceleration = (each[0] for each in self._change.at_time(self._changed_s))
        task.current_position, task.target_position = [u], [_place(self.value)]
        task.current_velocity, task.current_acceleration = [SPEED_KEPT * speed], [acceleration]
        jerk = self._task.max_jerk
        try:
            for share in JERK_SHARES:
                self._task.max_jerk = [share * jerk[0]]
                way = Trajectory(1)
                try:
                    if self._ruckig.calculate(self._task, way) == Result.Working:
                        return way
                except RuckigError:
                    continue
        finally:
            self._task.max_jerk = jerk
        raise ArithmeticError(f"Ruckig: no way to the override of {self._task.target_position}")


def _place(rate: float) -> float:
    """The u for which tanh u is the rate."""
    return atanh(rate / STRETCH)

"""A change of the rate of a plan: within all limits, to what was asked for, and never hard to stop."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
import ruckig
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.motion.rate_change import RateChange, Running
from iiwa_sim.robot.description import load_robot
from tests.stepped import ARMS, Array

DESCRIPTIONS = {name: load_robot(name) for name in ARMS}
STOP = (15.0, 600.0)  # as robot.toml has it, 1/s and 1/s^2
LONGEST_STOP_S = 0.1
JERK_S = 1e-6  # between accelerations whose difference is the jerk
JERKS = 4  # that are looked at between two times
values = st.one_of(st.floats(0.0, 1.0), st.sampled_from([0.0, 0.0, 1.0, 1.0, 0.5, 1e-6]))
changes = st.lists(st.tuples(values, st.floats(0.0, 0.4)), min_size=1, max_size=8)
ticks_s = st.sampled_from([0.0005, 0.001, 0.002, 0.004, 0.01])


class Plan:
    """Ways from rest to rest with all joints at once, one after the other, as fast as all limits allow."""

    def __init__(self, name: str, seed: int) -> None:
        d = DESCRIPTIONS[name]
        self.limits = np.array([d.velocity, d.acceleration, d.jerk])
        self.version = 0
        rng = np.random.default_rng(seed)
        place = np.zeros(len(d.joints))
        self._ways: list[ruckig.Trajectory] = []
        self._starts = [0.0]
        while self._starts[-1] < 4.0:
            end = place + rng.uniform(-1.0, 1.0, len(place)) * 10.0 ** rng.uniform(-2.0, 0.3)
            self._ways.append(self._way(place, end))
            self._starts.append(self._starts[-1] + self._ways[-1].duration)
            place = end

    def _way(self, start: Array, end: Array) -> ruckig.Trajectory:
        task = ruckig.InputParameter(len(start))
        task.synchronization = ruckig.Synchronization.Phase
        task.current_position, task.target_position = start.tolist(), end.tolist()
        task.max_velocity, task.max_acceleration, task.max_jerk = self.limits.tolist()
        way = ruckig.Trajectory(len(start))
        assert ruckig.Ruckig(len(start)).calculate(task, way) == ruckig.Result.Working
        return way

    def at(self, time_s: float) -> Sequence[Sequence[float]]:
        """Positions, velocities and accelerations."""
        k = int(np.searchsorted(self._starts, time_s, side="right")) - 1
        k = min(max(k, 0), len(self._ways) - 1)
        found: Sequence[Sequence[float]] = self._ways[k].at_time(max(time_s - self._starts[k], 0.0))
        return found

    def along(self, times: Array) -> tuple[Array, Array]:
        rows = []
        for time_s in times.tolist():
            before, here, after = (np.array(self.at(time_s + shift)) for shift in (-JERK_S, 0.0, JERK_S))
            rows.append([*here, (after[2] - before[2]) / (2.0 * JERK_S)])
        return np.array(rows), np.broadcast_to(self.limits, (len(times), *self.limits.shape))

    def jerks(self, times: Array) -> tuple[Array, Array]:
        among = np.linspace(times[:-1], times[1:], JERKS).T
        found = np.array([self.along(each)[0][:, 3] for each in among])
        return found.min(axis=1), found.max(axis=1)


class Ridden:
    """A plan run at rates that change."""

    def __init__(self, plan: Plan, tick_s: float, told: Sequence[tuple[float, float]] = ()) -> None:
        """It has run at each of these rates for so long (s)."""
        self.plan, self.tick_s = plan, tick_s
        self.time_s, self.rate = 3.0 * tick_s, 1.0
        self.rates, self.slopes = [1.0], [0.0]
        self.joints = [plan.at(k * tick_s)[0] for k in range(4)]
        self._change = RateChange(tick_s, 1.0, 0.0, 1.0)
        for value, wait_s in told:
            self.goes_to(value)
            self.runs(wait_s)

    def goes_to(self, value: float) -> None:
        self._change.redirect(value)

    def runs(self, time_s: float) -> None:
        for _ in range(round(time_s / self.tick_s)):
            self.time_s += self._change.step(Running(self.plan, self.time_s, *STOP))
            self.rates.append(self._change.rate)
            self.slopes.append(self._change.slope_per_s)
            self.joints.append(self.plan.at(self.time_s)[0])

    def loads(self) -> tuple[float, float]:
        """The largest acceleration and jerk of any joint, by differences, as parts of the limits."""
        q, (_, acceleration, jerk) = np.array(self.joints), self.plan.limits
        second, third = (np.abs(np.diff(q, n=n, axis=0)) / self.tick_s**n for n in (2, 3))
        return float((second / acceleration).max()), float((third / jerk).max())


@pytest.mark.requirement("FRC025")
@given(st.sampled_from(ARMS), st.integers(0, 2**32 - 1), ticks_s, changes)
def test_limits_are_kept_a_stop_is_never_long_and_the_rate_comes_to_what_was_asked_for_last(
    name: str, seed: int, tick_s: float, told: list[tuple[float, float]]
) -> None:
    ridden = Ridden(Plan(name, seed), tick_s, told)
    acceleration, jerk = ridden.loads()
    assert acceleration <= 1.01
    assert jerk <= 1.01
    rates, slopes = np.array(ridden.rates), np.array(ridden.slopes)
    assert rates.min() >= -1e-6
    assert rates.max() <= 1.0 + 1e-6
    for rate, slope in zip(rates[::10].tolist(), slopes[::10].tolist(), strict=True):
        assert stop_s(rate, slope) <= LONGEST_STOP_S
    ridden.runs(1.0)  # some joint of a KR 6 may have to brake for 0.8 s first
    assert (ridden.rates[-1], ridden.slopes[-1]) == (told[-1][0], 0.0)


def stop_s(rate: float, slope_per_s: float) -> float:
    """How long planned time takes to come to a stop, as `PlannedTime` plans it."""
    task = ruckig.InputParameter(1)
    task.control_interface = ruckig.ControlInterface.Velocity
    task.current_velocity, task.current_acceleration = [rate], [slope_per_s]
    task.target_velocity = [0.0]
    task.max_acceleration, task.max_jerk = [STOP[0]], [STOP[1]]
    way = ruckig.Trajectory(1)
    assert ruckig.Ruckig(1).calculate(task, way) == ruckig.Result.Working
    duration: float = way.duration
    return duration

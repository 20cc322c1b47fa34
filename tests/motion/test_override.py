"""The override's rate: every change of it keeps the limits of any planned motion."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.override import MARGIN, Override

QUICK_S = 0.9  # a change between any two overrides of an iiwa takes less
values = st.one_of(st.floats(0.0, 1.0), st.sampled_from([0.0, 1.0, 1.0, 1e-9, 1.0 - 1e-9, 0.5]))
changes = st.lists(st.tuples(values, st.integers(0, 600)), min_size=1, max_size=12)


def joint(f: float, g: float, velocity: float = 1.7) -> JointLimits:
    """Limits (1,): f is acceleration over velocity, g jerk over acceleration."""
    v = np.array([velocity])
    return JointLimits(v, f * v, g * f * v)


def runs(override: Override, told: list[tuple[float, int]]) -> tuple[list[float], list[float]]:
    """Rates and advances, tick by tick."""
    rates, advances = [override.rate], []
    for value, ticks in told:
        override.go_to(value)
        for _ in range(ticks):
            override.step()
            rates.append(override.rate)
            advances.append(override.advance_s)
    return rates, advances


@pytest.mark.requirement("FRC025")
@example([(0.0, 500), (1.0, 500)], (5.0, 25.0))
@example([(0.0, 250), (1.0, 500)], (10.0, 50.0))
@given(changes, st.tuples(st.floats(1.0, 30.0), st.floats(2.0, 200.0)))
def test_at_every_tick_a_motion_that_uses_all_of_its_limits_keeps_them(
    told: list[tuple[float, int]], kind: tuple[float, float]
) -> None:
    f, g = kind
    tick_s = 0.001
    rates = np.array(runs(Override(tick_s, joint(f, g)), told)[0])
    assert rates.min() >= 0.0
    assert rates.max() <= 1.0
    slope = np.abs(np.diff(rates)) / tick_s
    bend = np.abs(np.diff(rates, n=2)) / tick_s**2
    middle = 0.5 * (rates[1:] + rates[:-1])
    # As parts of the limits, where v, a and j are the largest possible, and signs the worst.
    assert (middle**2 + slope / f <= 1.0 + MARGIN + 1e-3).all()
    r, s = rates[1:-1], 0.5 * (slope[1:] + slope[:-1])
    assert (r**3 + 3.0 * r * s / g + bend / (f * g) <= 1.0 + 1.5 * MARGIN + 2e-3).all()


@pytest.mark.requirement("FRC025")
@given(changes)
def test_it_comes_to_what_was_asked_for_last_exactly_and_soon(told: list[tuple[float, int]]) -> None:
    override = Override(0.002, joint(5.0, 25.0))
    runs(override, told)
    ticks = 0
    while not override.even:
        override.step()
        ticks += 1
    assert ticks * 0.002 < QUICK_S
    assert override.rate == override.value == told[-1][0]
    assert override.slope_per_s == 0.0
    override.step()
    assert override.advance_s == 0.002 * told[-1][0]
    assert override.pausing == (told[-1][0] == 0.0)


def test_a_tick_in_which_a_change_ends_is_not_even() -> None:
    """Positions found ahead for the old rate would else be taken for the new one."""
    override = Override(0.01, joint(5.0, 25.0))
    override.go_to(1.0 - 1e-9)
    override.step()
    assert override.rate == 1.0 - 1e-9
    assert not override.even
    override.step()
    assert override.even


def test_what_is_already_so_is_no_change_and_at_rest_it_is_there_at_once() -> None:
    override = Override(0.002, joint(5.0, 25.0))
    override.go_to(1.0)
    assert override.even
    override.go_to(0.5)
    assert not override.even
    override.be(0.25)
    assert override.even
    assert (override.rate, override.value, override.slope_per_s) == (0.25, 0.25, 0.0)

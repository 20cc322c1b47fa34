"""Time scaling: the rate of planned time, its bounds, and how long a stop takes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.motion.time_scaling import TimeScaling

SLOPE_PER_S, BEND_PER_S2 = 15.0, 600.0  # of the built-in robots
RISING_S, FALLING_S = 0.3, 0.1
values = st.one_of(st.floats(0.0, 1.0), st.sampled_from([0.0, 1.0, 0.5, 1e-6]))
changes = st.lists(st.tuples(values, st.integers(0, 300)), min_size=1, max_size=8)


def scaled(told: list[tuple[float, int]], tick_s: float) -> tuple[TimeScaling, list[float], list[float]]:
    """Time that ran at each override for so many ticks, with its values and rates."""
    time = TimeScaling(tick_s, SLOPE_PER_S, BEND_PER_S2)
    time.begin()
    times, rates = [0.0], [1.0]
    for value, ticks in told:
        time.set_override(value)
        for _ in range(ticks):
            time.step()
            times.append(time.time_s)
            rates.append(time.rate)
    return time, times, rates


@pytest.mark.requirement("FRC025")
@given(changes, st.sampled_from([0.001, 0.004]))
def test_the_rate_keeps_its_bounds_and_comes_to_the_override(
    told: list[tuple[float, int]], tick_s: float
) -> None:
    time, times, rates = scaled([*told, (told[-1][0], round(RISING_S / tick_s))], tick_s)
    assert time.rate == told[-1][0]
    assert not time.changing
    assert min(rates) >= -1e-12
    assert max(rates) <= 1.0 + 1e-12
    slopes = np.diff(rates) / tick_s
    assert np.abs(slopes).max(initial=0.0) <= SLOPE_PER_S * (1 + 1e-9)
    assert np.abs(np.diff(slopes)).max(initial=0.0) <= BEND_PER_S2 * tick_s * (1 + 1e-9)
    for (before, after), passed in zip(pairwise(rates), np.diff(times), strict=True):
        assert passed == pytest.approx(tick_s * 0.5 * (before + after), abs=BEND_PER_S2 * tick_s**3)


@pytest.mark.requirement("FRC003", "FRC025")
@given(changes, st.sampled_from([0.001, 0.004]))
def test_a_stop_at_any_time_ends_within_100_ms_where_it_was_foreseen(
    told: list[tuple[float, int]], tick_s: float
) -> None:
    assert_stops(scaled(told, tick_s)[0])


@pytest.mark.requirement("FRC003", "FRC025")
def test_a_stop_while_the_rate_rises_ends_within_100_ms() -> None:
    for ticks in range(300):
        assert_stops(scaled([(0.0, 100), (1.0, ticks)], 0.001)[0])


def assert_stops(time: TimeScaling) -> None:
    """Within 100 ms, where it was foreseen."""
    foreseen = time.rest_s()
    time.stop()
    ticks = 0
    while not time.stopped:
        time.step()
        ticks += 1
    assert ticks * time.tick_s <= FALLING_S + 1e-9
    assert time.time_s == time.rest_s() == foreseen


def test_an_override_changes_as_fast_as_it_may() -> None:
    time, _, rates = scaled([(0.0, 100)], 0.001)
    assert rates.index(0.0) == 92
    assert np.diff(rates).min() == pytest.approx(-0.001 * SLOPE_PER_S)
    time.stop()
    time.set_override(0.5)
    assert time.rate == 0.0, "a stop comes first"
    time.begin()
    assert time.rate == 0.5

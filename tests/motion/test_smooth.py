"""The moving average: exact, at rest at both ends, and nowhere worse than where it is looked at."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.motion.smooth import SmoothTiming

WINDOW_S = 0.05


def random_timing(seed: int, knots: int) -> SmoothTiming:
    rng = np.random.default_rng(seed)
    steps = rng.uniform(0.2, 1.0, knots - 1)
    positions = np.concatenate([[0.0], np.cumsum(steps) / steps.sum()])
    positions[-1] = 1.0
    speeds = rng.uniform(0.5, 2.0, knots)
    speeds[0] = speeds[-1] = 0.0
    return SmoothTiming(positions, speeds, WINDOW_S)


timings = st.builds(random_timing, st.integers(0, 2**32 - 1), st.integers(3, 40))


@settings(max_examples=60, deadline=None)
@given(timing=timings)
def test_no_time_has_a_larger_acceleration_or_jerk_than_the_extremes(timing: SmoothTiming) -> None:
    extremes = timing.extremes()
    h = 1e-4
    s = np.array([timing.position(t) for t in np.arange(0.0, timing.duration_s + 5 * h, h).tolist()])
    s = np.concatenate([[0.0] * 3, s])
    for order, found in ((2, extremes.dds), (3, extremes.ddds)):
        largest = np.abs(np.diff(s, n=order)).max() / h**order
        assert largest <= np.abs(found).max() * 1.001 + 1e-13 / h**order


@settings(max_examples=60, deadline=None)
@given(timing=timings)
def test_it_goes_from_rest_to_rest_and_may_go_slower(timing: SmoothTiming) -> None:
    assert timing.position(0.0) == 0.0
    assert timing.position(timing.duration_s) == 1.0
    assert abs(timing.position(timing.duration_s - 1e-9) - 1.0) < 1e-12
    slower = timing.slower(1.7)
    assert np.isclose(slower.duration_s, 1.7 * timing.duration_s, rtol=1e-12)
    for part in (0.1, 0.35, 0.8):
        there = slower.position(part * slower.duration_s)
        assert np.isclose(there, timing.position(part * timing.duration_s), atol=1e-12)

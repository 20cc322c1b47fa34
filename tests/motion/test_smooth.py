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
    return SmoothTiming(positions.tolist(), speeds.tolist(), WINDOW_S)


timings = st.builds(random_timing, st.integers(0, 2**32 - 1), st.integers(3, 40))


@settings(max_examples=60, deadline=None)
@given(timing=timings)
def test_no_time_has_a_larger_acceleration_or_jerk_than_where_it_is_looked_at(timing: SmoothTiming) -> None:
    extremes = timing.states(np.linspace(0.0, 1.0, 7), 0.0)
    h = 1e-4
    s = np.array([timing.position(t) for t in np.arange(0.0, timing.rest_s + 5 * h, h).tolist()])
    s = np.concatenate([[0.0] * 3, s])
    for order, found in ((2, extremes.dds), (3, extremes.ddds)):
        largest = np.abs(np.diff(s, n=order)).max() / h**order
        assert largest <= np.abs(found).max() * 1.001 + 1e-13 / h**order


@settings(max_examples=60, deadline=None)
@given(timing=timings)
def test_it_goes_from_rest_to_rest(timing: SmoothTiming) -> None:
    assert timing.position(0.0) == 0.0
    assert timing.position(timing.rest_s) == 1.0
    assert abs(timing.position(timing.rest_s - 1e-9) - 1.0) < 1e-12


@settings(max_examples=60, deadline=None)
@given(timing=timings, part=st.floats(0.05, 0.9))
def test_going_on_from_the_front_as_before_changes_nothing(timing: SmoothTiming, part: float) -> None:
    now = part * (timing.rest_s - WINDOW_S)
    s, speed = timing.front(now)
    before, speeds, start_s = timing.knots_between(now - WINDOW_S, now - 1e-9)
    after, later_speeds, _ = timing.knots_between(now + 1e-9, timing.rest_s)
    ahead = [k for k, position in enumerate(after) if position > s + 1e-9]
    again = SmoothTiming(
        [*before, s, *(after[k] for k in ahead)],
        [*speeds, speed, *(later_speeds[k] for k in ahead)],
        WINDOW_S,
        start_s,
    )
    times = np.linspace(now, timing.rest_s, 50)
    np.testing.assert_allclose(again.positions(times), timing.positions(times), atol=1e-10)
    one_by_one = [timing.position(t) for t in times.tolist()]
    np.testing.assert_allclose(timing.positions(times), one_by_one, atol=1e-12)

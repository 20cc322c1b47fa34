"""PTP is straight in joint space and ends exactly at its target."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.motion.path.ptp import ptp

angles = st.floats(-6.0, 6.0)


@given(st.lists(st.tuples(angles, angles), min_size=6, max_size=7), st.floats(0.0, 1.0))
def test_all_joints_go_evenly(ends: list[tuple[float, float]], s: float) -> None:
    start, end = tuple(a for a, _ in ends), tuple(b for _, b in ends)
    path = ptp(start, end)
    assert path.joints(0.0) == start
    assert path.joints(1.0) == end
    way = np.subtract(end, start)
    np.testing.assert_allclose(path.joints(s), start + s * way, atol=1e-14)
    q, first, second, third = path.derivatives(np.array([s]))
    np.testing.assert_allclose(q[0], start + s * way, atol=1e-14)
    np.testing.assert_allclose(first[0], way, atol=1e-14)
    assert not second.any()
    assert not third.any()

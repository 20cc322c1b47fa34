"""Joint limits along a path, how far joints go, and where a path is fastest: against many samples."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import chebyshev

from iiwa_sim.motion.path.extremes_kernel import first_outside, least_time_per_s, least_time_s, travel
from iiwa_sim.motion.path.piecewise_kernel import Polynomial
from iiwa_sim.motion.path.ptp import ptp

S = np.linspace(0.0, 1.0, 4001)


@st.composite
def paths(draw: st.DrawFn) -> Polynomial:
    """Three joints on one to three pieces that are continuous, with up to a dozen turns each."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    pieces, end = [], rng.normal(size=3)
    for _ in range(draw(st.integers(1, 3))):
        rows = rng.normal(size=(draw(st.integers(2, 12)), 3))
        rows[0] += end - chebyshev.chebval(-1.0, rows)
        end = chebyshev.chebval(1.0, rows)
        pieces.append(rows)
    borders = np.linspace(0.0, 1.0, len(pieces) + 1).tolist()
    start = tuple(chebyshev.chebval(-1.0, pieces[0]).tolist())
    return Polynomial(borders, pieces, start, tuple(end.tolist()))


@given(path=paths(), part=st.floats(0.5, 1.0), seed=st.integers(0, 2**32 - 1))
def test_the_first_place_outside_is_found(path: Polynomial, part: float, seed: int) -> None:
    q = path.derivatives(S)[0]
    middle = 0.5 * (q.min(axis=0) + q.max(axis=0))
    reach = 0.5 * np.ptp(q, axis=0) * np.random.default_rng(seed).uniform(part, 1.2, 3)
    lowest, highest = middle - reach, middle + reach
    outside = ((q < lowest) | (q > highest)).any(axis=1)
    found = first_outside(path, lowest, highest)
    if found is None:
        assert not outside.any()
        return
    before = path.derivatives(np.linspace(0.0, max(found.s - 1e-9, 0.0), 500))[0]
    assert found.s == 0.0 or ((before >= lowest) & (before <= highest)).all()
    position = path.joints(found.s)[found.joint]
    limit = highest[found.joint] if found.upwards else lowest[found.joint]
    if found.s > 0.0:
        assert position == pytest.approx(limit, abs=1e-9)
    if outside.any():
        assert found.s <= S[outside.argmax()] + 1e-12


def test_a_joint_that_turns_back_between_samples_is_found() -> None:
    rows = np.zeros((17, 1))
    rows[16] = 1.0  # sixteen turns, to -1 and 1
    path = Polynomial([0.0, 1.0], [rows], (1.0,), (1.0,))
    assert first_outside(path, np.array([-1.0 - 1e-12]), np.array([1.0 + 1e-12])) is None
    found = first_outside(path, np.array([-1.0 + 1e-9]), np.array([1.0 + 1e-12]))
    assert found is not None
    assert not found.upwards
    assert found.s == pytest.approx(0.5 - 0.5 * np.cos(np.pi / 16), abs=1e-5)


@given(path=paths())
def test_travel_is_there_and_back(path: Polynomial) -> None:
    expected = np.abs(np.diff(path.derivatives(S)[0], axis=0)).sum(axis=0)
    ways = travel(path)
    assert (ways <= 1.001 * expected).all()
    assert (ways >= 0.9 * expected).all()


def test_travel_of_ptp_is_its_way() -> None:
    np.testing.assert_allclose(travel(ptp((0.1, -2.0), (0.4, 1.0))), [0.3, 3.0])
    longest_s, farthest = least_time_s(ptp((0.1, -2.0), (0.4, 1.0)), np.array([0.01, 2.0]))
    assert (longest_s, farthest) == pytest.approx((30.0, 3.0))


@given(path=paths(), velocity=st.tuples(*[st.floats(0.1, 3.0)] * 3))
def test_the_fastest_place_is_found(path: Polynomial, velocity: tuple[float, ...]) -> None:
    limits = np.array(velocity)
    times = (np.abs(path.derivatives(S)[1]) / limits).max(axis=1)
    found = least_time_per_s(path, limits)
    # Of several places that lie close together the second-best may be taken.
    assert found <= times.min() + 0.02 * times.max()
    steepest = float((np.abs(path.derivatives(S)[2]) / limits).max())
    assert found >= times.min() - steepest / len(S)


def test_the_fastest_place_of_a_regular_path_is_found_exactly() -> None:
    rows = np.array([[0.0, 0.0], [1.0, 0.2], [0.0, 0.1], [-0.05, 0.0]])
    path = Polynomial([0.0, 1.0], [rows], (0.0, 0.0), (0.0, 0.0))
    # Twice 1 - 0.05 (12 x^2 - 3), least at the ends.
    assert least_time_per_s(path, np.array([2.0, 2.0])) == pytest.approx(1.0 - 0.05 * 9.0)
    assert least_time_per_s(path, np.array([2.0, 0.1])) == pytest.approx(times_where_both_cross())


def times_where_both_cross() -> float:
    """Of |1.15 - 0.6 x^2| and 20 |0.2 + 0.4 x| the larger, where it is least."""
    x = np.linspace(-1.0, 1.0, 2_000_001)
    return float(np.maximum(np.abs(1.15 - 0.6 * x**2), 20.0 * np.abs(0.2 + 0.4 * x)).min())

"""Joint limits along a path, how far joints go, and where a path is fastest: against many samples."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import chebyshev

from iiwa_sim.motion.path import first_outside, least_time_per_s
from iiwa_sim.motion.plan_kernel import Polynomial

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


@given(path=paths(), velocity=st.tuples(*[st.floats(0.1, 3.0)] * 3))
def test_the_fastest_place_is_found(path: Polynomial, velocity: tuple[float, ...]) -> None:
    limits = np.array(velocity)
    times = (np.abs(path.derivatives(S)[1]) / limits).max(axis=1)
    found = least_time_per_s(path, limits)
    # Of several places that lie close together the second-best may be taken.
    assert found <= times.min() + 0.02 * times.max()
    steepest = float((np.abs(path.derivatives(S)[2]) / limits).max())
    assert found >= times.min() - steepest / len(S)

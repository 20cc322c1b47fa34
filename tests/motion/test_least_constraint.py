"""The motion within bounds that deviates least."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.motion.least_constraint import least_deviation

NUMBERS = st.floats(-1.0, 1.0)


@given(
    matrix=st.lists(st.tuples(*[NUMBERS] * 4), min_size=3, max_size=3),
    wanted=st.tuples(*[NUMBERS] * 3),
    bounds=st.tuples(*[st.tuples(NUMBERS, st.floats(0.0, 0.5))] * 4),
)
def test_it_stays_within_bounds(
    matrix: list[tuple[float, ...]], wanted: tuple[float, ...], bounds: tuple[tuple[float, float], ...]
) -> None:
    least, greatest = [a for a, _ in bounds], [a + width for a, width in bounds]
    way = least_deviation(np.array(matrix), np.array(wanted), 1e-4, least, greatest)
    assert all(a - 1e-12 <= w <= b + 1e-12 for w, a, b in zip(way, least, greatest, strict=True))


def test_without_bounds_it_does_what_is_wanted_and_the_others_make_up_for_a_joint_at_its_bound() -> None:
    jacobian = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 2.0]])
    free = least_deviation(jacobian, np.array([1.0, 1.0]), 1e-9, [-9.0] * 3, [9.0] * 3)
    assert free == pytest.approx([0.5, 0.5, 0.5], abs=1e-6)
    held = least_deviation(jacobian, np.array([1.0, 1.0]), 1e-9, [-9.0] * 3, [0.1, 9.0, 9.0])
    assert held == pytest.approx([0.1, 0.9, 0.5], abs=1e-6)


def test_a_singular_direction_is_left_alone() -> None:
    jacobian = np.array([[1.0, 0.0], [0.0, 1e-6]])
    way = least_deviation(jacobian, np.array([0.0, 1e-3]), 1e-4, [-9.0] * 2, [9.0] * 2)
    assert np.abs(way).max() < 1e-4

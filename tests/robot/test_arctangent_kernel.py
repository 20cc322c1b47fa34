"""The angle of a direction by our own sums is near that of the C library."""

from __future__ import annotations

from math import atan2, inf, nan, pi, ulp

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from iiwa_sim.robot.arctangent_kernel import arctangent

numbers = st.floats(-1e3, 1e3) | st.floats(-1e-6, 1e-6) | st.sampled_from([-1.0, -0.0, 0.0, 1.0])


@given(y=numbers, x=numbers)
@example(1.0, 16.0)
@example(3.0, -16.0)
def test_within_two_units_in_the_last_place_of_the_c_library(y: float, x: float) -> None:
    expected = atan2(y, x) if y or x else 0.0
    if expected == -pi:  # atan2 gives it for a negative zero
        expected = pi
    assert abs(arctangent(y, x) - expected) <= 2.0 * ulp(expected)
    assert -pi < arctangent(y, x) <= pi


@pytest.mark.parametrize(("y", "x"), [(nan, 1.0), (1.0, nan), (inf, inf)])
def test_what_is_no_direction_does_no_harm(y: float, x: float) -> None:
    assert not arctangent(y, x) <= pi

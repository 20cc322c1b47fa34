"""Sine and cosine of our own are near the exact ones."""

from __future__ import annotations

from fractions import Fraction
from math import cos, floor, log2, nan, pi, sin

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from iiwa_sim.robot.trigonometry_kernel import cosine, sine, sines_and_cosines

PI = Fraction("3.14159265358979323846264338327950288419716939937510582097494459230781640628620899")


angles = st.floats(-7.0, 7.0) | st.floats(-1e5, 1e5)


def exact_sine(angle: Fraction) -> Fraction:
    """To 30 digits, by Taylor's series."""
    half_turns = round(angle / PI)
    angle -= PI * half_turns
    term = result = angle
    for k in range(2, 40, 2):
        term *= -angle * angle / (k * (k + 1))
        result += term
    return -result if half_turns % 2 else result


def last_place(value: Fraction) -> Fraction:
    return Fraction(2) ** (floor(log2(abs(value))) - 52)


@given(angle=angles)
@example(pi / 4)
@example(1.5707963267948966)
@example(100000.0)
def test_within_nine_tenths_of_the_last_place(angle: float) -> None:
    for found, true in (
        (sine(angle), exact_sine(Fraction(angle))),
        (cosine(angle), exact_sine(Fraction(angle) + PI / 2)),
    ):
        if abs(true) > 1e-300:
            assert abs(Fraction(found) - true) <= Fraction(9, 10) * last_place(true)


@given(some_angles=st.lists(angles | st.floats(-1e9, 1e9), min_size=1, max_size=7))
def test_those_of_several_are_those_of_each(some_angles: list[float]) -> None:
    count = len(some_angles)
    found = np.empty((2, count))
    sines_and_cosines(np.array(some_angles), count, found)
    assert found.tolist() == [list(map(sine, some_angles)), list(map(cosine, some_angles))]


@pytest.mark.parametrize("angle", [1e6, -3e17])
def test_of_many_turns(angle: float) -> None:
    assert (sine(angle), cosine(angle)) == (sin(angle), cos(angle))


def test_of_what_is_no_number() -> None:
    assert repr((sine(nan), cosine(nan))) == "(nan, nan)"

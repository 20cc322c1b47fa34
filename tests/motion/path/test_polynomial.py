"""A path's polynomial is evaluated exactly, and so are its derivatives."""

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import chebyshev

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.path.piecewise_kernel import Polynomial


def of_function(borders: list[float], rows: int) -> Polynomial:
    """Two joints, sin(3 s) and cos(5 s), fitted on each piece."""
    pieces = []
    for low, high in pairwise(borders):
        x = chebyshev.chebpts1(rows)
        s = 0.5 * (low + high) + 0.5 * (high - low) * x
        pieces.append(chebyshev.chebfit(x, function(s)[0], rows - 1))
    first, last = function(np.array([0.0, 1.0]))[0].tolist()
    return Polynomial(borders, pieces, tuple(first), tuple(last))


def function(s: Array) -> list[Array]:
    """It and its first three derivatives."""
    a, b = 3.0 * s, 5.0 * s
    rows = [
        (np.sin(a), np.cos(b)),
        (3.0 * np.cos(a), -5.0 * np.sin(b)),
        (-9.0 * np.sin(a), -25.0 * np.cos(b)),
        (-27.0 * np.cos(a), 125.0 * np.sin(b)),
    ]
    return [np.array(row).T for row in rows]


@given(
    st.lists(st.integers(1, 19), max_size=4, unique=True),
    st.integers(0, 2**32 - 1),
)
def test_it_and_its_derivatives_are_those_of_what_it_was_fitted_to(inner: list[int], seed: int) -> None:
    polynomial = of_function([0.0, *sorted(border / 20.0 for border in inner), 1.0], 18)
    s = np.random.default_rng(seed).uniform(0.0, 1.0, 20)
    shortest = float(np.diff(polynomial.borders).min())
    for order, (found, expected) in enumerate(zip(polynomial.derivatives(s), function(s), strict=True)):
        # Rounding and what the fit leaves grow with the square of the degree, over the length of a piece.
        np.testing.assert_allclose(found, expected, atol=1e-13 * (18**2 / shortest) ** order)
    for place, q in zip(s.tolist(), function(s)[0], strict=True):
        np.testing.assert_allclose(polynomial.joints(place), q, atol=1e-12)


def test_its_ends_are_exact_and_it_rests_beyond_them() -> None:
    pieces = [np.array([[0.1, 0.2], [0.3, -0.1]])]
    polynomial = Polynomial([0.0, 1.0], pieces, (-0.2, 0.3), (0.4, 0.1))
    assert polynomial.joints(0.0) == polynomial.joints(-1.0) == (-0.2, 0.3)
    assert polynomial.joints(1.0) == polynomial.joints(2.0) == (0.4, 0.1)

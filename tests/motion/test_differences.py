"""Derivatives from samples."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.motion.differences import EVEN_SAMPLES, derivatives


@given(
    seed=st.integers(0, 2**32 - 1),
    coefficients=st.lists(st.floats(-2, 2), min_size=5, max_size=5),
    samples=st.sampled_from([12, EVEN_SAMPLES, 80]),
)
def test_polynomials_of_the_fourth_degree_are_exact(
    seed: int, coefficients: list[float], samples: int
) -> None:
    if samples == EVEN_SAMPLES:
        s = np.linspace(0.0, 1.0, samples)
    else:
        steps = np.random.default_rng(seed).uniform(0.2, 1.0, samples - 1)
        s = np.concatenate([[0.0], np.cumsum(steps) / steps.sum()])
    p = np.polynomial.Polynomial(coefficients)
    for stencil in (5, 7):
        for order, found in enumerate(derivatives(s, p(s)[:, None], stencil), start=1):
            np.testing.assert_allclose(found[:, 0], p.deriv(order)(s), atol=1e-7 * samples**order / 50)


def test_a_finer_stencil_is_closer() -> None:
    s = np.linspace(0.0, 1.0, EVEN_SAMPLES)
    q = np.sin(6.0 * s)[:, None]
    errors = [np.abs(derivatives(s, q, n)[2][:, 0] + 216.0 * np.cos(6.0 * s)).max() for n in (5, 7)]
    assert errors[1] < 0.1 * errors[0]
    assert errors[1] < 1.0

"""Joins two pieces of a path by a polynomial that continues both up to the third derivative."""

import numpy as np

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.path.piecewise_kernel import Polynomial

_WEIGHTS = np.array(
    [
        [3072, 972, 204, 20, 3072, -972, 204, -20],
        [-3675, -603, -78, -5, 3675, -603, 78, -5],
        [0, -1050, -282, -30, 0, 1050, -282, 30],
        [735, 735, 126, 9, -735, 735, -126, 9],
        [0, 84, 84, 12, 0, -84, 84, -12],
        [-147, -147, -54, -5, 147, -147, 54, -5],
        [0, -6, -6, -2, 0, 6, -6, 2],
        [15, 15, 6, 1, -15, 15, -6, 1],
    ]
)
"""What the value and three derivatives over x at -1, and those at 1, count in each Chebyshev coefficient of
the polynomial of least degree that has them, times 6144: the inverse of the matrix of the values and
derivatives of the Chebyshev polynomials at both ends."""


def splice(width: float, first: Array, last: Array) -> Array:
    """Coefficients (8, n) of the polynomial with these values and three derivatives (4, n) at its ends.

    `width` is how much of s it takes; derivatives are over s.
    """
    half = 0.5 * width
    scales = np.array([1.0, half, half * half, half * half * half])[:, None]
    data = np.concatenate([first * scales, last * scales])
    coefficients = np.zeros_like(data)
    for row, weights in enumerate(_WEIGHTS / 6144.0):
        for weight, values in zip(weights, data, strict=True):
            coefficients[row] += weight * values
    return coefficients


def at_border(low: float, high: float, coefficients: Array, s: float) -> Array:
    """Joint positions and their first three derivatives (4, n) of a piece from s = low to high, at any s."""
    return Polynomial((low, high), [coefficients], (), ()).derivatives(np.array([s]))[:, 0]

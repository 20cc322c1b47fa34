"""Joins two pieces of a path by a polynomial that continues both up to the third derivative."""

from fractions import Fraction

import numpy as np

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.path import polynomial_kernel

ROWS = 8
"""Number of coefficients of the polynomial of least degree with given value and three derivatives at both
ends."""


def splice(width: float, first: Array, last: Array) -> Array:
    """Coefficients (8, n) of the polynomial with these values and three derivatives (4, n) at its ends.

    `width` is how much of s it takes; derivatives are over s.
    """
    half = 0.5 * width
    scales = np.array([1.0, half, half * half, half * half * half])[:, None]
    data = np.concatenate([first * scales, last * scales])
    coefficients = np.zeros((ROWS, data.shape[1]))
    for row, weights in enumerate(_WEIGHTS):
        for weight, values in zip(weights, data, strict=True):
            coefficients[row] += weight * values
    return coefficients


def at_border(low: float, high: float, coefficients: Array, s: float) -> Array:
    """Joint positions and their first three derivatives (4, n) of a piece from s = low to high, at any s."""
    values = np.empty((4, 1, coefficients.shape[1]))
    borders, offsets = np.array([low, high]), np.array([0, len(coefficients)], dtype=np.intp)
    polynomial_kernel.derivatives(borders, offsets, coefficients, np.array([s]), values)
    return values[:, 0]


def _weights() -> Array:
    """Weights (8, 8) of the eight given values in each coefficient: the inverse of the matrix of the values
    and derivatives of the T(i) at both ends, by fractions, so that they are the same on every machine."""
    rows = [[_derivative(i, order, side) for i in range(ROWS)] for side in (-1, 1) for order in range(4)]
    whole = [row + [Fraction(int(k == own)) for k in range(ROWS)] for own, row in enumerate(rows)]
    for column in range(ROWS):
        pivot = next(k for k in range(column, ROWS) if whole[k][column] != 0)
        whole[column], whole[pivot] = whole[pivot], whole[column]
        whole[column] = [value / whole[column][column] for value in whole[column]]
        for k in range(ROWS):
            if k != column:
                factor = whole[k][column]
                whole[k] = [a - factor * b for a, b in zip(whole[k], whole[column], strict=True)]
    return np.array([[float(value) for value in row[ROWS:]] for row in whole])


def _derivative(i: int, order: int, side: int) -> Fraction:
    """Derivative of an order of the Chebyshev polynomial T(i), at x = -1 or 1 (`side`)."""
    value = Fraction(side ** (i + order))
    for k in range(order):
        value *= Fraction(i * i - k * k, 2 * k + 1)
    return value


_WEIGHTS = _weights()

"""Derivatives of samples: those of the polynomial through the samples around each one."""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.motion.limits import Array

EVEN_SAMPLES = 33
"""So many samples over 0..1 must be equally spaced: their weights are kept."""


def derivatives(s: Array, q: Array, stencil: int) -> tuple[Array, Array, Array]:
    """The first three derivatives (m, n) of positions q (m, n) at rising values of s (m,).

    From as many samples as the stencil has, an odd number; at the ends these lie to one side.
    """
    places, weights = _even_weights(stencil) if len(s) == EVEN_SAMPLES else _weights(s, stencil)
    result = weights @ q[places]
    return result[:, 0], result[:, 1], result[:, 2]


class _Weights(NamedTuple):
    places: NDArray[np.intp]
    """The samples that play a part at each sample (m, stencil), itself first,"""
    weights: Array
    """and their parts in the three derivatives (m, 3, stencil)."""


@cache
def _even_weights(stencil: int) -> _Weights:
    return _weights(np.linspace(0.0, 1.0, EVEN_SAMPLES), stencil)


def _weights(s: Array, stencil: int) -> _Weights:
    """The derivatives at 0 of the Lagrange polynomials, which are 1 at one offset x and 0 at the others.

    With offset 0 among them, that of the offset x_j is x / x_j times the product of (x - x_k) / (x_j - x_k)
    over the other offsets x_k. The product of the (x - x_k) is p (1 - s1 x + s2 x^2 - ...), where p is the
    product of the -x_k, s1 the sum of the 1 / x_k and s2 the sum of the 1 / (x_k x_l) over pairs.
    """
    m = len(s)
    own = np.arange(m)[:, None]
    first = np.clip(own - stencil // 2, 0, m - stencil)
    others = first + np.arange(stencil - 1)
    others += others >= own
    x = s[others] - s[:, None]
    apart = x[:, :, None] - x[:, None, :]
    apart[:, np.arange(stencil - 1), np.arange(stencil - 1)] = 1.0
    reciprocal = 1.0 / x
    s1 = reciprocal.sum(axis=1, keepdims=True) - reciprocal
    squares = (reciprocal**2).sum(axis=1, keepdims=True) - reciprocal**2
    s2 = (s1**2 - squares) / 2.0
    p = (-x).prod(axis=1, keepdims=True) / -x
    lead = p / (x * apart.prod(axis=2))
    parts = np.stack([lead, -2.0 * lead * s1, 6.0 * lead * s2], axis=1)
    return _Weights(
        np.hstack([own, others]), np.concatenate([-parts.sum(axis=2, keepdims=True), parts], axis=2)
    )

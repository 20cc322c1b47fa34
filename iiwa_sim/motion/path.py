"""What a path is: joint positions over a parameter s from 0 to 1, and its shape at samples.

The samples are what a timing is planned from. Derivatives are with respect to s and come from finite
differences over the samples, so a path has to give positions only.
"""

from functools import cache
from typing import NamedTuple, Protocol

import numpy as np

from iiwa_sim.motion.limits import Array

Joints = tuple[float, ...]

STENCIL = 7  # samples in a difference: sixth order for q', fourth for q'''


class Path(Protocol):
    """A curve in joint space."""

    @property
    def end(self) -> Joints:
        """Joint positions (rad) at s = 1, exactly."""

    def joints(self, s: float) -> Joints:
        """Joint positions (rad) at 0 <= s <= 1."""


class PathSamples(NamedTuple):
    """A path at m equally spaced values of s: `s` is (m,), the others (m, n), in rad per unit of s."""

    s: Array
    q: Array
    dq: Array
    ddq: Array
    dddq: Array

    @classmethod
    def from_positions(cls, q: Array) -> "PathSamples":
        """The samples of a path with positions q (m, n) at m equally spaced s, 0 and 1 included."""
        m = len(q)
        first, second, third = _differences(m)
        return cls(np.linspace(0.0, 1.0, m), q, first @ q, second @ q, third @ q)


@cache
def _differences(m: int) -> tuple[Array, Array, Array]:
    """Matrices (m, m) that take m equally spaced positions on 0..1 to their first three derivatives.

    Each row differentiates the polynomial through the STENCIL samples around it, or next to it at the ends.
    """
    # By the place of a sample in its stencil: what takes positions to the polynomial's coefficients there.
    powers = [np.vander(np.arange(STENCIL) - float(place), increasing=True) for place in range(STENCIL)]
    coefficients = [np.linalg.inv(power) for power in powers]
    scale = float(m - 1)
    matrices = np.zeros((3, m, m))
    for row in range(m):
        first = min(max(row - STENCIL // 2, 0), m - STENCIL)
        for order, factorial in ((1, 1.0), (2, 2.0), (3, 6.0)):
            weights = factorial * scale**order * coefficients[row - first][order]
            matrices[order - 1, row, first : first + STENCIL] = weights
    return matrices[0], matrices[1], matrices[2]

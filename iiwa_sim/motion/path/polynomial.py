"""Joint positions over s from 0 to 1 as pieces of Chebyshev polynomials: what every move's path is.

A polynomial is evaluated in a fixed number of steps, and so are its derivatives: no samples, no differences.
"""

from collections.abc import Sequence

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.sampled_path import Joints


class Polynomial:
    """A curve in joint space; it never changes.

    Piece k lies between `borders[k]` and `borders[k + 1]`. With x going from -1 to 1 along it, joint j is the
    sum over i of `coefficients[offsets[k] + i, j]` times the Chebyshev polynomial T_i(x). Consecutive pieces
    agree in positions and in their first three derivatives, but for rounding and for what the fit leaves.
    """

    borders: Array
    """(pieces + 1,), rising from 0 to 1"""
    offsets: NDArray[np.intp]
    """(pieces + 1,): the first row of each piece's coefficients, and the count of all rows"""
    coefficients: Array
    """(rows, joints), rad"""
    start: Joints
    """Joint positions (rad) at s = 0, exactly."""
    end: Joints
    """Joint positions (rad) at s = 1, exactly."""
    tcp_length_m: float | None
    """How far the TCP goes, where it goes straight and evenly with s."""

    def __init__(
        self,
        borders: Sequence[float],
        pieces: Sequence[Array],
        start: Joints,
        end: Joints,
        tcp_length_m: float | None = None,
    ) -> None:
        """Of the coefficients (any number of rows, joints) of each piece."""
        self.borders = np.array(borders, dtype=np.float64)
        self.offsets = np.cumsum([0, *map(len, pieces)], dtype=np.intp)
        self.coefficients = np.ascontiguousarray(np.concatenate(pieces), dtype=np.float64)
        self.start = start
        self.end = end
        self.tcp_length_m = tcp_length_m
        for array in (self.borders, self.offsets, self.coefficients):
            array.flags.writeable = False

    def joints(self, s: float) -> Joints:
        """Joint positions (rad) at s; before 0 those of the start, beyond 1 those of the end."""
        if s <= 0.0:
            return self.start
        if s >= 1.0:
            return self.end
        return tuple(self.derivatives(np.array([s]))[0][0].tolist())

    def derivatives(self, s: Array) -> tuple[Array, Array, Array, Array]:
        """Positions (rad) and their first three derivatives (rad per unit of s ...), each (m, n), at s (m,).

        Outside 0..1 they are those of the first or last piece, continued.
        """
        places = np.clip(self.borders.searchsorted(s, side="right") - 1, 0, len(self.borders) - 2)
        found = tuple(np.empty((len(s), self.coefficients.shape[1])) for _ in range(4))
        for k in np.unique(places):
            rows: Array = self.coefficients[self.offsets[k] : self.offsets[k + 1]]
            here = places == k
            low, high = float(self.borders[k]), float(self.borders[k + 1])
            x = (2.0 * s[here] - low - high) / (high - low)
            for values in found:
                values[here] = chebyshev.chebval(x, rows).T
                rows = np.asarray(chebyshev.chebder(rows, scl=2.0 / (high - low)), dtype=np.float64)
        return found[0], found[1], found[2], found[3]

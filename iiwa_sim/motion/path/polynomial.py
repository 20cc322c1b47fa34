"""Joint positions over s from 0 to 1 as pieces of Chebyshev polynomials: what every move's path is.

A polynomial is evaluated in a fixed number of steps, and so are its derivatives: no samples, no differences.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.path import extremes_kernel, polynomial_kernel


class Outside(NamedTuple):
    """The place at which a joint leaves its position limits."""

    s: float
    joint: int
    """Index of the joint."""
    upwards: bool
    """Whether it leaves through the upper limit."""


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
        """`pieces` has the coefficients (rows, joints) of each piece."""
        self.borders = np.array(borders, dtype=np.float64)
        self.offsets = np.cumsum([0, *map(len, pieces)], dtype=np.intp)
        self.coefficients = np.ascontiguousarray(np.concatenate(pieces), dtype=np.float64)
        self.start = start
        self.end = end
        self.tcp_length_m = tcp_length_m
        self._room = np.empty((1, 1, len(start)))

    def joints(self, s: float) -> Joints:
        """Joint positions (rad) at s; before 0 those of the start, beyond 1 those of the end."""
        if s <= 0.0:
            return self.start
        if s >= 1.0:
            return self.end
        joints: Joints = polynomial_kernel.joints(
            self.borders, self.offsets, self.coefficients, s, self._room
        )
        return joints

    def derivatives(self, s: Array) -> tuple[Array, Array, Array, Array]:
        """Positions (rad) and their first three derivatives (rad per unit of s ...), each (m, n), at s (m,).

        Outside 0..1 they are those of the first or last piece, continued.
        """
        values = np.empty((4, len(s), self.coefficients.shape[1]))
        places = np.ascontiguousarray(s, dtype=np.float64)
        polynomial_kernel.derivatives(self.borders, self.offsets, self.coefficients, places, values)
        return values[0], values[1], values[2], values[3]

    def first_outside(self, lowest: Array, highest: Array) -> Outside | None:
        """The first place at which a joint leaves its limits (rad, (n,)); None where none does.

        Where a joint turns back is found, so that it cannot swing out and back between two samples.
        """
        s, joint = extremes_kernel.first_outside(
            self.borders, self.offsets, self.coefficients, lowest, highest
        )
        if joint < 0:
            return None
        return Outside(s, joint, bool(self.joints(s)[joint] > 0.5 * (lowest[joint] + highest[joint])))

    def travel(self) -> Array:
        """How far each joint goes, there and back (rad, (n,)), but for what is missed where it turns between
        places that are looked at."""
        ways = np.empty(self.coefficients.shape[1])
        extremes_kernel.travel(self.offsets, self.coefficients, ways)
        return ways

    def least_time_per_s(self, velocity: Array) -> float:
        """How long (s) a unit of s takes where it takes least.

        There the TCP of a line is fastest, with its fastest joint at the velocity limit (rad/s, (n,)).
        """
        room = np.empty((2, 1, self.coefficients.shape[1]))
        time_s: float = extremes_kernel.least_time_per_s(
            self.borders, self.offsets, self.coefficients, velocity, room
        )
        return time_s

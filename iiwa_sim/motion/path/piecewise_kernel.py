"""Joint positions over s from 0 to 1 as pieces of Chebyshev polynomials: what every move's path is.

A polynomial is evaluated in a fixed number of steps, and so are its derivatives: no samples, no differences.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cython
import numpy as np
from numpy.typing import NDArray

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.path import extremes_kernel
from iiwa_sim.motion.path.polynomial_kernel import derivatives

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.path.polynomial_kernel import evaluate, piece_at
else:
    from iiwa_sim.motion.path.polynomial_kernel import evaluate, piece_at


class Outside(NamedTuple):
    """The place at which a joint leaves its position limits."""

    s: float
    joint: int
    """Index of the joint."""
    upwards: bool
    """Whether it leaves through the upper limit."""


@cython.cclass
class Polynomial:
    """A curve in joint space; it never changes.

    Piece k lies between `borders[k]` and `borders[k + 1]`. With x going from -1 to 1 along it, joint j is the
    sum over i of `coefficients[offsets[k] + i, j]` times the Chebyshev polynomial T_i(x). Consecutive pieces
    agree in positions and in their first three derivatives, but for rounding and for what the fit leaves.
    """

    def __init__(
        self,
        borders: Sequence[float],
        pieces: Sequence[Array],
        start: Joints,
        end: Joints,
        tcp_length_m: float | None = None,
    ) -> None:
        """`pieces` has the coefficients (rows, joints) of each piece; `start` and `end` are its exact ends.

        `tcp_length_m` is how far the TCP goes, where it goes straight and evenly with s.
        """
        self.borders: Array = np.array(borders, dtype=np.float64)
        """(pieces + 1,), rising from 0 to 1"""
        self.offsets: NDArray[np.intp] = np.zeros(len(pieces) + 1, dtype=np.intp)
        """(pieces + 1,): the first row of each piece's coefficients, and the count of all rows"""
        self.coefficients: Array = np.array(
            pieces[0] if len(pieces) == 1 else np.concatenate(pieces), dtype=np.float64, order="C"
        )
        """(rows, joints), rad"""
        self.start = start
        """Joint positions (rad) at s = 0."""
        self.end = end
        """Joint positions (rad) at s = 1."""
        self.tcp_length_m = tcp_length_m
        self._borders, self._offsets = self.borders, self.offsets
        self._coefficients = self.coefficients
        self._room = np.empty((1, 1, len(start)))
        for k in range(len(pieces)):
            self._offsets[k + 1] = self._offsets[k] + len(pieces[k])

    def joints(self, s: cython.double) -> Joints:
        """Joint positions (rad) at s; before 0 those of the start, beyond 1 those of the end."""
        place: Joints
        if s <= 0.0:
            place = self.start
        elif s >= 1.0:
            place = self.end
        else:
            piece = piece_at(self._borders, s)
            evaluate(self._borders, self._offsets, self._coefficients, piece, s, 0, self._room, 0)
            place = tuple([self._room[0, 0, j] for j in range(self._room.shape[2])])
        return place

    def derivatives(self, s: Array) -> tuple[Array, Array, Array, Array]:
        """Positions (rad) and their first three derivatives (rad per unit of s ...), each (m, n), at s (m,).

        Outside 0..1 they are those of the first or last piece, continued.
        """
        values = np.empty((4, len(s), self.coefficients.shape[1]))
        places = np.ascontiguousarray(s, dtype=np.float64)
        derivatives(self.borders, self.offsets, self.coefficients, places, values)
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

    def least_time_s(self, velocity: Array) -> tuple[float, float]:
        """How long (s) it takes with one joint at its velocity limit (rad/s, (n,)) all the way; and the way
        (rad) of the joint that goes farthest. NaN where the curve is."""
        ways: cython.double[::1] = self.travel()
        limits: cython.double[::1] = velocity
        longest_s: cython.double = 0.0
        farthest: cython.double = 0.0
        for j in range(ways.shape[0]):
            time_s: cython.double = ways[j] / limits[j]
            if time_s > longest_s or time_s != time_s:
                longest_s = time_s
            farthest = max(farthest, ways[j])
        return longest_s, farthest

    def least_time_per_s(self, velocity: Array) -> float:
        """How long (s) a unit of s takes where it takes least.

        There the TCP of a line is fastest, with its fastest joint at the velocity limit (rad/s, (n,)).
        """
        room = np.empty((2, 1, self.coefficients.shape[1]))
        time_s: float = extremes_kernel.least_time_per_s(
            self.borders, self.offsets, self.coefficients, velocity, room
        )
        return time_s

"""Joint positions over s from 0 to 1 as pieces of Chebyshev polynomials: what every move's path is.

A polynomial is evaluated in a fixed number of steps, and so are its derivatives: no samples, no differences.
They come from the same recurrence as the polynomials themselves, T(k + 1) = 2 x T(k) - T(k - 1), and what
that is when it is differentiated.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence

import cython
import numpy as np
from numpy.typing import NDArray

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import Array


@cython.cclass
class Polynomial:
    """A curve in joint space; it never changes.

    Piece k lies between `borders[k]` and `borders[k + 1]`. With x going from -1 to 1 along it, joint j is the
    sum over i of `coefficients[offsets[k] + i, j]` times the Chebyshev polynomial T_i(x). Consecutive pieces
    of a move agree in positions and in their first three derivatives, but for rounding and for what the fit
    leaves.
    """

    def __init__(
        self,
        borders: Sequence[float] | Array,
        pieces: Sequence[Array],
        start: Joints,
        end: Joints,
        tcp_length_m: float | None = None,
    ) -> None:
        """`pieces` has the coefficients (rows, joints) of each piece; `start` and `end` are its exact ends.

        `tcp_length_m` is how far the TCP goes, where it goes straight and evenly with s.
        """
        self.borders: Array = np.array(borders, dtype=np.float64)
        """(pieces + 1,), rising: from 0 to 1 where this is the path of a move"""
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
        self.joint_count = self.coefficients.shape[1]
        self.piece_count = len(pieces)
        self.straight = len(self.coefficients) == 2
        """Whether the joints go straight and evenly with s."""
        self._borders, self._offsets = self.borders, self.offsets
        # Filled up to eight joints, or a multiple.
        padded = np.zeros((len(self.coefficients), (self.joint_count + 7) // 8 * 8))
        padded[:, : self.joint_count] = self.coefficients
        self._coefficients = padded
        self._room = np.empty((1, 1, self.joint_count))
        for k in range(len(pieces)):
            self._offsets[k + 1] = self._offsets[k] + len(pieces[k])

    @cython.cfunc
    @cython.exceptval(check=False)
    def _piece_at(self, s: cython.double) -> cython.Py_ssize_t:
        """The piece in which s lies; the first or last one where s is outside of all."""
        low: cython.Py_ssize_t = 0
        high: cython.Py_ssize_t = self.piece_count
        while high - low > 1:
            middle = (low + high) // 2
            if s < self._borders[middle]:
                high = middle
            else:
                low = middle
        return low

    @cython.cfunc
    @cython.exceptval(check=False)
    def inside(self, piece: cython.Py_ssize_t, part: cython.double) -> cython.double:
        """The s at a part (0..1) of a piece."""
        return self._borders[piece] + (self._borders[piece + 1] - self._borders[piece]) * part

    @cython.cfunc
    @cython.exceptval(check=False)
    def evaluate(
        self, s: cython.double, orders: cython.int, values: cython.double[:, :, ::1], row: cython.Py_ssize_t
    ) -> cython.void:
        """Joint positions at s into `values[0, row]`, and their derivatives up to the order `orders`, 3 at
        most, into `values[1, row]` and so on: `values` is (orders + 1 or more, rows, joints).

        Outside of all pieces they are those of the first or last one, continued.
        """
        piece: cython.Py_ssize_t = self._piece_at(s)
        count: cython.Py_ssize_t = self.joint_count
        i: cython.Py_ssize_t
        j: cython.Py_ssize_t
        first: cython.Py_ssize_t = self._offsets[piece]
        last: cython.Py_ssize_t = self._offsets[piece + 1]
        scale: cython.double = 2.0 / (self._borders[piece + 1] - self._borders[piece])
        x: cython.double = (s - self._borders[piece]) * scale - 1.0
        if self.straight:  # the same in short
            for j in range(count):
                values[0, row, j] = self._coefficients[0, j] + self._coefficients[1, j] * x
                if orders > 0:
                    values[1, row, j] = self._coefficients[1, j] * scale
                for k in range(2, orders + 1):
                    values[k, row, j] = 0.0
            return
        double_x: cython.double = 2.0 * x
        y0 = cython.declare(cython.double[8])
        y1 = cython.declare(cython.double[8])
        y2 = cython.declare(cython.double[8])
        y3 = cython.declare(cython.double[8])
        # Sums of eight joints at once are kept in registers.
        for j in range(0, count, 8):
            for i in range(8):
                y0[i] = self._coefficients[first, j + i]
                y1[i] = y2[i] = y3[i] = 0.0
            # T(k) and its derivatives d, e, f; those of k - 1 (before) and their next.
            t0: cython.double = 1.0
            t1: cython.double = x
            d0: cython.double = 0.0
            d1: cython.double = 1.0
            e0: cython.double = 0.0
            e1: cython.double = 0.0
            f0: cython.double = 0.0
            f1: cython.double = 0.0
            if orders == 0:
                for k in range(first + 1, last):
                    for i in range(8):
                        y0[i] += self._coefficients[k, j + i] * t1
                    t = double_x * t1 - t0
                    t0 = t1
                    t1 = t
                for i in range(min(count - j, 8)):
                    values[0, row, j + i] = y0[i]
                continue
            for k in range(first + 1, last):
                for i in range(8):
                    c = self._coefficients[k, j + i]
                    y0[i] += c * t1
                    y1[i] += c * d1
                    y2[i] += c * e1
                    y3[i] += c * f1
                t = double_x * f1 - f0 + 6.0 * e1
                f0 = f1
                f1 = t
                t = double_x * e1 - e0 + 4.0 * d1
                e0 = e1
                e1 = t
                t = double_x * d1 - d0 + 2.0 * t1
                d0 = d1
                d1 = t
                t = double_x * t1 - t0
                t0 = t1
                t1 = t
            for i in range(min(count - j, 8)):
                values[0, row, j + i] = y0[i]
                values[1, row, j + i] = y1[i] * scale
                if orders > 1:
                    values[2, row, j + i] = y2[i] * (scale * scale)
                if orders > 2:
                    values[3, row, j + i] = y3[i] * (scale * scale * scale)

    @cython.cfunc
    @cython.exceptval(check=False)
    def place(
        self, s: cython.double, values: cython.double[:, :, ::1], row: cython.Py_ssize_t
    ) -> cython.void:
        """Joint positions at s into `values[0, row]`."""
        self.evaluate(s, 0, values, row)

    def joints(self, s: cython.double) -> Joints:
        """Joint positions (rad) at s; before 0 that is the start, beyond 1 the end."""
        place: Joints
        if s <= self._borders[0]:
            place = self.start
        elif s >= self._borders[self.piece_count]:
            place = self.end
        else:
            self.place(s, self._room, 0)
            place = tuple([self._room[0, 0, j] for j in range(self.joint_count)])
        return place

    def derivatives(self, s: Array) -> Array:
        """Positions (rad) and their first three derivatives (rad per unit of s ...), (4, m, n), at s (m,).

        Outside of all pieces they are those of the first or last one, continued.
        """
        found: Array = np.empty((4, len(s), self.joint_count))
        values: cython.double[:, :, ::1] = found
        places: cython.double[::1] = np.ascontiguousarray(s, dtype=np.float64)
        row: cython.Py_ssize_t
        for row in range(places.shape[0]):
            self.evaluate(places[row], 3, values, row)
        return found

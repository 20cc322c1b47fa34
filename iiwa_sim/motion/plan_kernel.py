"""Inner loops of the planner, compiled by Cython: paths, blended paths, the fastest run, the speed profile.

A *path* q(s) of a move is a piecewise Chebyshev polynomial (`Polynomial`). A `BlendedPath` q(x) joins paths
of moves; within a blend it adds two moves. `run` finds the fastest motion x(t) without jerk limits.

A *speed profile* (`SpeedProfile`) keeps velocity, acceleration and jerk limits. The path coordinate x(theta)
is a cubic B-spline over N segments; theta counts segments. The profile is the squared rate
b(theta) = (dtheta/dt)^2 in 1 / UNIT_S^2, a quadratic B-spline with coefficients c (N + 2,).
A joint with derivatives q', q'', q''' (rad) over theta has

    velocity q' sqrt(b),  acceleration q'' b + q' b' / 2,  jerk sqrt(b) (q''' b + 3/2 q'' b' + q' b'' / 2).

Each is divided by its limit and becomes a constraint, a row g: |g c| <= 1 for acceleration and squared
velocity, |g c| <= 1 / sqrt(b) for jerk. The tangent of the convex 1 / sqrt(b) lies below it, so a step that
keeps the tangent keeps the limit. A primal-dual interior-point method (Boyd and Vandenberghe, "Convex
Optimization", 11.7) minimises the duration. It knows few rows; a check of all samples adds rows where a limit
is exceeded, and the method continues.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cython
import numpy as np
from cython.cimports.libc.math import cbrt, fabs, sqrt
from numpy.typing import NDArray

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import Array

# A joint that goes less than this per unit of x (rad) bounds nothing; lowest dx/dt.
STILL, SLOWEST = cython.declare(cython.double, 1e-9), cython.declare(cython.double, 1e-9)
# Newton's method in a blend ends with a step as small as this.
PLACES = cython.declare(cython.double, 1e-15)
# Samples of a move outside of blends: one for each OWN of x (some milliseconds at full speed), from LEAST_OWN
# to MOST_OWN. Each piece of a path has IN_PIECE. Samples nearer than APART are one.
OWN, LEAST_OWN = cython.declare(cython.double, 0.004), cython.declare(cython.Py_ssize_t, 24)
MOST_OWN = cython.declare(cython.Py_ssize_t, 96)
IN_PIECE, APART = cython.declare(cython.Py_ssize_t, 16), cython.declare(cython.double, 1e-9)
# Edges: even marks of a blend, and more near its ends. Samples have this distance from an edge, as a part of
# the shorter side of a blend, and of a piece.
MARKS, BESIDE = cython.declare(cython.Py_ssize_t, 10), cython.declare(cython.Py_ssize_t, 4)
NEAR_EDGE, BORDER = cython.declare(cython.double, 1e-5), cython.declare(cython.double, 1e-8)
UNIT_S = 0.01
_UNIT_S = cython.declare(cython.double, 0.01)
# Even samples of a smooth segment, and of one in a blend, with edges of the path, or among the ENDS first and
# last ones. A curved path has one more for each LONG of x, at most MOST.
SMOOTH, DENSE = cython.declare(cython.Py_ssize_t, 4), cython.declare(cython.Py_ssize_t, 7)
ENDS, LONG = cython.declare(cython.Py_ssize_t, 3), cython.declare(cython.double, 0.0101)
MOST = cython.declare(cython.Py_ssize_t, 20)
# Parts of limits: velocity, and others, that pass the check; what added rows divide by; an old profile's.
VELOCITY, TOLERANCE = cython.declare(cython.double, 1.0003), cython.declare(cython.double, 1.004)
STRICTER, KEPT = cython.declare(cython.double, 1.001), cython.declare(cython.double, 0.9998)
ROUNDS = cython.declare(cython.Py_ssize_t, 8)  # most times that rows are added
ACCEPTED = cython.declare(cython.double, 1.002)  # excess after the last of them
# Steps: part of the gap that they aim at, part of the distance to a bound that they go, most of a round.
CENTERING, NEAR = cython.declare(cython.double, 0.2), cython.declare(cython.double, 0.98)
STEPS = cython.declare(cython.Py_ssize_t, 40)
# A round begins with a gap for each segment (part of the duration) and a least slack (part of the bound).
COLD_GAP, COLD_SLACK = cython.declare(cython.double, 0.1), cython.declare(cython.double, 0.2)
WARM_GAP, WARM_SLACK = cython.declare(cython.double, 0.004), cython.declare(cython.double, 0.005)
TIE = cython.declare(cython.double, 20.0)  # pulls the outermost coefficients to those beside them
HELD = cython.declare(cython.double, 1e30)  # of coefficients that stay
SAMPLE_COST = cython.declare(cython.Py_ssize_t, 2)  # in interior-point steps of a segment, some 0.2 us


@cython.ccall
@cython.exceptval(check=False)
def shape(v: cython.double, rho: cython.double, order: cython.int) -> cython.double:
    """F(v), the shape of blends: a cubic up to rho, then a parabola; or its derivative of an order."""
    height: cython.double = 1.0 / (rho * (3.0 - 3.0 * rho + rho * rho))  # makes F(1) = 1
    if v < rho:
        if order == 0:
            return height * v * v * v
        if order == 1:
            return 3.0 * height * v * v
        return 6.0 * height * (v if order == 2 else 1.0)
    if order == 0:
        return height * rho * (3.0 * v * v - 3.0 * rho * v + rho * rho)
    if order == 1:
        return height * rho * (6.0 * v - 3.0 * rho)
    return 6.0 * height * rho if order == 2 else 0.0


@cython.cfunc
@cython.exceptval(check=False)
def blend_part(
    x: cython.double, first_x: cython.double, second_x: cython.double, rho: cython.double
) -> cython.double:
    """Return v (0 to 1) in a blend from first_x before its target to second_x behind, at an x from there."""
    low: cython.double = 0.0
    high: cython.double = 1.0
    v: cython.double = (x + first_x) / (first_x + second_x)
    for _ in range(60):
        y = second_x * shape(v, rho, 0) - first_x * shape(1.0 - v, rho, 0) - x
        if y > 0.0:
            high = v
        else:
            low = v
        slope = second_x * shape(v, rho, 1) + first_x * shape(1.0 - v, rho, 1)
        y = v - y / slope
        if y < low or y > high:
            y = 0.5 * (low + high)
        if fabs(y - v) < PLACES:
            return y
        v = y
    return v


@cython.cfunc
@cython.exceptval(check=False)
def spline(controls: cython.double[::1], cell: cython.Py_ssize_t, part: cython.double) -> cython.double:
    """Return x at a part of a cell; `controls` (N + 3,) are those of a cubic B-spline over cells."""
    u: cython.double = part
    w: cython.double = 1.0 - u
    return (
        w * w * w * controls[cell]
        + (3.0 * u * u * u - 6.0 * u * u + 4.0) * controls[cell + 1]
        + (3.0 * w * w * w - 6.0 * w * w + 4.0) * controls[cell + 2]
        + u * u * u * controls[cell + 3]
    ) / 6.0


@cython.cfunc
@cython.exceptval(check=False)
def part_at(controls: cython.double[::1], k: cython.Py_ssize_t, x: cython.double) -> cython.double:
    """Return the part of a segment at x, to rounding: x never falls over an edge that is near it."""
    low: cython.double = 0.0
    high: cython.double = 1.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        if spline(controls, k, middle) > x:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


@cython.cclass
class Polynomial:
    """A curve in joint space; it never changes.

    Piece k lies between `borders[k]` and `borders[k + 1]`. With x going from -1 to 1 along it, joint j is the
    sum over i of `coefficients[offsets[k] + i, j]` times the Chebyshev polynomial T_i(x). Consecutive pieces
    of a move agree in positions and in their first three derivatives, but for rounding and for what the fit
    leaves.
    """

    borders: Array = cython.declare(object, visibility="readonly")
    """(pieces + 1,), rising: from 0 to 1 for the path of a move"""
    offsets: NDArray[np.intp] = cython.declare(object, visibility="readonly")
    """(pieces + 1,): the first row of each piece's coefficients, and the count of all rows"""
    coefficients: Array = cython.declare(object, visibility="readonly")
    """(rows, joints), rad"""
    start: Joints = cython.declare(object, visibility="readonly")
    end: Joints = cython.declare(object, visibility="readonly")
    tcp_length_m: float | None = cython.declare(object, visibility="readonly")
    joint_count: int = cython.declare(cython.Py_ssize_t, visibility="readonly")
    piece_count: int = cython.declare(cython.Py_ssize_t, visibility="readonly")
    straight: bool = cython.declare(cython.bint, visibility="readonly")
    """True if the joints go straight and evenly with s."""
    _borders: cython.double[::1]
    _offsets: cython.Py_ssize_t[::1]
    _padded: cython.double[:, ::1]  # coefficients, filled up to eight joints, or a multiple
    _room: cython.double[:, :, ::1]

    def __init__(
        self,
        borders: Sequence[float] | Array,
        pieces: Sequence[Array],
        start: Joints,
        end: Joints,
        tcp_length_m: float | None = None,
    ) -> None:
        """`pieces` has the coefficients (rows, joints) of each piece; `start` and `end` are its exact ends.

        `tcp_length_m` is the distance of the TCP, if it goes straight and evenly with s.
        """
        rows = pieces[0] if len(pieces) == 1 else np.concatenate(pieces)
        self.borders, self.coefficients = np.array(borders, np.float64), np.array(rows, np.float64)
        self.offsets = np.zeros(len(pieces) + 1, dtype=np.intp)
        self.start, self.end, self.tcp_length_m = start, end, tcp_length_m
        self.joint_count, self.piece_count = rows.shape[1], len(pieces)
        self.straight = len(rows) == 2
        self._borders, self._offsets = self.borders, self.offsets
        padded = np.zeros((len(rows), (self.joint_count + 7) // 8 * 8))
        padded[:, : self.joint_count] = rows
        self._padded, self._room = padded, np.empty((1, 1, self.joint_count))
        for k in range(len(pieces)):
            self._offsets[k + 1] = self._offsets[k] + len(pieces[k])

    @cython.cfunc
    @cython.exceptval(check=False)
    def _piece_at(self, s: cython.double) -> cython.Py_ssize_t:
        """Return the piece in which s lies; the first or last one where s is outside of all."""
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
    def evaluate(
        self, s: cython.double, orders: cython.int, values: cython.double[:, :, ::1], row: cython.Py_ssize_t
    ) -> cython.void:
        """Write joint positions at s to `values[0, row]`; for `orders` 3 (else 0) also three derivatives.

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
        double_x: cython.double = 2.0 * x
        y0 = cython.declare(cython.double[8])
        y1 = cython.declare(cython.double[8])
        y2 = cython.declare(cython.double[8])
        y3 = cython.declare(cython.double[8])
        # Sums of eight joints at once are kept in registers.
        for j in range(0, count, 8):
            for i in range(8):
                y0[i] = self._padded[first, j + i]
                y1[i] = y2[i] = y3[i] = 0.0
            # T(k) and its derivatives d, e, f; those of k - 1 (before) and their next.
            t0, t1, d0, d1 = 1.0, x, 0.0, 1.0
            e0 = e1 = f0 = f1 = 0.0
            if orders == 0:
                for k in range(first + 1, last):
                    for i in range(8):
                        y0[i] += self._padded[k, j + i] * t1
                    t0, t1 = t1, double_x * t1 - t0
                for i in range(min(count - j, 8)):
                    values[0, row, j + i] = y0[i]
                continue
            for k in range(first + 1, last):
                for i in range(8):
                    c = self._padded[k, j + i]
                    y0[i] += c * t1
                    y1[i] += c * d1
                    y2[i] += c * e1
                    y3[i] += c * f1
                f0, f1 = f1, double_x * f1 - f0 + 6.0 * e1
                e0, e1 = e1, double_x * e1 - e0 + 4.0 * d1
                d0, d1 = d1, double_x * d1 - d0 + 2.0 * t1
                t0, t1 = t1, double_x * t1 - t0
            for i in range(min(count - j, 8)):
                values[0, row, j + i] = y0[i]
                values[1, row, j + i] = y1[i] * scale
                values[2, row, j + i] = y2[i] * (scale * scale)
                values[3, row, j + i] = y3[i] * (scale * scale * scale)

    def joints(self, s: cython.double) -> Joints:
        """Return joint positions (rad) at s; before 0 that is the start, beyond 1 the end."""
        place: Joints
        if s <= self._borders[0]:
            place = self.start
        elif s >= self._borders[self.piece_count]:
            place = self.end
        else:
            self.evaluate(s, 0, self._room, 0)
            place = tuple([self._room[0, 0, j] for j in range(self.joint_count)])
        return place

    def derivatives(self, s: Array) -> Array:
        """Return positions (rad) and their first three derivatives by s, (4, m, n), at s (m,).

        Outside of all pieces they are those of the first or last one, continued.
        """
        found: Array = np.empty((4, len(s), self.joint_count))
        values: cython.double[:, :, ::1] = found
        places: cython.double[::1] = np.ascontiguousarray(s, dtype=np.float64)
        row: cython.Py_ssize_t
        for row in range(places.shape[0]):
            self.evaluate(places[row], 3, values, row)
        return found


@cython.cclass
class BlendedPath:
    """Joint positions over x along K moves, with the limits that hold there.

    x runs from `first_x` at the start of the first move to the end of the last. Each move takes as much of x
    as its `length_s`. Around the target k two moves are added, with v from 0 to 1, see `shape`. The first
    goes to its end as s = 1 - before F(1 - v), the second sets out as s = after F(v). x is the sum of what
    both have done. Outside of blends q(x) is exactly on the path of one move.
    """

    moves = cython.declare(list, visibility="readonly")
    blends = cython.declare(list, visibility="readonly")
    """`(before, after, rho)` between moves"""
    borders = cython.declare(list, visibility="readonly")
    """x at which moves begin, and where the last one ends (K + 1)"""
    window_s = cython.declare(cython.double, visibility="readonly")
    """Time (s) in which full jerk builds up full acceleration."""
    joint_count = cython.declare(cython.Py_ssize_t, visibility="readonly")
    first_x = cython.declare(cython.double, visibility="readonly")
    end_x = cython.declare(cython.double, visibility="readonly")
    edges: cython.double[::1]  # x where third derivatives jump, or may change fast, rising
    targets: cython.double[::1]  # (K + 1,)
    before: cython.double[::1]  # of blends (K + 1,), 0 where there is none
    after: cython.double[::1]
    rho: cython.double[::1]
    starts: cython.double[:, ::1]  # where moves begin, by their polynomials
    paths: list[Polynomial]
    limits: cython.double[:, :, ::1]  # (K, 3, n)
    here: cython.double[:, :, ::1]  # q, dq/dx, d2q/dx2, d3q/dx3 (4, 1, n), after `at`
    other: cython.double[:, :, ::1]

    def __init__(
        self, moves: Sequence[Any], blends: Sequence[Any], first_x: float = 0.0, window_s: float | None = None
    ) -> None:
        """`blends[k]` lies between the moves k and k + 1, at the target of the former."""
        self.moves, self.blends = list(moves), list(blends)
        count: cython.Py_ssize_t = len(self.moves)
        limits = np.array([move.limits for move in moves])
        self.limits, self.paths = limits, [move.path for move in moves]
        n: cython.Py_ssize_t = limits.shape[2]
        self.joint_count = n
        self.window_s = float((limits[:, 1] / limits[:, 2]).max()) if window_s is None else window_s
        self.before, self.after = np.zeros((2, count + 1))
        self.rho, self.targets = np.ones(count + 1), np.empty(count + 1)
        self.here, self.other = np.empty((4, 1, n)), np.empty((4, 1, n))
        self.starts = np.empty((count, n))
        self.targets[0] = first_x
        for k in range(count):
            self.targets[k + 1] = self.targets[k] + moves[k].length_s
            path: Polynomial = self.paths[k]
            path.evaluate(0.0, 0, self.here, 0)
            for i in range(n):
                self.starts[k, i] = self.here[0, 0, i]
            if k > 0:
                self.before[k], self.after[k], self.rho[k] = blends[k - 1]
        self.first_x, self.end_x = self.targets[0], self.targets[count]
        self.borders = np.asarray(self.targets).tolist()
        self._find_edges()

    @cython.cfunc
    def _find_edges(self) -> None:
        edges: list[float] = []
        for k in range(self.targets.shape[0] - 1):
            length = self.targets[k + 1] - self.targets[k]
            if self.before[k] > 0.0:
                y = self.rho[k]
                marks = [float(i) / MARKS for i in range(1, MARKS)]
                marks += [v for i in range(1, BESIDE + 1) for v in (0.2 * i / MARKS, 1.0 - 0.2 * i / MARKS)]
                marks += [v for i in (0.03, 0.1) for v in (i / MARKS, 1.0 - i / MARKS)]
                edges += [self._place(k, v) for v in marks]
                v = NEAR_EDGE * min(
                    self.before[k] * (self.targets[k] - self.targets[k - 1]), self.after[k] * length
                )
                for u in (0.0, y, 1.0 - y, 1.0):  # third derivatives jump there
                    edges += [self._place(k, u) - v, self._place(k, u) + v]
            path: Polynomial = self.paths[k]
            if path.piece_count > 1:  # it may bend much within little
                for p in range(path.piece_count):
                    first = path._borders[p]
                    for i in range(IN_PIECE + 1):
                        v = min(max(float(i) / IN_PIECE, BORDER), 1.0 - BORDER)
                        edges.append(self.targets[k] + length * (first + v * (path._borders[p + 1] - first)))
        edges.sort()
        self.edges = np.array(edges)

    @cython.cfunc
    @cython.exceptval(check=False)
    def _place(self, k: cython.Py_ssize_t, v: cython.double) -> cython.double:
        """Return x at v (0 to 1) in the blend at the target k."""
        first_x: cython.double = self.before[k] * (self.targets[k] - self.targets[k - 1])
        second_x: cython.double = self.after[k] * (self.targets[k + 1] - self.targets[k])
        done: cython.double = second_x * shape(v, self.rho[k], 0)
        return self.targets[k] + done - first_x * shape(1.0 - v, self.rho[k], 0)

    @cython.cfunc
    @cython.exceptval(check=False)
    def find(self, x: cython.double, k: cython.Py_ssize_t) -> cython.Py_ssize_t:
        """Return the move at x, searched from the move k on."""
        while k < self.targets.shape[0] - 2 and x >= self.targets[k + 1]:
            k += 1
        while k > 0 and x < self.targets[k]:
            k -= 1
        return k

    @cython.cfunc
    @cython.exceptval(check=False)
    def blend_at(self, x: cython.double, k: cython.Py_ssize_t) -> cython.Py_ssize_t:
        """Return the target in whose blend an x on the move k is, or -1."""
        length: cython.double = self.targets[k + 1] - self.targets[k]
        if self.before[k + 1] > 0.0 and x > self.targets[k + 1] - self.before[k + 1] * length:
            return k + 1
        if self.after[k] > 0.0 and x < self.targets[k] + self.after[k] * length:
            return k
        return -1

    @cython.cfunc
    @cython.exceptval(check=False)
    def limit(
        self, k: cython.Py_ssize_t, c: cython.Py_ssize_t, order: cython.int, joint: cython.Py_ssize_t
    ) -> cython.double:
        """Return the limit of velocity (order 0), acceleration or jerk on the move k, or in the blend c."""
        if c >= 0:
            return max(self.limits[c - 1, order, joint], self.limits[c, order, joint])
        return self.limits[k, order, joint]

    @cython.cfunc
    @cython.exceptval(check=False)
    def at(self, x: cython.double, k: cython.Py_ssize_t, order: cython.int) -> cython.Py_ssize_t:
        """Write q and its derivatives over x, to the order 0 or 3, to `here`, at an x on the move k.

        Return the blend it is in, or -1.
        """
        n: cython.Py_ssize_t = self.joint_count
        c: cython.Py_ssize_t = self.blend_at(x, k)
        if c < 0:
            length = self.targets[k + 1] - self.targets[k]
            path: Polynomial = self.paths[k]
            path.evaluate((x - self.targets[k]) / length, order, self.here, 0)
            if order > 0:
                v = 1.0 / length
                for i in range(n):
                    self.here[1, 0, i] *= v
                    self.here[2, 0, i] *= v * v
                    self.here[3, 0, i] *= v * v * v
            return c
        first_x = self.before[c] * (self.targets[c] - self.targets[c - 1])
        second_x = self.after[c] * (self.targets[c + 1] - self.targets[c])
        rho = self.rho[c]
        v = blend_part(x - self.targets[c], first_x, second_x, rho)
        first: Polynomial = self.paths[c - 1]
        second: Polynomial = self.paths[c]
        first.evaluate(1.0 - self.before[c] * shape(1.0 - v, rho, 0), order, self.here, 0)
        second.evaluate(self.after[c] * shape(v, rho, 0), order, self.other, 0)
        for i in range(n):
            # The second begins where the first ends, at the values of their polynomials.
            self.here[0, 0, i] += self.other[0, 0, i] - self.starts[c, i]
        if order == 0:
            return c
        a1 = shape(1.0 - v, rho, 1)
        a2 = -shape(1.0 - v, rho, 2)
        a3 = shape(1.0 - v, rho, 3)
        b1 = shape(v, rho, 1)
        b2 = shape(v, rho, 2)
        b3 = shape(v, rho, 3)
        x1 = first_x * a1 + second_x * b1
        x2 = first_x * a2 + second_x * b2
        x3 = first_x * a3 + second_x * b3
        v1 = 1.0 / x1
        v2 = -x2 * v1 * v1 * v1
        v3 = (3.0 * x2 * x2 - x1 * x3) * v1 * v1 * v1 * v1 * v1
        # s of both over x
        y1 = self.before[c]
        a3 = y1 * (a3 * v1 * v1 * v1 + 3.0 * a2 * v1 * v2 + a1 * v3)
        a2 = y1 * (a2 * v1 * v1 + a1 * v2)
        a1 = y1 * a1 * v1
        y1 = self.after[c]
        b3 = y1 * (b3 * v1 * v1 * v1 + 3.0 * b2 * v1 * v2 + b1 * v3)
        b2 = y1 * (b2 * v1 * v1 + b1 * v2)
        b1 = y1 * b1 * v1
        for i in range(n):
            y1 = self.here[1, 0, i] * a1
            y2 = self.here[2, 0, i] * a1 * a1 + self.here[1, 0, i] * a2
            y3: cython.double = self.here[3, 0, i] * a1 * a1 * a1
            y3 += 3.0 * self.here[2, 0, i] * a1 * a2 + self.here[1, 0, i] * a3
            self.here[1, 0, i] = y1 + self.other[1, 0, i] * b1
            self.here[2, 0, i] = y2 + self.other[2, 0, i] * b1 * b1 + self.other[1, 0, i] * b2
            y3 += self.other[3, 0, i] * b1 * b1 * b1
            self.here[3, 0, i] = y3 + 3.0 * self.other[2, 0, i] * b1 * b2 + self.other[1, 0, i] * b3
        return c

    def samples(self, start: cython.double) -> Array:
        """Return values of x from `start` to the end, as many as the fastest run needs."""
        found: list[float] = [self.end_x]
        for k in range(self.targets.shape[0] - 1):
            length = self.targets[k + 1] - self.targets[k]
            first = self.targets[k] + self.after[k] * length
            last = self.targets[k + 1] - self.before[k + 1] * length
            count = min(max(int((last - first) / OWN), LEAST_OWN), MOST_OWN)
            found += [first + (last - first) * p / count for p in range(count)]
        places: list[float] = [start]
        for x in sorted(found + np.asarray(self.edges).tolist()):
            if x > start + APART:
                start = x
                places.append(x)
        return np.array(places)

    def positions(self, x: cython.double[::1]) -> Array:
        """Return joint positions (m, n), in rad, at x (m,)."""
        positions: Array = np.empty((x.shape[0], self.joint_count))
        found: cython.double[:, ::1] = positions
        k: cython.Py_ssize_t = 0
        for p in range(x.shape[0]):
            k = self.find(x[p], k)
            self.at(x[p], k, 0)
            for i in range(self.joint_count):
                found[p, i] = self.here[0, 0, i]
        return positions

    def derivatives(self, x: cython.double[::1]) -> tuple[Array, Array]:
        """Return q, dq/dx, d2q/dx2, d3q/dx3 (m, 4, n) at x (m,), and the limits there (m, 3, n)."""
        derivatives: Array = np.empty((x.shape[0], 4, self.joint_count))
        limits: Array = np.empty((x.shape[0], 3, self.joint_count))
        found: cython.double[:, :, ::1] = derivatives
        limits_there: cython.double[:, :, ::1] = limits
        k: cython.Py_ssize_t = 0
        for p in range(x.shape[0]):
            k = self.find(x[p], k)
            c: cython.Py_ssize_t = self.at(x[p], k, 3)
            for i in range(self.joint_count):
                for o in range(4):
                    found[p, o, i] = self.here[o, 0, i]
                for o in range(3):
                    limits_there[p, o, i] = self.limit(k, c, o, i)
        return derivatives, limits


@cython.cfunc
@cython.exceptval(check=False)
def _room(
    derivatives: cython.double[:, :, ::1],
    limits: cython.double[:, :, ::1],
    k: cython.Py_ssize_t,
    square: cython.double,
    sign: cython.double,
) -> cython.double:
    """Return the largest d2x/dt2 (sign 1), or braking (sign -1), at a sample at this (dx/dt)^2."""
    room: cython.double = 1e12
    for i in range(derivatives.shape[2]):
        rate = derivatives[k, 1, i]
        if fabs(rate) > STILL:
            y: cython.double = derivatives[k, 2, i] * square * sign
            y = (limits[k, 1, i] - y) / rate if rate > 0.0 else (limits[k, 1, i] + y) / -rate
            room = min(room, y)
    return room


@cython.locals(b=cython.double, y=cython.double, v=cython.double)
def run(
    x: cython.double[::1],
    derivatives: cython.double[:, :, ::1],
    limits: cython.double[:, :, ::1],
    start_speed: cython.double,
    speeds: cython.double[::1],
    times: cython.double[::1],
) -> None:
    """Write speeds dx/dt and times (s), from 0 on, of the fastest run without jerk limits to rest.

    It passes samples x (m,), rising, with constant accelerations between them. `derivatives` (m, 4, n) and
    `limits` (m, 3, n) are those of `BlendedPath.derivatives`. At too high a speed it brakes as limits allow.
    """
    m: cython.Py_ssize_t = x.shape[0]
    # (dx/dt)^2 that all limits allow at a constant speed. If a joint turns back between two samples, only
    # the bend of its path accelerates it. A change of speed takes away at one what it adds at the other.
    squares: cython.double[::1] = np.empty(m)
    for k in range(m):
        b, y = 1e12, 1e-18
        for i in range(derivatives.shape[2]):
            v = limits[k, 0, i] / max(fabs(derivatives[k, 1, i]), STILL)
            b = min(b, v * v, limits[k, 1, i] / max(fabs(derivatives[k, 2, i]), STILL))
            y = max(y, fabs(derivatives[k, 3, i]) / limits[k, 2, i])
        v = cbrt(1.0 / y)
        squares[k] = min(b, v * v)
    # Backwards, the squares of speeds from which rest is reached.
    speeds[m - 1] = 0.0
    for k in range(m - 1, 0, -1):
        b = speeds[k]
        width = x[k] - x[k - 1]
        y = b + 2.0 * width * _room(derivatives, limits, k, b, -1.0)
        if y < 0.0:
            # Not even from rest at the sample before is that to be reached: slower here, not at rest there.
            while y < b:
                b *= 0.5
                y = b + 2.0 * width * _room(derivatives, limits, k, b, -1.0)
            speeds[k] = b
        speeds[k - 1] = min(squares[k - 1], y)
    b = start_speed * start_speed
    for k in range(m - 1):
        speeds[k] = b
        width = x[k + 1] - x[k]
        y = min(b + 2.0 * width * _room(derivatives, limits, k, b, 1.0), speeds[k + 1])
        if y == speeds[k + 1] and b > squares[k]:
            # Too fast already: no more braking than a joint can do at the least.
            y = max(y, b - 2.0 * width * _room(derivatives, limits, k, 0.0, -1.0))
        b = max(0.0, y)
    speeds[m - 1] = b if b > 1e-18 else 0.0
    times[0] = 0.0
    for k in range(m):
        speeds[k] = sqrt(speeds[k])
        if k > 0:
            y = max(SLOWEST, speeds[k] + speeds[k - 1])
            times[k] = times[k - 1] + 2.0 * (x[k] - x[k - 1]) / y


@cython.cclass
class SpeedProfile:
    """Speed profile of a path, found by an interior-point method.

    Call `sample` until done, write a guess to `coefficients`, call `begin`, and `advance` until done.

    `factor` (samples, 6, n) is q' of velocity; q'', q'/2 of acceleration; q''', 3/2 q'', q'/2 of jerk, over
    their limits. A group is rows with the same bound: velocity and acceleration of a segment, or jerk at a
    place. A row has a slack s and a multiplier z for either sign.
    """

    keeps_limits = cython.declare(cython.bint, visibility="readonly")
    fixed = cython.declare(cython.Py_ssize_t, visibility="readonly")
    """first coefficients that stay"""
    path: BlendedPath
    x: cython.double[::1]  # (N + 3,)
    c: cython.double[::1]
    joints: cython.Py_ssize_t
    count: cython.Py_ssize_t  # N
    kept: cython.Py_ssize_t  # first segments whose old profile is known
    # Samples
    at: cython.Py_ssize_t  # next segment to sample or to check
    move: cython.Py_ssize_t
    blend: cython.Py_ssize_t
    sampled_x: cython.double  # last x at which the path was evaluated
    first: cython.Py_ssize_t[::1]  # sample of each segment
    edge: cython.Py_ssize_t[::1]  # first edge of the path in each segment
    u: cython.double[::1]  # where samples are in their segments, 0 to 1
    factor: cython.double[:, :, ::1]
    per_limit: cython.double[:, ::1]
    even: cython.double[::1]  # b of each segment at a constant rate
    b: cython.double  # and its derivatives and root at a place, by `_rate`
    b1: cython.double
    b2: cython.double
    rate: cython.double
    # Rows
    groups: cython.Py_ssize_t
    group: cython.Py_ssize_t[:, ::1]  # segment, first row
    weight: cython.double[:, ::1]  # of c in b, and the bound
    joint: cython.Py_ssize_t[::1]  # of each row
    g: cython.double[:, ::1]
    s: cython.double[:, ::1]
    z: cython.double[:, ::1]
    ds: cython.double[:, ::1]
    dz: cython.double[:, ::1]
    # Steps
    band: cython.double[:, ::1]
    right: cython.double[::1]
    step: cython.double[::1]
    solving: cython.bint
    rounds: cython.Py_ssize_t
    steps: cython.Py_ssize_t
    gap: cython.double
    far: cython.double  # part of the first distance from limits that is left
    sides: cython.double
    duration: cython.double
    enough: cython.double
    excess: cython.double  # b may be divided by it to keep limits

    def __init__(self, path: BlendedPath, x: cython.double[::1], old: cython.double[::1], kept: int) -> None:
        """`old` are no coefficients, or those of the first `kept` segments, with the same x; two stay."""
        n: cython.Py_ssize_t = x.shape[0] - 3
        self.path, self.x, self.count, self.joints, self.kept = path, x, n, path.joint_count, kept
        self.c, self.fixed = np.ones(n + 2), 2 if old.shape[0] else 0
        self.c[: old.shape[0]] = old
        self.first, self.edge = np.zeros((2, n + 1), dtype=np.intp)
        samples = self._count_samples()
        self.u, self.factor = np.empty(samples), np.empty((samples, 6, self.joints))
        self.even, self.per_limit = np.empty(n), np.empty((3, self.joints))
        groups = (3 + 3 * ROUNDS) * n + 1
        rows = (11 + 3 * ROUNDS) * n + 3
        self.group, self.weight = np.zeros((groups, 2), dtype=np.intp), np.zeros((groups, 4))
        self.joint, self.g = np.empty(rows, dtype=np.intp), np.empty((rows, 3))
        self.s, self.z, self.ds, self.dz = np.empty((4, rows, 2))
        self.band, self.right, self.step = np.empty((n + 2, 3)), np.empty(n + 2), np.empty(n + 2)
        self.at = self.groups = self.move = 0
        self.blend = -2

    @cython.cfunc
    def _count_samples(self) -> cython.Py_ssize_t:
        """Write the first sample and the first edge of each segment. Return the number of samples."""
        path: BlendedPath = self.path
        own: Polynomial
        x1: cython.double = spline(self.x, 0, 0.0)
        move: cython.Py_ssize_t = 0
        e: cython.Py_ssize_t = 0
        while e < path.edges.shape[0] and path.edges[e] < x1:
            e += 1
        self.edge[0] = e
        for k in range(self.count):
            x0, x1, n = x1, spline(self.x, k, 1.0), SMOOTH
            move = path.find(x0, move)
            own = path.paths[move]
            while e < path.edges.shape[0] and path.edges[e] < x1:
                e += 1
            self.edge[k + 1] = e
            marks = e - self.edge[k]
            if marks > 0 or k < ENDS or k >= self.count - ENDS or path.blend_at(x0, move) >= 0:
                n = DENSE
            elif x1 > x0 and not own.straight:
                n += cython.cast(cython.Py_ssize_t, min((x1 - x0) / LONG, 1.0 * MOST))
            self.first[k + 1] = self.first[k] + n + marks
        return self.first[self.count]

    @property
    def coefficients(self) -> np.ndarray:
        return np.asarray(self.c)

    @property
    def even_rates(self) -> np.ndarray:
        """b of each segment at which a constant rate would pass it."""
        return np.asarray(self.even)

    def sample(self, budget: cython.Py_ssize_t) -> bool:
        """Sample the path and write rows until a budget (see SAMPLE_COST) is spent; True when all is done."""
        path: BlendedPath = self.path
        self.sampled_x = -1.0
        while self.at < self.count and budget > 0:
            k = self.at
            p, e = self.first[k], self.edge[k]
            n = self.first[k + 1] - p - (self.edge[k + 1] - e)
            for i in range(n):
                self._sample(k, p + i, cython.cast(cython.double, i) / (n - 1))
            for i in range(self.edge[k + 1] - e):
                self._sample(k, p + n + i, part_at(self.x, k, path.edges[e + i]))
            self._write_rows(k, n)
            budget -= SAMPLE_COST * (self.first[k + 1] - p)
            self.at += 1
        return bool(self.at == self.count)

    @cython.cfunc
    def _sample(self, k: cython.Py_ssize_t, p: cython.Py_ssize_t, u: cython.double) -> cython.void:
        """Write the sample p at u of a segment."""
        path: BlendedPath = self.path
        x: cython.double[::1] = self.x
        f: cython.double[:, :, ::1] = self.factor
        x3: cython.double = x[k + 3] - 3.0 * x[k + 2] + 3.0 * x[k + 1] - x[k]
        x2: cython.double = x[k + 2] - 2.0 * x[k + 1] + x[k] + u * x3
        x1: cython.double = 0.5 * (x[k + 2] - x[k]) + u * (x2 - 0.5 * u * x3)
        at_x: cython.double = min(max(spline(x, k, u), path.first_x), path.end_x)
        if at_x != self.sampled_x:
            move = path.find(at_x, self.move)
            blend = path.at(at_x, move, 3)
            if move != self.move or blend != self.blend:
                y = 1.0
                for o in range(3):
                    y *= _UNIT_S
                    for i in range(self.joints):
                        self.per_limit[o, i] = 1.0 / (y * path.limit(move, blend, o, i))
            self.move, self.blend, self.sampled_x = move, blend, at_x
        self.u[p] = u
        self._rate(k, u)
        for i in range(self.joints):
            q1 = path.here[1, 0, i] * x1
            q2 = path.here[2, 0, i] * x1 * x1 + path.here[1, 0, i] * x2
            q3 = path.here[3, 0, i] * x1 * x1 * x1 + (
                3.0 * path.here[2, 0, i] * x1 * x2 + path.here[1, 0, i] * x3
            )
            f[p, 0, i] = q1 * self.per_limit[0, i]
            f[p, 1, i], f[p, 2, i] = q2 * self.per_limit[1, i], 0.5 * q1 * self.per_limit[1, i]
            f[p, 3, i], f[p, 4, i] = q3 * self.per_limit[2, i], 1.5 * q2 * self.per_limit[2, i]
            f[p, 5, i] = 0.5 * q1 * self.per_limit[2, i]
            if k < self.kept:
                # There may be no other profile than the old one: its loads are allowed up to the tolerance.
                for o in range(3):
                    y = max(min(self._load(p, i, o), TOLERANCE), KEPT)
                    for e in range(o * (o + 1) // 2, (o + 1) * (o + 2) // 2):
                        f[p, e, i] *= KEPT / y

    @cython.cfunc
    @cython.inline
    @cython.exceptval(check=False)
    def _rate(self, k: cython.Py_ssize_t, u: cython.double) -> cython.void:
        """Write b, its derivatives and its root at u of a segment."""
        self.b2 = self.c[k] - 2.0 * self.c[k + 1] + self.c[k + 2]
        self.b1 = self.c[k + 1] - self.c[k] + u * self.b2
        self.b = 0.5 * (self.c[k] + self.c[k + 1]) + u * (self.b1 - 0.5 * u * self.b2)
        self.rate = sqrt(max(self.b, 0.0))

    @cython.cfunc
    @cython.inline
    @cython.exceptval(check=False)
    def _load(self, p: cython.Py_ssize_t, i: cython.Py_ssize_t, order: cython.int) -> cython.double:
        """Return velocity (order 0), acceleration or jerk over its limit at a sample, after `_rate` there."""
        f: cython.double[:, :, ::1] = self.factor
        if order == 0:
            return self.rate * fabs(f[p, 0, i])
        if order == 1:
            return fabs(f[p, 1, i] * self.b + f[p, 2, i] * self.b1)
        return self.rate * fabs(f[p, 3, i] * self.b + f[p, 4, i] * self.b1 + f[p, 5, i] * self.b2)

    @cython.cfunc
    def _write_rows(self, k: cython.Py_ssize_t, n: cython.Py_ssize_t) -> cython.void:
        """Write the constant speed of a segment of n even samples, and its rows.

        These are velocity and acceleration at the beginning, jerk at both ends, and velocity inside."""
        square: cython.double = 1e-6
        cube: cython.double = 1e-18
        p: cython.Py_ssize_t = self.first[k]
        f: cython.double[:, :, ::1] = self.factor
        for o in range(p, self.first[k + 1]):
            for i in range(self.joints):
                square = max(square, f[o, 0, i] * f[o, 0, i], fabs(f[o, 1, i]))
                cube = max(cube, fabs(f[o, 3, i]))
        cube = cbrt(cube)
        self.even[k] = 1.0 / max(square, cube * cube)
        self._open(k, -1.0)
        if k > 0 or self.fixed == 0:
            self._choose(p, 0)
            self._choose(p, 1)
        self._choose(p + n // 2, 0)
        if k == self.count - 1:
            self._choose(p + n - 1, 0)
            self._choose(p + n - 1, 1)
        for e in range(2):
            self._open(k, e)
            self._choose(p + e * (n - 1), 2)

    @cython.cfunc
    def _choose(self, p: cython.Py_ssize_t, order: cython.int) -> cython.void:
        """Add the rows of the joints with the largest factors at a sample. The check adds others."""
        f: cython.double[:, :, ::1] = self.factor
        first: cython.Py_ssize_t = self.group[self.groups, 1]
        best: cython.Py_ssize_t
        for e in range(order * (order + 1) // 2, (order + 1) * (order + 2) // 2):
            best = 0
            for i in range(1, self.joints):
                if fabs(f[p, e, i]) > fabs(f[p, e, best]):
                    best = i
            for r in range(first, self.group[self.groups, 1]):
                if self.joint[r] == best:
                    break
            else:
                self._add(p, order, best, STRICTER if order == 0 else 1.0)

    @cython.cfunc
    def _open(self, k: cython.Py_ssize_t, u: cython.double) -> cython.void:
        """Begin a group of rows of a segment: jerk at u, or velocity and acceleration (u < 0)."""
        i: cython.Py_ssize_t = self.groups
        self.group[i, 0], self.group[i + 1, 1], self.groups = k, self.group[i, 1], i + 1
        if u >= 0.0:
            self.weight[i, 0], self.weight[i, 1] = 0.5 - u + 0.5 * u * u, 0.5 + u - u * u
            self.weight[i, 2] = 0.5 * u * u

    @cython.cfunc
    def _add(
        self,
        p: cython.Py_ssize_t,
        order: cython.int,
        i: cython.Py_ssize_t,
        scale: cython.double,
    ) -> cython.void:
        """Add the row of a joint at a sample, times a scale, to the last group."""
        f: cython.double[:, :, ::1] = self.factor
        r: cython.Py_ssize_t = self.group[self.groups, 1]
        u: cython.double = self.u[p]
        b: cython.double = scale * (f[p, 0, i] * f[p, 0, i] if order == 0 else f[p, 2 * order - 1, i])
        b1: cython.double = scale * f[p, 2 * order, i] if order > 0 else 0.0
        b2: cython.double = scale * f[p, 5, i] if order == 2 else 0.0
        self.g[r, 0] = b * (0.5 - u + 0.5 * u * u) + b1 * (u - 1.0) + b2
        self.g[r, 1] = b * (0.5 + u - u * u) + b1 * (1.0 - 2.0 * u) - 2.0 * b2
        self.g[r, 2] = b * 0.5 * u * u + b1 * u + b2
        self.joint[r], self.group[self.groups, 1] = i, r + 1

    def begin(self, enough: cython.double) -> None:
        """Begin to solve from c, within limits or not; a round ends at a duality gap of `enough` times T."""
        self.enough, self.rounds = enough, 0
        self._restart(COLD_GAP, COLD_SLACK)

    def advance(self, budget: cython.Py_ssize_t) -> bool:
        """Work until the budget, in interior-point steps of a segment, is spent; True when all is done."""
        while self.rounds <= ROUNDS and budget > 0:
            if self.solving:
                budget -= self.count
                self._newton()
                continue
            while self.at < self.count and budget > 0:
                budget -= self._check(self.at)
                self.at += 1
            if self.at == self.count:
                self.rounds += 1
                if self.excess > 1.0 and self.rounds <= ROUNDS:
                    self._restart(WARM_GAP, WARM_SLACK)
                else:
                    self._end()
        return bool(self.rounds > ROUNDS)

    @cython.cfunc
    def _end(self) -> cython.void:
        """Take the profile as it is; one from rest to rest is slowed down by the excess."""
        self.rounds = ROUNDS + 1
        self.keeps_limits = self.excess < ACCEPTED or self.fixed == 0
        if self.fixed == 0:
            for k in range(self.count + 2):
                self.c[k] /= self.excess

    @cython.cfunc
    def _check(self, k: cython.Py_ssize_t) -> cython.Py_ssize_t:
        """Add a row for the sample of a segment that exceeds a limit most, one for each order.

        Raise `excess` to what b has to be divided by. Return the work done.
        """
        place = joint = 0
        for o in range(3):
            worst = VELOCITY if o == 0 else TOLERANCE
            for p in range(self.first[k], self.first[k + 1]):
                self._rate(k, self.u[p])
                for i in range(self.joints):
                    y = self._load(p, i, o)
                    if y > worst:
                        worst, place, joint = y, p, i
            y = worst / (VELOCITY if o == 0 else TOLERANCE)
            if y > 1.0:
                self.excess = max(self.excess, y if o == 1 else y * y if o == 0 else cbrt(y * y))
                self._open(k, self.u[place] if o == 2 else -1.0)
                self._add(place, o, joint, STRICTER * (STRICTER if o == 0 else 1.0))
        return (self.first[k + 1] - self.first[k]) // 2

    @cython.cfunc
    @cython.locals(y=cython.double)
    def _restart(self, gap: cython.double, slack: cython.double) -> cython.void:
        """Write the first slacks and multipliers of a round, with the same product for all rows."""
        c: cython.double[::1] = self.c
        self.solving, self.steps = True, 0
        self.far = self.duration = 0.0
        for k in range(self.count):
            self.duration += 1.0 / sqrt((c[k] + 6.0 * c[k + 1] + c[k + 2]) * 0.125)
        mu = gap * self.duration / self.count
        self.sides = 2.0 * self.group[self.groups, 1]
        self.gap = mu * self.sides
        for i in range(self.groups):
            k = self.group[i, 0]
            w = self._bound(i, k)
            for r in range(self.group[i, 1], self.group[i + 1, 1]):
                y = self.g[r, 0] * c[k] + self.g[r, 1] * c[k + 1] + self.g[r, 2] * c[k + 2]
                for f in range(2):
                    self.s[r, f] = max(w - y, slack * w)
                    self.z[r, f] = mu / self.s[r, f]
                    self.far = max(self.far, self.s[r, f] - w + y)
                    y = -y

    @cython.cfunc
    @cython.inline
    @cython.exceptval(check=False)
    def _bound(self, i: cython.Py_ssize_t, k: cython.Py_ssize_t) -> cython.double:
        """Write and return the bound of the rows of a group."""
        b: cython.double = self.weight[i, 0] * self.c[k]
        b += self.weight[i, 1] * self.c[k + 1] + self.weight[i, 2] * self.c[k + 2]
        self.weight[i, 3] = 1.0 / sqrt(b) if b > 0.0 else 1.0
        return self.weight[i, 3]

    @cython.cfunc
    def _newton(self) -> cython.void:
        """Take one interior-point step. Go on to the check when rows hold and little is left to gain."""
        before: cython.double = self.duration
        mu: cython.double = max(CENTERING * self.gap, 0.5 * self.enough * self.duration) / self.sides
        self._assemble(mu)
        self.steps += 1
        if self.steps > STEPS or not self._solve():
            self.solving, self.at, self.excess, self.rounds = False, 0, 1.0, ROUNDS
            return
        self._move(mu)
        if (
            self.gap <= self.enough * self.duration
            and self.far < 1e-4
            and before - self.duration < 0.02 * before
        ):
            self.solving, self.at, self.excess = False, 0, 1.0

    @cython.cfunc
    @cython.exceptval(check=False)
    @cython.locals(pull=cython.double, rest=cython.double)
    def _assemble(self, mu: cython.double) -> cython.void:
        """Write the equations of a step, a band matrix and its right side, from the duration and all rows."""
        c: cython.double[::1] = self.c
        g: cython.double[:, ::1] = self.g
        s: cython.double[:, ::1] = self.s
        z: cython.double[:, ::1] = self.z
        ds: cython.double[:, ::1] = self.ds
        band: cython.double[:, ::1] = self.band
        right: cython.double[::1] = self.right
        k: cython.Py_ssize_t
        for i in range(self.count + 2):
            band[i, 0] = HELD if i < self.fixed else 0.0
            band[i, 1] = band[i, 2] = right[i] = 0.0
        for e in range(2):  # the outermost coefficients take next to no time: they go with those beside them
            k = e * self.count
            _add_square(cython.address(band[k, 0]), TIE, 1.0, -1.0, 0.0)
            right[k] += TIE * (c[k + 1] - c[k])
            right[k + 1] -= TIE * (c[k + 1] - c[k])
        self.duration = 0.0
        for k in range(self.count):
            y = 1.0 / ((c[k] + 6.0 * c[k + 1] + c[k + 2]) * 0.125)
            t = sqrt(y)
            self.duration += t
            y *= t
            right[k] += 0.0625 * y
            right[k + 1] += 0.375 * y
            right[k + 2] += 0.0625 * y
            _add_square(cython.address(band[k, 0]), 0.75 * t * t * y, 0.125, 0.75, 0.125)
        for i in range(self.groups):
            k = self.group[i, 0]
            w = self._bound(i, k)
            # The bound's gradient, the sum of both sides' pulls, and what is left of both sides' curvature.
            y = -0.5 * w * w * w
            v0, v1, v2 = y * self.weight[i, 0], y * self.weight[i, 1], y * self.weight[i, 2]
            pull = rest = 0.0
            for r in range(self.group[i, 1], self.group[i + 1, 1]):
                y = g[r, 0] * c[k] + g[r, 1] * c[k + 1] + g[r, 2] * c[k + 2]
                s[r, 0], s[r, 1] = max(s[r, 0], w - y), max(s[r, 1], w + y)
                ds[r, 0], ds[r, 1] = w - y - s[r, 0], w + y - s[r, 1]
                s0, s1 = 1.0 / s[r, 0], 1.0 / s[r, 1]
                h0, h1 = z[r, 0] * s0, z[r, 1] * s1
                p0, p1 = mu * s0 - h0 * ds[r, 0], mu * s1 - h1 * ds[r, 1]
                pull += p0 + p1
                right[k] += (p1 - p0) * g[r, 0]
                right[k + 1] += (p1 - p0) * g[r, 1]
                right[k + 2] += (p1 - p0) * g[r, 2]
                # h0 (v - g)(v - g)' + h1 (v + g)(v + g)' = h (g + e v)(g + e v)' + (h - e e h) v v'
                h = h0 + h1
                e0 = (h1 - h0) / h
                rest += h * (1.0 - e0 * e0)
                _add_square(
                    cython.address(band[k, 0]), h, g[r, 0] + e0 * v0, g[r, 1] + e0 * v1, g[r, 2] + e0 * v2
                )
            right[k] += pull * v0
            right[k + 1] += pull * v1
            right[k + 2] += pull * v2
            _add_square(cython.address(band[k, 0]), rest, v0, v1, v2)

    @cython.cfunc
    @cython.exceptval(check=False)
    @cython.locals(d=cython.double, e=cython.double, f=cython.double)
    def _solve(self) -> cython.bint:
        """Solve for the step by L D L' of the band matrix. Return False if it is not positive definite."""
        n: cython.Py_ssize_t = self.count + 2
        band: cython.double[:, ::1] = self.band
        step: cython.double[::1] = self.step
        for i in range(n):
            if not band[i, 0] > 0.0:
                return False
            d = 1.0 / band[i, 0]
            e, f = band[i, 1] * d, band[i, 2] * d
            if i + 1 < n:
                band[i + 1, 0] -= e * band[i, 1]
                band[i + 1, 1] -= e * band[i, 2]
            if i + 2 < n:
                band[i + 2, 0] -= f * band[i, 2]
            band[i, 0], band[i, 1], band[i, 2] = d, e, f
            step[i] = self.right[i]
            if i >= 1:
                step[i] -= band[i - 1, 1] * step[i - 1]
            if i >= 2:
                step[i] -= band[i - 2, 2] * step[i - 2]
        for i in range(n - 1, -1, -1):
            d = step[i] * band[i, 0]
            if i + 1 < n:
                d -= band[i, 1] * step[i + 1]
            if i + 2 < n:
                d -= band[i, 2] * step[i + 2]
            step[i] = d
        return True

    @cython.cfunc
    @cython.exceptval(check=False)
    @cython.locals(w=cython.double, y=cython.double, a=cython.double, b=cython.double)
    def _move(self, mu: cython.double) -> cython.void:
        """Move c, slacks and multipliers by as much of the step as keeps them positive."""
        d: cython.double[::1] = self.step
        g: cython.double[:, ::1] = self.g
        s: cython.double[:, ::1] = self.s
        z: cython.double[:, ::1] = self.z
        ds: cython.double[:, ::1] = self.ds
        dz: cython.double[:, ::1] = self.dz
        weight: cython.double[:, ::1] = self.weight
        k: cython.Py_ssize_t
        a = b = 1.0  # so much of the step
        for i in range(self.groups):
            k = self.group[i, 0]
            w = weight[i, 0] * d[k] + weight[i, 1] * d[k + 1] + weight[i, 2] * d[k + 2]
            w *= -0.5 * weight[i, 3] * weight[i, 3] * weight[i, 3]
            for r in range(self.group[i, 1], self.group[i + 1, 1]):
                y = g[r, 0] * d[k] + g[r, 1] * d[k + 1] + g[r, 2] * d[k + 2]
                for f in range(2):
                    ds[r, f] += w - y
                    dz[r, f] = (mu - z[r, f] * ds[r, f]) / s[r, f] - z[r, f]
                    if -a * ds[r, f] > NEAR * s[r, f]:
                        a = -NEAR * s[r, f] / ds[r, f]
                    if -b * dz[r, f] > NEAR * z[r, f]:
                        b = -NEAR * z[r, f] / dz[r, f]
                    y = -y
        for i in range(self.count + 2):
            if -a * d[i] > 0.8 * self.c[i]:
                a = -0.8 * self.c[i] / d[i]
        for i in range(self.count + 2):
            self.c[i] += a * d[i]
        self.gap = 0.0
        for r in range(self.group[self.groups, 1]):
            for f in range(2):
                s[r, f] += a * ds[r, f]
                z[r, f] += b * dz[r, f]
                self.gap += s[r, f] * z[r, f]
        self.far *= 1.0 - a


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _add_square(
    at: cython.p_double, h: cython.double, f0: cython.double, f1: cython.double, f2: cython.double
) -> cython.void:
    """Add h f f' to a band matrix at a diagonal element."""
    at[0] += h * f0 * f0
    at[1] += h * f0 * f1
    at[2] += h * f0 * f2
    at[3] += h * f1 * f1
    at[4] += h * f1 * f2
    at[6] += h * f2 * f2

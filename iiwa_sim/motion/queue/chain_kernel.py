"""Where a chain of moves goes, in loops; compiled by Cython.

x runs along a chain: the move k lies between `targets[k]` and `targets[k + 1]`, and goes evenly with its
own s. Round the target k the moves before and behind it are added: with v from 0 to 1 the first goes to
its end as s = 1 - before F(1 - v) while the second sets out as s = after F(v) (`shapes_kernel.shape`);
and x is what both have done. So outside a corner a chain is exactly on the path of
one move.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from typing import Any

import cython
import numpy as np

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.path.piecewise_kernel import Polynomial
    from cython.cimports.iiwa_sim.motion.queue.shapes_kernel import corner_part, shape
else:
    from iiwa_sim.motion.path.piecewise_kernel import Polynomial
    from iiwa_sim.motion.queue.shapes_kernel import corner_part, shape

# Distance of samples in x outside of corners: some milliseconds at full speed.
OWN = cython.declare(cython.double, 0.004)
LEAST_OWN = cython.declare(cython.Py_ssize_t, 24)
MOST_OWN = cython.declare(cython.Py_ssize_t, 96)
IN_CORNER = cython.declare(cython.Py_ssize_t, 16)
IN_PIECE = cython.declare(cython.Py_ssize_t, 16)
APART = cython.declare(cython.double, 1e-9)
# The sample beside the end of a piece is so far from it, as a part of the piece.
BORDER = cython.declare(cython.double, 1e-8)
# A corner is looked at in so many even parts, since much may happen in it at once,
MARKS = cython.declare(cython.Py_ssize_t, 10)
# with so many more samples near each of its ends.
BESIDE = cython.declare(cython.Py_ssize_t, 4)
# The sample beside an edge of a corner is so far from it, as a part of the corner's shorter side.
NEAR = cython.declare(cython.double, 1e-5)


@cython.cclass
class JointPath:
    """Joint positions (rad) over x, their derivatives, and the limits that hold there, of K moves."""

    def __init__(
        self,
        targets: cython.double[::1],
        before: cython.double[::1],
        after: cython.double[::1],
        rho: cython.double[::1],
        paths: list[Polynomial],
        limits: cython.double[:, :, ::1],
    ) -> None:
        """`targets` (K + 1,); `before`, `after` and `rho` (K + 1,) of the corners, 0 where there is none;
        the path of each move; `limits` (K, 3, n) of velocity, acceleration and jerk."""
        n: cython.Py_ssize_t = limits.shape[2]
        count: cython.Py_ssize_t = targets.shape[0] - 1
        self.targets, self.before, self.after, self.rho = targets, before, after, rho
        self.paths, self.limits = paths, limits
        self.joint_count = n
        self.first_x, self.end_x = targets[0], targets[count]
        self.here, self.other = np.empty((4, 1, n)), np.empty((4, 1, n))
        self.heights = np.empty(count + 1)
        self.starts = np.empty((count, n))
        edges: list[float] = []
        marks: list[float]
        found: list[float]
        for k in range(count):
            path: Polynomial = paths[k]
            path.place(0.0, self.here, 0)
            for i in range(n):
                self.starts[k, i] = self.here[0, 0, i]
            y = rho[k]
            self.heights[k] = 1.0 / (y * (3.0 - 3.0 * y + y * y))
            if k > 0 and before[k] > 0.0:
                length = before[k] * (targets[k] - targets[k - 1])
                next_length = after[k] * (targets[k + 1] - targets[k])
                y = rho[k]
                marks = [float(i) / MARKS for i in range(1, MARKS)]
                marks += [v for i in range(1, BESIDE + 1) for v in (0.2 * i / MARKS, 1.0 - 0.2 * i / MARKS)]
                marks += [0.1 / MARKS, 1.0 - 0.1 / MARKS]
                found = [self._place(k, v) for v in marks]
                length = NEAR * min(length, next_length)
                for v in (0.0, y, 1.0 - y, 1.0):
                    # There third derivatives jump.
                    found += [self._place(k, v) - length, self._place(k, v) + length]
                edges += found
            if path.piece_count > 1:
                # Where a path is made of pieces it may bend much within little; third derivatives may jump.
                length = targets[k + 1] - targets[k]
                for p in range(path.piece_count):
                    for i in range(IN_PIECE + 1):
                        v = min(max(float(i) / IN_PIECE, BORDER), 1.0 - BORDER)
                        edges.append(targets[k] + length * path.inside(p, v))
        edges.sort()
        self.edges = np.array(edges)

    @cython.cfunc
    @cython.exceptval(check=False)
    def _place(self, c: cython.Py_ssize_t, v: cython.double) -> cython.double:
        """x at v (0 to 1) in the corner at the target c."""
        first_x: cython.double = self.before[c] * (self.targets[c] - self.targets[c - 1])
        second_x: cython.double = self.after[c] * (self.targets[c + 1] - self.targets[c])
        height: cython.double = self.heights[c]
        done: cython.double = second_x * shape(v, self.rho[c], height, 0)
        return self.targets[c] + done - first_x * shape(1.0 - v, self.rho[c], height, 0)

    @cython.cfunc
    @cython.exceptval(check=False)
    def find(self, x: cython.double, k: cython.Py_ssize_t) -> cython.Py_ssize_t:
        """The move on which an x is, looked for from the move k on."""
        while k < self.targets.shape[0] - 2 and x >= self.targets[k + 1]:
            k += 1
        while k > 0 and x < self.targets[k]:
            k -= 1
        return k

    @cython.cfunc
    @cython.exceptval(check=False)
    def corner_at(self, x: cython.double, k: cython.Py_ssize_t) -> cython.Py_ssize_t:
        """The target in whose corner an x on the move k is, or -1."""
        length: cython.double = self.targets[k + 1] - self.targets[k]
        if self.before[k + 1] > 0.0 and x > self.targets[k + 1] - self.before[k + 1] * length:
            return k + 1
        if self.after[k] > 0.0 and x < self.targets[k] + self.after[k] * length:
            return k
        return -1

    @cython.cfunc
    @cython.exceptval(check=False)
    def is_straight(self, k: cython.Py_ssize_t) -> cython.bint:
        """Whether the joints go straight on the move k."""
        path: Polynomial = self.paths[k]
        return path.straight

    @cython.cfunc
    @cython.exceptval(check=False)
    def limit(
        self, k: cython.Py_ssize_t, c: cython.Py_ssize_t, order: cython.int, joint: cython.Py_ssize_t
    ) -> cython.double:
        """Limit of velocity (order 0), acceleration or jerk on the move k; in the corner c, if that is one,
        the larger of its two moves'."""
        most: cython.double = self.limits[k, order, joint]
        if c >= 0:
            most = max(self.limits[c - 1, order, joint], self.limits[c, order, joint])
        return most

    @cython.cfunc
    @cython.exceptval(check=False)
    def at(self, x: cython.double, k: cython.Py_ssize_t, order: cython.int) -> cython.Py_ssize_t:
        """Write q and its derivatives over x, to the order 0 or 3, to `here`, at an x on the move k. Gives
        the corner it is in, or -1."""
        n: cython.Py_ssize_t = self.joint_count
        c: cython.Py_ssize_t = self.corner_at(x, k)
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
        height = self.heights[c]
        v = corner_part(x - self.targets[c], first_x, second_x, rho, height)
        first: Polynomial = self.paths[c - 1]
        second: Polynomial = self.paths[c]
        first.evaluate(1.0 - self.before[c] * shape(1.0 - v, rho, height, 0), order, self.here, 0)
        second.evaluate(self.after[c] * shape(v, rho, height, 0), order, self.other, 0)
        for i in range(n):
            # The second begins where the first ends, at the values of their polynomials.
            self.here[0, 0, i] += self.other[0, 0, i] - self.starts[c, i]
        if order == 0:
            return c
        a1 = shape(1.0 - v, rho, height, 1)
        a2 = -shape(1.0 - v, rho, height, 2)
        a3 = shape(1.0 - v, rho, height, 3)
        b1 = shape(v, rho, height, 1)
        b2 = shape(v, rho, height, 2)
        b3 = shape(v, rho, height, 3)
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
            y3 = (
                self.here[3, 0, i] * a1 * a1 * a1
                + 3.0 * self.here[2, 0, i] * a1 * a2
                + self.here[1, 0, i] * a3
            )
            self.here[1, 0, i] = y1 + self.other[1, 0, i] * b1
            self.here[2, 0, i] = y2 + self.other[2, 0, i] * b1 * b1 + self.other[1, 0, i] * b2
            self.here[3, 0, i] = (
                y3
                + self.other[3, 0, i] * b1 * b1 * b1
                + 3.0 * self.other[2, 0, i] * b1 * b2
                + self.other[1, 0, i] * b3
            )
        return c

    def samples(self, start: cython.double) -> Any:
        """Values of x from `start` to the end, as many as the fastest run needs: in corners, outside of them
        about every OWN of x, and more where a path is made of short pieces: there it bends much within
        little."""
        count: cython.Py_ssize_t
        found: list[float] = [start]
        for k in range(self.targets.shape[0] - 1):
            length = self.targets[k + 1] - self.targets[k]
            first = self.targets[k] + self.after[k] * length
            last = self.targets[k + 1] - self.before[k + 1] * length
            own: list[float] = []
            if last > start:
                count = min(max(int((last - first) / OWN), LEAST_OWN), MOST_OWN)
                own = [first + (last - first) * p / count for p in range(count)]
                path: Polynomial = self.paths[k]
                if path.piece_count > 1:
                    for p in range(path.piece_count):
                        for i in range(IN_PIECE):
                            s = self.targets[k] + length * path.inside(p, float(i) / IN_PIECE)
                            if first < s < last:
                                own.append(s)
                    own.sort()
            if k > 0 and self.after[k] > 0.0:
                last = self.targets[k] - self.before[k] * (self.targets[k] - self.targets[k - 1])
                own = [last + (first - last) * p / IN_CORNER for p in range(IN_CORNER)] + own
            found += [s for s in own if s > start + APART]
        found.append(self.end_x)
        return np.array(found)

    def derivatives(
        self,
        x: cython.double[::1],
        found: cython.double[:, :, ::1],
        limits_there: cython.double[:, :, ::1],
    ) -> None:
        """Write q, dq/dx, d2q/dx2, d3q/dx3 (m, 4, n) at rising x (m,), and the limits that hold there (m, 3,
        n)."""
        k: cython.Py_ssize_t = 0
        c: cython.Py_ssize_t = -1
        for p in range(x.shape[0]):
            move, corner = k, c
            k = self.find(x[p], k)
            c = self.at(x[p], k, 3)
            alike = p > 0 and k == move and c == corner
            for o in range(4):
                for i in range(self.joint_count):
                    found[p, o, i] = self.here[o, 0, i]
            for o in range(3):
                for i in range(self.joint_count):
                    limits_there[p, o, i] = limits_there[p - 1, o, i] if alike else self.limit(k, c, o, i)

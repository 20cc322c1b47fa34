"""Parts that lie on others go with these: how that moves the places at which they meet what is beside.

The way of a part is its own: as seen from what carries it, which goes and turns about its own middle first.
So a place of it goes by its own way and by those of all that carry it, and what presses there presses on all
of them: what carries a part feels what that runs into. The part then slides back on it by friction.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

from typing import Any

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.balance_kernel import Balance
    from cython.cimports.iiwa_sim.robot.trigonometry_kernel import cosine, sine
else:
    from iiwa_sim.contact.balance_kernel import Balance
    from iiwa_sim.robot.trigonometry_kernel import cosine, sine


_SPHERE = cython.declare(cython.int, 2)
_CYLINDER = cython.declare(cython.int, 3)
# Of half an edge: points there have the moments of a face.
_THIRD = cython.declare(cython.double, 0.5773502691896258)
# A ball touches on a disc of radius a = sqrt(R d), which presses more in its middle (Hertz): where it turns
# on that, friction takes 3 pi / 16 mu N a (K. L. Johnson, Contact Mechanics, 1985, sections 4.2 and 7.4);
# along both axes, of points at that lever.
_SPIN = cython.declare(cython.double, 0.5890486225480862 * 0.7071067811865476)


@cython.cclass
class Carried(Balance):
    """Parts that may move, some of them on others; the arrays are declared in the .pxd."""

    def __init__(self, count: int, tick_s: float) -> None:
        """There are `count` parts."""
        Balance.__init__(self, count, tick_s)
        least = max(count, 1)
        self._on, self._carrier = np.full(least, -1, dtype=np.intp), np.zeros(least, dtype=np.intp)
        self._level, self._order = np.zeros(least, dtype=np.intp), np.zeros(least, dtype=np.intp)

    @cython.cfunc
    @cython.exceptval(check=False)
    def _rest_on(
        self, n: cython.Py_ssize_t, mass: cython.double, more: cython.double, about: cython.double
    ) -> cython.void:
        """The four points at which a part rubs on what it lies on, with the moments of its face, and its
        inertia."""
        p, size, g = self._pose, self._size, self._points
        ax: cython.double = 0.0
        ay: cython.double = 0.0
        bx: cython.double = 0.0
        by: cython.double = 0.0
        turning: cython.double
        if self._kind[n] == _SPHERE:
            turning = 0.4 * mass * size[n, 0] * size[n, 0]
            ax = by = _SPIN * sqrt(size[n, 0] * self._below[n, 2] / self._below[n, 0])
        elif self._kind[n] == _CYLINDER and self._upright[n] >= 0:
            ax = by = 0.5 * size[n, 0]
            turning = 0.5 * mass * size[n, 0] * size[n, 0]
        elif self._kind[n] == _CYLINDER:
            ax, ay = _THIRD * size[n, 1] * p[n, 2], _THIRD * size[n, 1] * p[n, 5]
            turning = mass * (0.25 * size[n, 0] * size[n, 0] + size[n, 1] * size[n, 1] / 3.0)
        else:
            up: cython.Py_ssize_t = self._upright[n] if self._upright[n] >= 0 else 2
            i: cython.Py_ssize_t = (up + 1) % 3
            j: cython.Py_ssize_t = (up + 2) % 3
            ax, ay = _THIRD * size[n, i] * p[n, i], _THIRD * size[n, i] * p[n, 3 + i]
            bx, by = _THIRD * size[n, j] * p[n, j], _THIRD * size[n, j] * p[n, 3 + j]
            turning = mass * (size[n, i] * size[n, i] + size[n, j] * size[n, j]) / 3.0
        g[n, 0], g[n, 1], g[n, 2], g[n, 3] = ax + bx, ay + by, bx - ax, by - ay
        g[n, 4], g[n, 5], g[n, 6], g[n, 7] = -ax - bx, -ay - by, ax - bx, ay - by
        for k in range(3):
            self._mass[n, k] = mass + more
        self._mass[n, 3] = turning + about

    @cython.cfunc
    @cython.exceptval(check=False)
    def _carries(self, n: cython.Py_ssize_t, o: cython.Py_ssize_t) -> cython.bint:
        """Whether a body, if it is a part, lies on a part, or on what lies on that."""
        at: cython.Py_ssize_t = self._on[o] if 0 <= o < self._parts else -1
        while 0 <= at < self._parts:
            if at == n:
                return True
            at = self._on[at]
        return False

    def _height(self, part: int) -> int:
        """The number of parts, one on another, on which it lies."""
        at: cython.Py_ssize_t = self._on[part]
        height: int = 0
        while 0 <= at < self._parts:
            at = self._on[at]
            height += 1
        return height

    @cython.cfunc
    @cython.exceptval(check=False)
    def _far(self, n: cython.Py_ssize_t) -> cython.double:
        """How far (m) a part may go in this tick on what carries it."""
        v = self._velocity
        fast: cython.double = sqrt(v[n, 0] * v[n, 0] + v[n, 1] * v[n, 1] + v[n, 2] * v[n, 2])
        fast += fabs(v[n, 3]) * (self._reach[n, 0] + self._reach[n, 1])
        return self._tick * fast + max(0.0, self._deep[n])

    @cython.cfunc
    @cython.exceptval(check=False)
    def _far_with(self, n: cython.Py_ssize_t) -> cython.double:
        """How far (m) a part may go in this tick, with what carries it."""
        p = self._pose
        far: cython.double = self._far(n)
        at: cython.Py_ssize_t = self._on[n]
        while 0 <= at < self._parts:
            lever: cython.double = fabs(p[n, 9] - p[at, 9]) + fabs(p[n, 10] - p[at, 10])
            lever += self._reach[n, 0] + self._reach[n, 1]
            far += self._far(at) + self._tick * fabs(self._velocity[at, 3]) * lever
            at = self._on[at]
        return far

    @cython.cfunc
    def _join(self) -> object:
        """Find which places are whose, and begin with the ways that parts would go for themselves."""
        c, p = self._c, self._pose
        count: cython.Py_ssize_t = 0
        side: cython.Py_ssize_t
        n: cython.Py_ssize_t
        x: cython.Py_ssize_t
        other: cython.Py_ssize_t
        q: cython.Py_ssize_t
        self._pile()
        for k in range(self._many):
            self._first[k] = 0
        for m in range(self._met):
            c[m, 21], c[m, 29] = 0.0, c[m, 13]
            self._i[m, 4] = count
            for side in range(2):
                x = n = self._i[m, side]
                other = self._i[m, 1 - side]
                while 0 <= n < self._parts:
                    k = self._slot[n]
                    # What carries both takes both along.
                    if k >= 0 and not self._carries(n, other):
                        if count == self._of.shape[0]:
                            self._widen()
                        lx: cython.double = c[m, 17 + 2 * side] + (p[x, 9] - p[n, 9])
                        ly: cython.double = c[m, 18 + 2 * side] + (p[x, 10] - p[n, 10])
                        self._of[count, 0], self._of[count, 1] = k, m
                        self._moved[count, 0] = 1.0 if side else -1.0
                        self._moved[count, 1], self._moved[count, 2] = lx, ly
                        self._moved[count, 3] = lx * c[m, 15] - ly * c[m, 14]
                        self._first[k] += 1
                        count += 1
                    n = self._on[n]
            self._i[m, 5] = count
        if self._mine.shape[0] < count:
            self._mine: Any = np.zeros(2 * count, dtype=np.intp)
        count = 0
        for k in range(self._many):
            count += self._first[k]
            self._first[k] = count
        self._first[self._many] = count
        for q in range(count - 1, -1, -1):
            k = self._of[q, 0]
            self._first[k] -= 1
            self._mine[self._first[k]] = q
        for m in range(self._met):
            out: cython.double = c[m, 10] * c[m, 14] + c[m, 11] * c[m, 15] + c[m, 12] * c[m, 16]
            for i in range(3):
                c[m, 10 + i] -= out * c[m, 14 + i]
        self._begin()
        return None

    @cython.cfunc
    def _widen(self) -> object:
        """Make room for what moves places."""
        count: cython.Py_ssize_t = self._of.shape[0]
        of: Any = np.zeros((2 * count, 2), dtype=np.intp)
        moved: Any = np.zeros((2 * count, 4))
        of[:count], moved[:count] = self._of, self._moved
        self._of: Any = of
        self._moved: Any = moved
        self._adds: Any = np.zeros(2 * count)
        self._before: Any = np.zeros(2 * count)
        return None

    @cython.cfunc
    def _pile(self) -> object:
        """Find what carries what, of all that may move."""
        at: cython.Py_ssize_t
        level: cython.Py_ssize_t = 0
        placed: cython.Py_ssize_t = 0
        for k in range(self._many):
            self._carrier[k], self._level[k] = -1, 0
            at = self._on[self._group[k]]
            while 0 <= at < self._parts:
                if self._slot[at] >= 0:
                    self._level[k] += 1
                    if self._carrier[k] < 0:
                        self._carrier[k] = self._slot[at]
                at = self._on[at]
        while placed < self._many:
            for k in range(self._many):
                if self._level[k] == level:
                    self._order[placed] = k
                    placed += 1
            level += 1
        return None

    @cython.cfunc
    @cython.exceptval(check=False)
    def _begin(self) -> cython.void:
        """Begin with the ways that parts would go for themselves; those that rest on others, and meet
        nothing, go with these."""
        idle: cython.bint
        self._awake = 0
        for k in range(self._many):
            n = self._group[k]
            idle = self._carrier[k] >= 0 and self._first[k] == self._first[k + 1]
            for i in range(4):
                self._t[k, i] = self._tick * self._velocity[n, i]
                idle = idle and self._velocity[n, i] == 0.0
            for i in range(8):
                idle = idle and self._wound[n, i] == 0.0
            self._open[k] = not idle
            if not idle:
                self._awake += 1

    @cython.cfunc
    @cython.exceptval(check=False)
    def _put(self, share: cython.double) -> cython.void:
        """All are where a share of their ways ends."""
        t, e, p = self._t, self._e, self._pose
        for at in range(self._many):
            k = self._order[at]
            for i in range(4):
                t[k, i] = share * self._d[k, i]
                e[k, i] = t[k, i]
            by: cython.Py_ssize_t = self._carrier[k]
            if by >= 0:
                n, o = self._group[k], self._group[by]
                x: cython.double = p[n, 9] - p[o, 9]
                y: cython.double = p[n, 10] - p[o, 10]
                cosine_by, sine_by = self._turn[by, 0], self._turn[by, 1]
                e[k, 0] += e[by, 0] + (cosine_by * x - sine_by * y - x)
                e[k, 1] += e[by, 1] + (sine_by * x + cosine_by * y - y)
                e[k, 2] += e[by, 2]
                e[k, 3] += e[by, 3]
            self._turn[k, 0], self._turn[k, 1] = cosine(e[k, 3]), sine(e[k, 3])

    @cython.cfunc
    @cython.exceptval(check=False)
    def _farther_out(self) -> cython.double:
        """Energy of motion (J) that is to be added where all are now: parts have gone farther from the middle
        of what carries them and turns, or nearer to it, since their moment of inertia was found."""
        e, p = self._e, self._pose
        total: cython.double = 0.0
        for k in range(self._many):
            by: cython.Py_ssize_t = self._carrier[k]
            if by < 0:
                continue
            mass: cython.double = self._mass[self._group[k], 0]
            for other in range(self._many):
                if self._carrier[other] == k:
                    mass -= self._mass[self._group[other], 0]
            while by >= 0:
                n, o = self._group[k], self._group[by]
                x: cython.double = p[n, 9] - p[o, 9]
                y: cython.double = p[n, 10] - p[o, 10]
                to_x: cython.double = x + e[k, 0] - e[by, 0]
                to_y: cython.double = y + e[k, 1] - e[by, 1]
                turns: cython.double = self._t[by, 3] / self._tick
                total += 0.5 * mass * (to_x * to_x + to_y * to_y - x * x - y * y) * turns * turns
                by = self._carrier[by]
        return total

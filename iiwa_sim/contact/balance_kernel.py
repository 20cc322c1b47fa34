"""How parts that lie give way in a tick, all that touch each other at once: each goes the way on which it
ends where all that presses is in balance.

A part goes a way dx dy dz (m) and turns by an angle about z (rad), together four numbers. Where two bodies
meet there is a spring that presses along a line, and by Coulomb's friction across it, of a spring that slips
at its limit. What a part lies on presses up, and rubs at four points below it. The ways are those for which

    sum m (way - velocity t)^2 / 2 t^2  +  what the springs store at the end  +  what friction takes

is least, which is an implicit step of Euler's with all forces as they are at its end: whatever the stiffness
and the tick, parts and springs have no more energy after it than before. The function is convex and without
kinks: steps of Newton's for one part after the other, along a row and back, find the least.

There all that presses is seen as planes: where it bends they are taken anew in `stored_kernel`, and what is
really stored is counted there.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.places_kernel import Places
else:
    from iiwa_sim.contact.places_kernel import Places

STILL_M = 1e-9
"""A part that would go a shorter way in a tick stays."""
_STILL = cython.declare(cython.double, STILL_M)
# So often the ways of parts that touch are found anew, of few parts until so many ways have been found, and
# steps (m) that end that; and of a part alone.
_SWEEPS = cython.declare(cython.Py_ssize_t, 12)
_WAYS = cython.declare(cython.Py_ssize_t, 400)
_SMALL = cython.declare(cython.double, 1e-8)
_STEPS = cython.declare(cython.Py_ssize_t, 40)
_SMALLEST = cython.declare(cython.double, 1e-11)
_TRIES = cython.declare(cython.Py_ssize_t, 30)


@cython.cclass
class Balance(Places):
    """Parts that may move, and the ways on which all that presses is in balance."""

    def __init__(self, count: int, tick_s: float) -> None:
        """There are `count` parts."""
        Places.__init__(self, count)
        least = max(count, 1)
        self._tick = tick_s
        self._limit = 0.0
        self._velocity, self._wound = np.zeros((least, 4)), np.zeros((least, 8))
        self._points, self._deep = np.zeros((least, 8)), np.zeros(least)
        self._mass, self._below = np.zeros((least, 4)), np.zeros((least, 4))
        self._many = self._awake = 0
        self._group, self._d = np.zeros(least, dtype=np.intp), np.zeros((least, 4))
        self._open = np.zeros(least, dtype=np.int8)
        self._h, self._b, self._s = np.zeros((4, 4)), np.zeros(4), np.zeros(4)
        self._first, self._mine = np.zeros(least + 1, dtype=np.intp), np.zeros(512, dtype=np.intp)

    @cython.cfunc
    def _balance(self) -> object:
        """Find the ways."""
        t = self._t
        most: cython.double
        for m in range(self._met):
            self._find_depth(m)
        small: cython.double = _SMALLEST if self._awake == 1 else _SMALL
        for sweep in range(_STEPS if self._awake == 1 else max(_SWEEPS, _WAYS // self._awake)):
            again: cython.bint = False
            for at in range(self._many):
                k = at if sweep & 1 == 0 else self._many - 1 - at
                if self._open[k]:
                    again = True
                    self._open[k] = 0
                    if self._better(k) > small:
                        self._wake(k)
            if not again:
                break
        for k in range(self._many):
            most = 0.0
            for i in range(3):
                most = max(most, fabs(t[k, i]))
            n = self._group[k]
            most = max(most, fabs(t[k, 3]) * (self._reach[n, 0] + self._reach[n, 1]))
            if most < _STILL:
                for i in range(4):
                    t[k, i] = 0.0
            for i in range(4):
                self._d[k, i] = t[k, i]
        return None

    @cython.cfunc
    @cython.exceptval(check=False)
    def _wake(self, k: cython.Py_ssize_t) -> cython.void:
        """A part goes another way than before: it is looked at again, and so is what it touches."""
        self._open[k] = 1
        for at in range(self._first[k], self._first[k + 1]):
            m = self._of[self._mine[at], 1]
            if self._c[m, 21] > 0.0 or self._c[m, 58] > 0.0 or self._c[m, 13] > 0.0:
                for q in range(self._i[m, 4], self._i[m, 5]):
                    self._open[self._of[q, 0]] = 1

    @cython.cfunc
    @cython.exceptval(check=False)
    def _better(self, k: cython.Py_ssize_t) -> cython.double:
        """A step of Newton's for one part; how far (m) it goes."""
        t, s, b = self._t, self._s, self._b
        n = self._group[k]
        carried: cython.double = max(0.0, self._below[n, 0] * (self._below[n, 1] - t[k, 2]))
        self._limit = 0.25 * self._material[n, 1] * carried
        value: cython.double = self._value(k, True)
        self._solve()
        slope: cython.double = 0.0
        size: cython.double = self._reach[n, 0] + self._reach[n, 1]
        far: cython.double = fabs(s[3]) * size
        for i in range(4):
            slope += s[i] * b[i]
            if i < 3:
                far = max(far, fabs(s[i]))
        if far < 0.1 * _SMALLEST or slope >= 0.0:
            return 0.0
        part: cython.double = 1.0
        before_0, before_1, before_2, before_3 = t[k, 0], t[k, 1], t[k, 2], t[k, 3]
        for _try in range(_TRIES):
            t[k, 0], t[k, 1] = before_0 + part * s[0], before_1 + part * s[1]
            t[k, 2], t[k, 3] = before_2 + part * s[2], before_3 + part * s[3]
            if self._value(k, False) <= value + 1e-4 * part * slope:
                return part * far
            part *= 0.5
        t[k, 0], t[k, 1], t[k, 2], t[k, 3] = before_0, before_1, before_2, before_3
        self._value(k, False)  # notes the depths there
        return 0.0

    @cython.cfunc
    @cython.exceptval(check=False)
    def _value(self, k: cython.Py_ssize_t, derive: cython.bint) -> cython.double:
        """What shall be least, as far as one part is concerned; with its derivatives there."""
        t, b, h, c, g, moved = self._t, self._b, self._h, self._c, self._points, self._moved
        n = self._group[k]
        total: cython.double = 0.0
        mass: cython.double
        off: cython.double
        for i in range(4):
            mass = self._mass[n, i] / (self._tick * self._tick)
            off = t[k, i] - self._tick * self._velocity[n, i]
            total += 0.5 * mass * off * off
            if derive:
                b[i] = mass * off
                for j in range(4):
                    h[i, j] = 0.0
                h[i, i] = mass
        stiffness: cython.double = self._below[n, 0]
        total += self._below[n, 2] * t[k, 2]
        depth: cython.double = self._below[n, 1] - t[k, 2]
        if depth > 0.0:
            total += 0.5 * stiffness * depth * depth
        if derive:
            b[2] += self._below[n, 2]
            if depth > 0.0:
                b[2] -= stiffness * depth
                h[2, 2] += stiffness
        # Friction below.
        holding: cython.double = 0.25 * stiffness
        f: cython.double
        p: cython.double
        q: cython.double
        if self._limit > 0.0:
            for j in range(4):
                gx, gy = g[n, 2 * j], g[n, 2 * j + 1]
                x = self._wound[n, 2 * j] + t[k, 0] - t[k, 3] * gy
                y = self._wound[n, 2 * j + 1] + t[k, 1] + t[k, 3] * gx
                length = sqrt(x * x + y * y)
                if holding * length <= self._limit:
                    total += 0.5 * holding * length * length
                    f, p, q = holding, holding, 0.0
                else:
                    total += self._limit * length - 0.5 * self._limit * self._limit / holding
                    f = self._limit / length
                    p, q = f, f / (length * length)
                if derive:
                    b[0] += f * x
                    b[1] += f * y
                    b[3] += f * (gx * y - gy * x)
                    xx, xy, yy = p - q * x * x, -q * x * y, p - q * y * y
                    h[0, 0] += xx
                    h[1, 0] += xy
                    h[1, 1] += yy
                    ax, ay = gx * xy - gy * xx, gx * yy - gy * xy
                    h[3, 0] += ax
                    h[3, 1] += ay
                    h[3, 3] += gx * ay - gy * ax
        # All that presses.
        side: cython.double
        lx: cython.double
        ly: cython.double
        turn: cython.double
        for at in range(self._first[k], self._first[k + 1]):
            own = self._mine[at]
            m = self._of[own, 1]
            nx, ny, nz = c[m, 14], c[m, 15], c[m, 16]
            side, lx, ly, turn = moved[own, 0], moved[own, 1], moved[own, 2], moved[own, 3]
            depth = self._depth_with(own)
            if depth > 0.0:
                f = c[m, 4] * depth
                total += 0.5 * f * depth
                if derive:
                    f *= side
                    b[0] += f * nx
                    b[1] += f * ny
                    b[2] += f * nz
                    b[3] += f * turn
                    p = c[m, 4]
                    h[0, 0] += p * nx * nx
                    h[1, 0] += p * nx * ny
                    h[1, 1] += p * ny * ny
                    h[2, 0] += p * nx * nz
                    h[2, 1] += p * ny * nz
                    h[2, 2] += p * nz * nz
                    h[3, 0] += p * nx * turn
                    h[3, 1] += p * ny * turn
                    h[3, 2] += p * nz * turn
                    h[3, 3] += p * turn * turn
            if derive:
                c[m, 21] = c[m, 5] * c[m, 4] * depth if depth > 0.0 else 0.0
            limit: cython.double = c[m, 21]
            if limit <= 0.0:
                continue
            holding = c[m, 6]
            x, y, z = self._rub(m)
            length = sqrt(x * x + y * y + z * z)
            if holding * length <= limit:
                total += 0.5 * holding * length * length
                f, p, q = holding, holding, 0.0
            else:
                total += limit * length - 0.5 * limit * limit / holding
                f = limit / length
                p, q = f, f / (length * length)
            if derive:
                w = lx * y - ly * x
                b[0] -= side * f * x
                b[1] -= side * f * y
                b[2] -= side * f * z
                b[3] -= side * f * w
                h[0, 0] += p * (1.0 - nx * nx) - q * x * x
                h[1, 0] += -p * nx * ny - q * x * y
                h[1, 1] += p * (1.0 - ny * ny) - q * y * y
                h[2, 0] += -p * nx * nz - q * x * z
                h[2, 1] += -p * ny * nz - q * y * z
                h[2, 2] += p * (1.0 - nz * nz) - q * z * z
                h[3, 0] += p * (-ly - turn * nx) - q * w * x
                h[3, 1] += p * (lx - turn * ny) - q * w * y
                h[3, 2] += -p * turn * nz - q * w * z
                h[3, 3] += p * (lx * lx + ly * ly - turn * turn) - q * w * w
        return total

    @cython.cfunc
    @cython.exceptval(check=False)
    def _solve(self) -> cython.void:
        """The step of Newton's, by Cholesky's decomposition in place; the inertia makes it definite."""
        h, b, s = self._h, self._b, self._s
        total: cython.double
        for i in range(4):
            for k in range(i + 1):
                total = h[i, k]
                for j in range(k):
                    total -= h[i, j] * h[k, j]
                if i == k:
                    h[i, i] = sqrt(max(total, 1e-300))
                else:
                    h[i, k] = total / h[k, k]
        for i in range(4):
            total = -b[i]
            for j in range(i):
                total -= h[i, j] * s[j]
            s[i] = total / h[i, i]
        for m in range(4):
            i = 3 - m
            total = s[i]
            for j in range(i + 1, 4):
                total -= h[j, i] * s[j]
            s[i] = total / h[i, i]

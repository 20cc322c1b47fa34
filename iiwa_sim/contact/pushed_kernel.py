"""How a part that lies gives way in a tick: the way on which it ends where all that pushes it is in balance.

The part goes a way dx dy dz (m) and turns by an angle about z (rad), together four numbers. Each that pushes
it is a spring that presses along a line, and by Coulomb's friction across it, of a spring that slips at its
limit. What it lies on presses up, and rubs at four points below it. The way is the one for which

    m (way - velocity t)^2 / 2 t^2  +  what the springs store at the end  +  what friction takes

is least, which is an implicit step of Euler's with all forces as they are at its end: whatever the stiffness
and the tick, the part and the springs have no more energy after it than before. The function is convex and
without kinks, so Newton's method finds the least.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt

from iiwa_sim.contact.pushers import Below, Pressing

ROUNDS = 4
"""So often the limits of friction are found anew, from the normal forces of the round before."""
_ROUNDS = cython.declare(cython.Py_ssize_t, ROUNDS)
_STEPS = cython.declare(cython.Py_ssize_t, 30)
_HALVINGS = cython.declare(cython.Py_ssize_t, 30)
_SMALL = cython.declare(cython.double, 1e-14)  # a step (m) that ends the search
MOST_CONTACTS = 64
_MOST_CONTACTS = cython.declare(cython.Py_ssize_t, MOST_CONTACTS)


@cython.cclass
class Balance:
    """Finds ways of parts, one after the other; it remembers nothing."""

    _count: cython.Py_ssize_t
    _c: cython.double[
        :, ::1
    ]  # of each that presses: along 4, depth, stiffness, limit, holding, columns 12, rubbed 3
    _g: cython.double[:, ::1]  # of each point below: x, y, wound x, y
    _h: cython.double[:, ::1]  # second derivatives
    _b: cython.double[::1]  # first ones
    _d: cython.double[::1]  # the way
    _s: cython.double[::1]  # the next step
    _try: cython.double[::1]
    _inertia: cython.double[::1]  # m, m, m, I over the square of the tick
    _free: cython.double[::1]  # the way without any forces
    _limit: cython.double  # of friction below, at each point (N)
    _stiffness: cython.double
    _depth: cython.double
    _weight: cython.double

    def __init__(self) -> None:
        self._c = np.zeros((MOST_CONTACTS, 23))
        self._g = np.zeros((4, 4))
        self._h = np.zeros((4, 4))
        self._b, self._d, self._s, self._try = np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(4)
        self._inertia, self._free = np.zeros(4), np.zeros(4)
        self._count = 0
        self._limit = self._stiffness = self._depth = self._weight = 0.0

    def way(
        self,
        mass_kg: float,
        inertia_kgm2: float,
        velocity: Sequence[float],
        below: Below,
        pressing: Sequence[Pressing],
        tick_s: float,
    ) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """The way of a part with a velocity (m/s three times, rad/s) in a tick, and how the springs of
        friction below it are wound then. Of what presses only the first `MOST_CONTACTS` count."""
        d = self._d
        scale: cython.double = 1.0 / (tick_s * tick_s)
        for i in range(4):
            self._inertia[i] = scale * (inertia_kgm2 if i == 3 else mass_kg)
            self._free[i] = tick_s * velocity[i]
            d[i] = 0.0
        self._stiffness, self._depth, self._weight = below.stiffness, below.depth, below.weight_n
        for j in range(4):
            self._g[j, 0], self._g[j, 1] = below.points[j]
            self._g[j, 2], self._g[j, 3] = below.wound[2 * j], below.wound[2 * j + 1]
        self._count = min(len(pressing), _MOST_CONTACTS)
        for n in range(self._count):
            self._take(n, pressing[n])
        frictions = [each.friction for each in pressing]
        above: cython.double = below.above_n
        friction: cython.double = below.friction
        for _round in range(_ROUNDS):
            carried: cython.double = max(0.0, self._stiffness * (self._depth - d[2])) + above
            self._limit = 0.25 * friction * carried
            for n in range(self._count):
                depth: cython.double = self._c[n, 4]
                for i in range(4):
                    depth += self._c[n, i] * d[i]
                self._c[n, 6] = cython.cast(cython.double, frictions[n]) * self._c[n, 5] * max(0.0, depth)
            self._find()
        wound = []
        most: cython.double = 4.0 * self._limit / self._stiffness
        for j in range(4):
            x = self._g[j, 2] + d[0] - d[3] * self._g[j, 1]
            y = self._g[j, 3] + d[1] + d[3] * self._g[j, 0]
            length = sqrt(x * x + y * y)
            share: cython.double = 1.0 if length <= most else most / length
            wound += [share * x, share * y]
        return (d[0], d[1], d[2], d[3]), tuple(wound)

    @cython.cfunc
    def _take(self, n: cython.Py_ssize_t, each: Any) -> object:
        """Note one that presses."""
        c = self._c
        for i in range(4):
            c[n, i] = each.along[i]
        c[n, 4], c[n, 5], c[n, 6], c[n, 7] = each.depth, each.stiffness, 0.0, each.holding
        x: cython.double
        y: cython.double
        nx: cython.double
        ny: cython.double
        nz: cython.double
        x, y = each.lever
        nx, ny, nz = each.out
        # How what it rubs on goes with each of the four, across the line: three numbers each.
        c[n, 8], c[n, 9], c[n, 10] = 1.0 - nx * nx, -nx * ny, -nx * nz
        c[n, 11], c[n, 12], c[n, 13] = -ny * nx, 1.0 - ny * ny, -ny * nz
        c[n, 14], c[n, 15], c[n, 16] = -nz * nx, -nz * ny, 1.0 - nz * nz
        out: cython.double = -y * nx + x * ny
        c[n, 17], c[n, 18], c[n, 19] = -y - out * nx, x - out * ny, -out * nz
        c[n, 20], c[n, 21], c[n, 22] = each.rubbed
        return None

    @cython.cfunc
    def _find(self) -> object:
        """Newton's steps to the least, with the limits of friction as they are."""
        d, s, t = self._d, self._s, self._try
        for i in range(4):
            t[i] = d[i]
        value: cython.double = self._value(True)
        for _step in range(_STEPS):
            self._solve()
            largest: cython.double = 0.0
            slope: cython.double = 0.0
            for i in range(4):
                largest = max(largest, fabs(s[i]))
                slope += s[i] * self._b[i]
            if largest < _SMALL or slope >= 0.0:
                break
            part: cython.double = 1.0
            lower: cython.double = value
            found: cython.bint = False
            for _half in range(_HALVINGS):
                for i in range(4):
                    t[i] = d[i] + part * s[i]
                lower = self._value(False)
                if lower <= value + 1e-4 * part * slope:
                    found = True
                    break
                part *= 0.5
            if not found:
                break
            for i in range(4):
                t[i] = d[i] = d[i] + part * s[i]
            value = self._value(True)
        return None

    @cython.cfunc
    @cython.exceptval(check=False)
    def _value(self, derive: cython.bint) -> cython.double:
        """What shall be least, at the way in `_try`; with its derivatives there."""
        t, b, h, c, g = self._try, self._b, self._h, self._c, self._g
        total: cython.double = 0.0
        for i in range(4):
            off = t[i] - self._free[i]
            total += 0.5 * self._inertia[i] * off * off
            if derive:
                b[i] = self._inertia[i] * off
                for k in range(4):
                    h[i, k] = 0.0
                h[i, i] = self._inertia[i]
        total += self._weight * t[2]
        depth: cython.double = self._depth - t[2]
        if depth > 0.0:
            total += 0.5 * self._stiffness * depth * depth
        if derive:
            b[2] += self._weight
            if depth > 0.0:
                b[2] -= self._stiffness * depth
                h[2, 2] += self._stiffness
        # Friction below.
        holding: cython.double = 0.25 * self._stiffness
        f: cython.double
        p: cython.double
        q: cython.double
        if self._limit > 0.0:
            for j in range(4):
                gx, gy = g[j, 0], g[j, 1]
                x, y = g[j, 2] + t[0] - t[3] * gy, g[j, 3] + t[1] + t[3] * gx
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
                    h[0, 1] += xy
                    h[1, 0] += xy
                    h[1, 1] += yy
                    ax, ay = gx * xy - gy * xx, gx * yy - gy * xy
                    h[0, 3] += ax
                    h[3, 0] += ax
                    h[1, 3] += ay
                    h[3, 1] += ay
                    h[3, 3] += gx * ay - gy * ax
        # All that presses.
        for n in range(self._count):
            depth = c[n, 4]
            for i in range(4):
                depth += c[n, i] * t[i]
            if depth > 0.0:
                total += 0.5 * c[n, 5] * depth * depth
                if derive:
                    for i in range(4):
                        b[i] += c[n, 5] * depth * c[n, i]
                        for k in range(4):
                            h[i, k] += c[n, 5] * c[n, i] * c[n, k]
            limit: cython.double = c[n, 6]
            if limit <= 0.0:
                continue
            holding = c[n, 7]
            x, y, z = c[n, 20], c[n, 21], c[n, 22]
            for i in range(4):
                x -= c[n, 8 + 3 * i] * t[i]
                y -= c[n, 9 + 3 * i] * t[i]
                z -= c[n, 10 + 3 * i] * t[i]
            length = sqrt(x * x + y * y + z * z)
            if holding * length <= limit:
                total += 0.5 * holding * length * length
                f, p, q = holding, holding, 0.0
            else:
                total += limit * length - 0.5 * limit * limit / holding
                f = limit / length
                p, q = f, f / (length * length)
            if derive:
                for i in range(4):
                    along = c[n, 8 + 3 * i] * x + c[n, 9 + 3 * i] * y + c[n, 10 + 3 * i] * z
                    b[i] -= f * along
                    for k in range(4):
                        other = c[n, 8 + 3 * k] * x + c[n, 9 + 3 * k] * y + c[n, 10 + 3 * k] * z
                        both = (
                            c[n, 8 + 3 * i] * c[n, 8 + 3 * k]
                            + c[n, 9 + 3 * i] * c[n, 9 + 3 * k]
                            + c[n, 10 + 3 * i] * c[n, 10 + 3 * k]
                        )
                        h[i, k] += p * both - q * along * other
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

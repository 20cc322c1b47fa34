"""The inner loops of the clock: a primal-dual interior-point method for b(theta) = (dtheta/dt)^2; compiled by
Cython.

theta counts cells; c (N + 2) are the coefficients of a quadratic B-spline: at the knot k, b = (c[k] + c[k
+ 1]) / 2 and db/dtheta = c[k + 1] - c[k]; in the cell k, d2b/dtheta2 = c[k] - 2 c[k + 1] + c[k + 2]. All
arrays are C-contiguous float64.

What bounds it (`bounds_kernel`) is a linear function y of c with -w <= y <= w: w is 1 for velocities and
accelerations, and 1 / sqrt(b), which is convex, for jerks. Either side has a slack t > 0 and a multiplier
n > 0. Steps bring t to the true distance w - y or w + y, which it need not be in the beginning, and t n, the
time that may be left to gain there, to 0. A c that keeps a limit goes on keeping it.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.libc.math import sqrt

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.timing.bounds_kernel import Rows
else:
    from iiwa_sim.motion.timing.bounds_kernel import Rows
from iiwa_sim.motion.timing.packing_kernel import packed

TIE = cython.declare(cython.double, 10.0)  # keeps the ends, where nothing moves yet, like what is beside them
SIGMA = cython.declare(cython.double, 0.2)  # of what is left to gain: so much a step aims at
NEAR = cython.declare(cython.double, 0.98)  # part of the way to where a slack or a multiplier would be 0,
SLOWER = cython.declare(cython.double, 0.8)  # and of c to 0, that a step goes
PASSED = cython.declare(cython.double, 1e-4)  # of limits: so little is too much in the end
STUCK = cython.declare(cython.double, 0.02)  # of what is beside it: so little is nearly standing still


@cython.cclass
class Steps:
    """Newton steps of one clock, and what is kept from one to the next.

    `rows` (R, 13): three factors of c; of both sides n and t, their last changes, and 1 / t. Those with the
    same w are a group (G): its rows are from `first` (G + 1,) on, and `weights` (G, 3) say which part of c is
    its b, none where w is 1. The groups of a cell are from `groups` (N + 1,) on.
    """

    cells: cython.Py_ssize_t
    fixed: cython.Py_ssize_t
    groups: cython.Py_ssize_t[::1]
    first: cython.Py_ssize_t[::1]
    weights: cython.double[:, ::1]
    rows: cython.double[:, ::1]
    band: cython.double[:, ::1]
    vectors: cython.double[:, ::1]
    gap: cython.double
    far: cython.double

    def __init__(self, given: Rows, c: cython.double[::1], fixed: int, idle: float) -> None:
        """Of a chain with such rows, but for those that at c (N + 2,) are at less than this part of w. The
        first coefficients, none or two, are `fixed`."""
        self.cells, self.fixed = given.bounds.cells, fixed
        self.groups, self.first, self.weights, self.rows = packed(given, c, fixed, idle)
        self.band, self.vectors = np.empty((self.cells + 2, 3)), np.empty((2, self.cells + 2))
        self.gap = self.far = 0.0

    def begin(self, c: cython.double[::1], mu: cython.double, least: cython.double) -> None:
        """Slacks as they are at c (N + 2,), but not below a part of w, and multipliers that let `mu` times
        the mean time of a cell be left to gain at each."""
        y: cython.double
        time: cython.double = 0.0
        for k in range(self.cells):
            time += 1.0 / sqrt((c[k] + 6.0 * c[k + 1] + c[k + 2]) * 0.125)
        mu *= time / self.cells
        self.far = 0.0
        for k in range(self.cells):
            for g in range(self.groups[k], self.groups[k + 1]):
                w = self._w(g, c, k)
                for r in range(self.first[g], self.first[g + 1]):
                    y = self.rows[r, 0] * c[k] + self.rows[r, 1] * c[k + 1] + self.rows[r, 2] * c[k + 2]
                    for f in range(2):
                        self.rows[r, 5 + f] = max(w - y, least * w)
                        self.rows[r, 3 + f] = mu / self.rows[r, 5 + f]
                        self.far = max(self.far, self.rows[r, 5 + f] - w + y)
                        y = -y
        self.gap = mu * 2.0 * self.rows.shape[0]

    @cython.cfunc
    @cython.inline
    def _w(self, g: cython.Py_ssize_t, c: cython.double[::1], k: cython.Py_ssize_t) -> cython.double:
        """What the rows of a group stay below."""
        b: cython.double = (
            self.weights[g, 0] * c[k] + self.weights[g, 1] * c[k + 1] + self.weights[g, 2] * c[k + 2]
        )
        return 1.0 / sqrt(b) if b > 0.0 else 1.0

    def go(self, c: cython.double[::1], most: cython.Py_ssize_t, enough: cython.double) -> tuple[int, bool]:
        """At most so many steps of c (N + 2,), in place.

        Gives their number, and whether all limits are kept and less than a part of the time is left to gain.
        """
        m: cython.Py_ssize_t = self.cells + 2
        done: cython.Py_ssize_t = 0
        step: cython.double[::1] = self.vectors[1]
        while done < most:
            mu = SIGMA * self.gap / max(2.0 * self.rows.shape[0], 1.0)
            time = self._assemble(c, mu)
            if not _solve(self.vectors[0], self.band, step, self.fixed):
                return done, False
            a, b = self._changes(c, mu)
            for i in range(self.fixed, m):
                y = step[i]
                if -a * y > SLOWER * c[i]:
                    a = -SLOWER * c[i] / y
            self._take(a, b)
            for i in range(self.fixed, m):
                c[i] += a * step[i]
            done += 1
            self.far *= 1.0 - a
            if self.gap <= enough * time and self.far <= PASSED:
                return done, True
        return done, False

    @cython.cfunc
    def _assemble(self, c: cython.double[::1], mu: cython.double) -> cython.double:
        """The equations of a step: a band, of which the diagonal and two beside it, and the right side. Gives
        the time of all cells."""
        m: cython.Py_ssize_t = self.cells + 2
        y: cython.double
        s: cython.double
        up: cython.double
        down: cython.double
        n: cython.double
        t: cython.double
        q: cython.double
        d0: cython.double
        d1: cython.double
        d2: cython.double
        h00: cython.double
        h01: cython.double
        h02: cython.double
        h11: cython.double
        h12: cython.double
        h22: cython.double
        r0: cython.double
        r1: cython.double
        r2: cython.double
        time: cython.double = 0.0
        rows: cython.double[:, ::1] = self.rows
        band: cython.double[:, ::1] = self.band
        right: cython.double[::1] = self.vectors[0]
        for k in range(m):
            band[k, 0] = band[k, 1] = band[k, 2] = right[k] = 0.0
        for e in range(1 if self.fixed > 0 else 0, 2):
            k = (m - 2) * e
            y = 2.0 * TIE * (c[k + 1] - c[k])
            right[k] += y
            right[k + 1] -= y
            band[k, 0] += 2.0 * TIE
            band[k, 1] -= 2.0 * TIE
            band[k + 1, 0] += 2.0 * TIE
        for k in range(self.cells):
            c0, c1, c2 = c[k], c[k + 1], c[k + 2]
            y = 1.0 / ((c0 + 6.0 * c1 + c2) * 0.125)
            s = sqrt(y)
            time += s
            y *= s
            r0 = r2 = 0.0625 * y
            r1 = 0.375 * y
            y *= 0.75 * s * s
            h00 = h02 = h22 = 0.015625 * y
            h01 = h12 = 0.09375 * y
            h11 = 0.5625 * y
            for g in range(self.groups[k], self.groups[k + 1]):
                w = self._w(g, c, k)
                s = up = d0 = d1 = d2 = 0.0
                for r in range(self.first[g], self.first[g + 1]):
                    p0, p1, p2 = rows[r, 0], rows[r, 1], rows[r, 2]
                    y = p0 * c0 + p1 * c1 + p2 * c2
                    rows[r, 5] = t = max(rows[r, 5], w - y)
                    rows[r, 9] = n = w - y - t
                    rows[r, 11] = q = 1.0 / t
                    down = rows[r, 3] * q
                    q = mu * q - down * n
                    rows[r, 6] = t = max(rows[r, 6], w + y)
                    rows[r, 10] = n = w + y - t
                    rows[r, 12] = t = 1.0 / t
                    y = rows[r, 4] * t
                    t = mu * t - y * n
                    up += q + t
                    t -= q
                    r0 += t * p0
                    r1 += t * p1
                    r2 += t * p2
                    t = y - down
                    y += down
                    s += y
                    d0 += t * p0
                    d1 += t * p1
                    d2 += t * p2
                    t = y * p0
                    h00 += t * p0
                    h01 += t * p1
                    h02 += t * p2
                    t = y * p1
                    h11 += t * p1
                    h12 += t * p2
                    h22 += y * p2 * p2
                if self.weights[g, 1] > 0.0:
                    # w goes with b, and b with these parts of c.
                    y = -0.5 * w * w * w
                    p0, p1, p2 = y * self.weights[g, 0], y * self.weights[g, 1], y * self.weights[g, 2]
                    r0 += up * p0
                    r1 += up * p1
                    r2 += up * p2
                    h00 += p0 * (s * p0 + 2.0 * d0)
                    h01 += p0 * (s * p1 + d1) + p1 * d0
                    h02 += p0 * (s * p2 + d2) + p2 * d0
                    h11 += p1 * (s * p1 + 2.0 * d1)
                    h12 += p1 * (s * p2 + d2) + p2 * d1
                    h22 += p2 * (s * p2 + 2.0 * d2)
            right[k] += r0
            right[k + 1] += r1
            right[k + 2] += r2
            band[k, 0] += h00
            band[k, 1] += h01
            band[k, 2] += h02
            band[k + 1, 0] += h11
            band[k + 1, 1] += h12
            band[k + 2, 0] += h22
        return time

    @cython.cfunc
    def _changes(self, c: cython.double[::1], mu: cython.double) -> tuple[cython.double, cython.double]:
        """Write how slacks and multipliers change in a step. Gives how much of that they can go."""
        y: cython.double
        dt: cython.double
        dn: cython.double
        a: cython.double = NEAR
        b: cython.double = 1.0 / NEAR
        rows: cython.double[:, ::1] = self.rows
        weights: cython.double[:, ::1] = self.weights
        d: cython.double[::1] = self.vectors[1]
        for k in range(self.cells):
            for g in range(self.groups[k], self.groups[k + 1]):
                w = 0.0
                if weights[g, 1] > 0.0:
                    w = self._w(g, c, k)
                    w *= (
                        -0.5
                        * w
                        * w
                        * (weights[g, 0] * d[k] + weights[g, 1] * d[k + 1] + weights[g, 2] * d[k + 2])
                    )
                for r in range(self.first[g], self.first[g + 1]):
                    y = rows[r, 0] * d[k] + rows[r, 1] * d[k + 1] + rows[r, 2] * d[k + 2]
                    for f in range(2):
                        dt = rows[r, 9 + f] + w - y
                        dn = (mu - rows[r, 3 + f] * dt) * rows[r, 11 + f] - rows[r, 3 + f]
                        rows[r, 7 + f], rows[r, 9 + f] = dn, dt
                        a = max(a, -dt * rows[r, 11 + f])
                        if -dn * b > rows[r, 3 + f]:
                            b = -rows[r, 3 + f] / dn
                        y = -y
        return NEAR / a, min(NEAR * b, 1.0)

    @cython.cfunc
    def _take(self, a: cython.double, b: cython.double) -> cython.void:
        """Let slacks and multipliers go so much of their changes."""
        gap: cython.double = 0.0
        rows: cython.double[:, ::1] = self.rows
        for r in range(rows.shape[0]):
            rows[r, 3] += b * rows[r, 7]
            rows[r, 4] += b * rows[r, 8]
            rows[r, 5] += a * rows[r, 9]
            rows[r, 6] += a * rows[r, 10]
            gap += rows[r, 3] * rows[r, 5] + rows[r, 4] * rows[r, 6]
        self.gap = gap


@cython.cfunc
def _solve(
    right: cython.double[::1],
    band: cython.double[:, ::1],
    step: cython.double[::1],
    fixed: cython.Py_ssize_t,
) -> cython.bint:
    """Newton's step from row `fixed` on, by L D L' of the band, in place; False where it is not positive."""
    m: cython.Py_ssize_t = right.shape[0]
    d: cython.double
    e: cython.double
    f: cython.double
    for i in range(fixed):
        step[i] = 0.0
    for i in range(fixed, m):
        if not band[i, 0] > 0.0:
            return False
        d = 1.0 / band[i, 0]
        e, f = band[i, 1] * d, band[i, 2] * d
        if i + 1 < m:
            band[i + 1, 0] -= e * band[i, 1]
            band[i + 1, 1] -= e * band[i, 2]
        if i + 2 < m:
            band[i + 2, 0] -= f * band[i, 2]
        band[i, 0], band[i, 1], band[i, 2] = d, e, f
        d = right[i]
        if i - 1 >= fixed:
            d -= band[i - 1, 1] * step[i - 1]
        if i - 2 >= fixed:
            d -= band[i - 2, 2] * step[i - 2]
        step[i] = d
    for i in range(m - 1, fixed - 1, -1):
        d = step[i] * band[i, 0]
        if i + 1 < m:
            d -= band[i, 1] * step[i + 1]
        if i + 2 < m:
            d -= band[i, 2] * step[i + 2]
        step[i] = d
    return True


def lifted(c: cython.double[::1], fixed: cython.Py_ssize_t) -> bool:
    """Whether steps have led to where the chain all but stands still for a knot: there it keeps all limits,
    and none leads out. Such coefficients are then like those beside them."""
    before: cython.double = c[max(fixed - 1, 0)]
    found: cython.bint = False
    for k in range(max(fixed, 1), c.shape[0] - 1):
        beside = 0.5 * (before + c[k + 1])
        before = c[k]
        if c[k] < STUCK * beside:
            c[k] = 0.5 * beside
            found = True
    return bool(found)

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
from cython.cimports.libc.math import fabs, sqrt
from numpy.typing import NDArray

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.timing.bounds_kernel import Rows
    from cython.cimports.iiwa_sim.motion.timing.newton_kernel import assemble, limit, solve
else:
    from iiwa_sim.motion.timing.bounds_kernel import Rows
    from iiwa_sim.motion.timing.newton_kernel import assemble, limit, solve
from iiwa_sim.motion.timing.packing_kernel import merged, packed

SIGMA = cython.declare(cython.double, 0.2)  # of what is left to gain: so much a step aims at
NEAR = cython.declare(cython.double, 0.98)  # part of the way to where a slack or a multiplier would be 0,
SLOWER = cython.declare(cython.double, 0.8)  # and of c to 0, that a step goes
PASSED = cython.declare(cython.double, 1e-4)  # of limits: so little is too much in the end
FASTER = cython.declare(cython.double, 0.02)  # so much faster a step at the end may have been
# Where a clock is found again for more rows, it begins with such a part of the time left to gain, slacks of
# these rows no less than a part of w.
AGAIN = cython.declare(cython.double, 0.05)
LEAST = cython.declare(cython.double, 0.005)


@cython.cclass
class Steps:
    """Newton steps of one clock, and what is kept from one to the next.

    `rows` (R, 13): three factors of c; of both sides n and t, their last changes, and 1 / t. Those with the
    same w are a group (G): its rows are from `first` (G + 1,) on, `of` (G,) is its cell, rising, and
    `weights` (G, 4) say which part of c is its b, none where w is 1, and what w is. What a step has changed
    is part of n and t in the next: the part `primal` of t, `dual` of n.

    Steps change what belongs to the cells begins..ends - 1, with the groups group..last_group - 1, and there
    the coefficients least..most - 1, which no other cell sees.
    """

    cells: cython.Py_ssize_t
    fixed: cython.Py_ssize_t
    of: cython.Py_ssize_t[::1]
    first: cython.Py_ssize_t[::1]
    weights: cython.double[:, ::1]
    rows: cython.double[:, ::1]
    band: cython.double[:, ::1]
    vectors: cython.double[:, ::1]
    begins: cython.Py_ssize_t
    ends: cython.Py_ssize_t
    group: cython.Py_ssize_t
    last_group: cython.Py_ssize_t
    least: cython.Py_ssize_t
    most: cython.Py_ssize_t
    gap: cython.double
    far: cython.double
    time: cython.double
    primal: cython.double
    dual: cython.double

    def __init__(self, given: Rows, fixed: int) -> None:
        """The problem of a chain with these rows, whose first coefficients, none or two, are `fixed`."""
        self.cells, self.fixed = given.bounds.cells, fixed
        self.of, self.first, self.weights, self.rows = packed(given, fixed)
        if given.cuts.shape[0] > 0:
            self._merge(np.asarray(given.cuts))
        self.band, self.vectors = np.empty((self.cells + 2, 3)), np.empty((2, self.cells + 2))
        self.primal = self.dual = 0.0

    @cython.cfunc
    def _look_at(self, begins: cython.Py_ssize_t, ends: cython.Py_ssize_t) -> cython.void:
        """Let steps change what belongs to these cells alone."""
        self.begins, self.ends = begins, ends
        self.least = begins + 2 if begins > 0 else self.fixed
        self.most = ends if ends < self.cells else ends + 2
        self.group, self.last_group = self._first_of(begins), self._first_of(ends)

    @cython.cfunc
    def _first_of(self, cell: cython.Py_ssize_t) -> cython.Py_ssize_t:
        """The first group of a cell or of those behind it."""
        low: cython.Py_ssize_t = 0
        high: cython.Py_ssize_t = self.of.shape[0]
        while low < high:
            middle = (low + high) // 2
            if self.of[middle] < cell:
                low = middle + 1
            else:
                high = middle
        return low

    def begin(self, c: cython.double[::1], mu: cython.double, least: cython.double) -> None:
        """Slacks as they are at c (N + 2,), but not below a part of w, and multipliers that let `mu` times
        the mean time of a cell be left to gain at each."""
        self._look_at(0, self.cells)
        self._take_time(c)
        mu *= self.time / self.cells
        self.gap = self.far = self.primal = self.dual = 0.0
        for g in range(self.of.shape[0]):
            self._meet(c, g, mu, least)

    @cython.cfunc
    def _take_time(self, c: cython.double[::1]) -> cython.void:
        self.time = 0.0
        for k in range(self.begins, self.ends):
            self.time += 1.0 / sqrt((c[k] + 6.0 * c[k + 1] + c[k + 2]) * 0.125)

    def add(self, cuts: NDArray[np.float64], c: cython.double[::1], idle: cython.double) -> None:
        """Take up more cuts (M, 7), see `Rows`, which steps have not met yet, and leave out rows that are at
        less than a part of w."""
        self._settle()
        if idle > 0.0:
            self._leave_out(c, idle)
        self._merge(cuts)

    @cython.cfunc
    def _merge(self, cuts: NDArray[np.float64]) -> cython.void:
        self.of, self.first, self.weights, self.rows = merged(
            self.of, self.first, self.weights, self.rows, cuts
        )

    def go_on(self, c: cython.double[::1], begins: cython.Py_ssize_t, ends: cython.Py_ssize_t) -> None:
        """Go on in the cells begins..ends - 1 from what was found for these before.

        All rows are brought to where the same is left to gain at each: nearer to its limit, none of them
        would let c go far."""
        t: cython.double
        mu: cython.double
        self._settle()
        self._look_at(begins, ends)
        self._take_time(c)
        mu = AGAIN * self.time / max(2.0 * (self.first[self.last_group] - self.first[self.group]), 1.0)
        self.gap = self.far = 0.0
        for g in range(self.group, self.last_group):
            for r in range(self.first[g], self.first[g + 1]):
                if self.rows[r, 3] < 0.0:
                    # A cut is met for the first time.
                    self._meet(c, g, mu, LEAST)
                    continue
                for f in range(2):
                    n, t = self.rows[r, 3 + f], self.rows[r, 5 + f]
                    if n * t < mu:
                        if n * self.weights[g, 3] < t:
                            n = mu / t
                        else:
                            self.far = max(self.far, mu / n - t)
                            t = mu / n
                        self.rows[r, 3 + f], self.rows[r, 5 + f] = n, t
                    self.gap += n * t

    @cython.cfunc
    def _meet(
        self, c: cython.double[::1], g: cython.Py_ssize_t, mu: cython.double, least: cython.double
    ) -> cython.void:
        """Slacks of a group as they are at c, but not below a part of w, and multipliers by which mu is left
        to gain at each."""
        y: cython.double
        t: cython.double
        k: cython.Py_ssize_t = self.of[g]
        w: cython.double = limit(self.weights, g, c, k)
        self.weights[g, 3] = w
        for r in range(self.first[g], self.first[g + 1]):
            y = self.rows[r, 0] * c[k] + self.rows[r, 1] * c[k + 1] + self.rows[r, 2] * c[k + 2]
            for f in range(2):
                t = max(w - y, least * w)
                self.rows[r, 3 + f], self.rows[r, 5 + f] = mu / t, t
                self.rows[r, 7 + f] = self.rows[r, 9 + f] = 0.0
                self.far = max(self.far, t - w + y)
                self.gap += mu
                y = -y

    def go(self, c: cython.double[::1], most: cython.Py_ssize_t, enough: cython.double) -> tuple[int, bool]:
        """Make at most so many steps of c (N + 2,), in place.

        Gives their number, and whether all limits are kept and less than a part of the time is left to gain:
        they aim at half of that at the least, since what is nearer to its limits lets c go less far.
        """
        done: cython.Py_ssize_t = 0
        step: cython.double[::1] = self.vectors[1]
        count: cython.double = max(2.0 * (self.first[self.last_group] - self.first[self.group]), 1.0)
        while done < most:
            mu = max(SIGMA * self.gap, 0.5 * enough * self.time) / count
            before = self.time
            self.time = assemble(
                self.of, self.first, self.weights, self.rows, c, mu, self.begins, self.ends, self.group,
                self.last_group, self.fixed, self.primal, self.dual, self.band, self.vectors[0],
            )  # fmt: skip
            if not solve(self.vectors[0], self.band, step, self.begins, self.ends + 2, self.least, self.most):
                self.primal = self.dual = 0.0
                return done, False
            self._changes(mu, c)
            for i in range(self.least, self.most):
                c[i] += self.primal * step[i]
            done += 1
            self.far *= 1.0 - self.primal
            if (
                self.gap <= enough * self.time
                and self.far <= PASSED
                and before - self.time <= FASTER * before
            ):
                return done, True
        return done, False

    @cython.cfunc
    def _settle(self) -> cython.void:
        """Let slacks and multipliers go what is left of the last step."""
        rows: cython.double[:, ::1] = self.rows
        if self.primal > 0.0:
            for r in range(self.first[self.group], self.first[self.last_group]):
                for f in range(2):
                    rows[r, 3 + f] += self.dual * rows[r, 7 + f]
                    rows[r, 5 + f] += self.primal * rows[r, 9 + f]
                    rows[r, 7 + f] = rows[r, 9 + f] = 0.0
        self.primal = self.dual = 0.0

    @cython.cfunc
    def _leave_out(self, c: cython.double[::1], idle: cython.double) -> cython.void:
        """Leave out rows that are at less than this part of w."""
        m: cython.Py_ssize_t = 0
        begins: cython.Py_ssize_t = 0
        rows: cython.double[:, ::1] = self.rows
        for g in range(self.of.shape[0]):
            ends = self.first[g + 1]
            k = self.of[g]
            w = limit(self.weights, g, c, k)
            for r in range(begins, ends):
                y = rows[r, 0] * c[k] + rows[r, 1] * c[k + 1] + rows[r, 2] * c[k + 2]
                if fabs(y) >= idle * w:
                    for f in range(rows.shape[1]):
                        rows[m, f] = rows[r, f]
                    m += 1
            begins = ends
            self.first[g + 1] = m

    @cython.cfunc
    def _changes(self, mu: cython.double, c: cython.double[::1]) -> cython.void:
        """Write how slacks and multipliers change in a step, how much of that they can go, and what is then
        left to gain."""
        n: cython.double
        t: cython.double
        y: cython.double
        w: cython.double
        dt: cython.double
        dn: cython.double
        a: cython.double = NEAR
        b: cython.double = 1.0 / NEAR
        # Sums of n t, n dt and dn dt. As dn t = mu - n dt - n t, that of dn t follows from them.
        gap: cython.double = 0.0
        slack: cython.double = 0.0
        both: cython.double = 0.0
        sides: cython.double = 2.0 * (self.first[self.last_group] - self.first[self.group])
        rows: cython.double[:, ::1] = self.rows
        weights: cython.double[:, ::1] = self.weights
        d: cython.double[::1] = self.vectors[1]
        for g in range(self.group, self.last_group):
            k = self.of[g]
            w = 0.0
            if weights[g, 1] > 0.0:
                w = weights[g, 3]
                y = weights[g, 0] * d[k] + weights[g, 1] * d[k + 1] + weights[g, 2] * d[k + 2]
                w *= -0.5 * w * w * y
            for r in range(self.first[g], self.first[g + 1]):
                y = rows[r, 0] * d[k] + rows[r, 1] * d[k + 1] + rows[r, 2] * d[k + 2]
                for f in range(2):
                    n, t, q = rows[r, 3 + f], rows[r, 5 + f], rows[r, 11 + f]
                    dt = rows[r, 9 + f] + w - y
                    dn = (mu - n * dt) * q - n
                    rows[r, 7 + f], rows[r, 9 + f] = dn, dt
                    gap += n * t
                    slack += n * dt
                    both += dn * dt
                    a = max(a, -dt * q)
                    if -dn * b > n:
                        b = -n / dn
                    y = -y
        a, b = NEAR / a, min(NEAR * b, 1.0)
        for i in range(self.least, self.most):
            if -a * d[i] > SLOWER * c[i]:
                a = -SLOWER * c[i] / d[i]
        self.primal, self.dual = a, b
        self.gap = gap + b * (sides * mu - slack - gap) + a * slack + a * b * both

"""The fastest speed profile along a path within velocity, acceleration and jerk limits; compiled by Cython.

The path coordinate x(theta) is a cubic B-spline over N segments; theta counts segments. The speed profile is
the squared rate b(theta) = (dtheta/dt)^2 in 1 / UNIT_S^2, a quadratic B-spline with coefficients c (N + 2,).
A joint with derivatives q', q'', q''' (rad) over theta has

    velocity q' sqrt(b),  acceleration q'' b + q' b' / 2,  jerk sqrt(b) (q''' b + 3/2 q'' b' + q' b'' / 2).

Each is divided by its limit and becomes a constraint, a row g: |g c| <= 1 for acceleration and squared
velocity, |g c| <= 1 / sqrt(b) for jerk. The tangent of the convex 1 / sqrt(b) lies below it, so a step that
keeps the tangent keeps the limit. A primal-dual interior-point method (Boyd and Vandenberghe, "Convex
Optimization", 11.7) minimises the duration. It knows few rows; a check of all samples adds rows where a limit
is exceeded, and the method goes on.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.iiwa_sim.motion.queue.chain_kernel import JointPath
from cython.cimports.iiwa_sim.motion.queue.shapes_kernel import part_at, spline
from cython.cimports.iiwa_sim.motion.timing.run_kernel import root
from cython.cimports.libc.math import fabs, sqrt

UNIT_S = 0.01
_UNIT_S = cython.declare(cython.double, UNIT_S)
# Even samples of a smooth segment, and of one in a blend, with edges of the path, or among the ENDS first and
# last ones; a curved path has one more for each LONG of x, at most MOST.
SMOOTH, DENSE = cython.declare(cython.Py_ssize_t, 4), cython.declare(cython.Py_ssize_t, 7)
ENDS, LONG = cython.declare(cython.Py_ssize_t, 3), cython.declare(cython.double, 0.0101)
MOST = cython.declare(cython.Py_ssize_t, 20)
# Parts of limits: velocity, and others, that pass the check; what added rows divide by; an old profile's.
VELOCITY, TOLERANCE = cython.declare(cython.double, 1.0003), cython.declare(cython.double, 1.004)
STRICTER, KEPT = cython.declare(cython.double, 1.001), cython.declare(cython.double, 0.9998)
ROUNDS = cython.declare(cython.Py_ssize_t, 8)  # most times that rows are added
ACCEPTED = cython.declare(cython.double, 1.002)  # excess after the last of them
# First guess: part of an even pace, most over the nominal one; segments of a mean; how an old pace fades.
PACE, FASTEST = cython.declare(cython.double, 0.98), cython.declare(cython.double, 1.18)
SPAN = cython.declare(cython.Py_ssize_t, 8)
FADE, LEAST = cython.declare(cython.double, 0.8187307530779818), cython.declare(cython.double, 0.2)
# Steps: part of the gap that they aim at, part of the distance to a bound that they go, most of a round.
CENTERING, NEAR = cython.declare(cython.double, 0.2), cython.declare(cython.double, 0.98)
STEPS = cython.declare(cython.Py_ssize_t, 40)
# A round begins with a gap for each segment (part of the duration) and a least slack (part of the bound).
COLD_GAP, COLD_SLACK = cython.declare(cython.double, 0.1), cython.declare(cython.double, 0.2)
WARM_GAP, WARM_SLACK = cython.declare(cython.double, 0.004), cython.declare(cython.double, 0.005)
TIE = cython.declare(cython.double, 20.0)  # pulls the outermost coefficients to those beside them
HELD = cython.declare(cython.double, 1e30)  # of coefficients that stay
SAMPLE_COST = cython.declare(cython.Py_ssize_t, 2)  # in interior-point steps of a segment, some 0.2 us


@cython.cclass
class SpeedProfile:
    """Speed profile of a path. Call `sample` until done, `guess`, `begin`, and `advance` until done.

    `factor` (samples, 6, n) is q' of velocity; q'', q'/2 of acceleration; q''', 3/2 q'', q'/2 of jerk, over
    their limits. A group is rows with the same bound: velocity and acceleration of a segment, or jerk at a
    place. A row has a slack s and a multiplier z for either sign.
    """

    keeps_limits = cython.declare(cython.bint, visibility="readonly")
    path: JointPath
    x: cython.double[::1]  # (N + 3,)
    c: cython.double[::1]
    joints: cython.Py_ssize_t
    count: cython.Py_ssize_t  # N
    fixed: cython.Py_ssize_t  # first coefficients that stay
    kept: cython.Py_ssize_t  # first segments whose old profile is known
    # Samples
    at: cython.Py_ssize_t  # next segment to sample or to check
    move: cython.Py_ssize_t
    corner: cython.Py_ssize_t
    sampled_x: cython.double  # for which the path was asked last
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

    def __init__(self, path: JointPath, x: cython.double[::1], old: cython.double[::1], kept: int) -> None:
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
        self.corner = -2

    @cython.cfunc
    def _count_samples(self) -> cython.Py_ssize_t:
        """Write the first sample and the first edge of each segment. Return the number of samples."""
        path: JointPath = self.path
        x1: cython.double = spline(self.x, 0, 0.0)
        move: cython.Py_ssize_t = 0
        e: cython.Py_ssize_t = 0
        while e < path.edges.shape[0] and path.edges[e] < x1:
            e += 1
        self.edge[0] = e
        for k in range(self.count):
            x0, x1, n = x1, spline(self.x, k, 1.0), SMOOTH
            move = path.find(x0, move)
            while e < path.edges.shape[0] and path.edges[e] < x1:
                e += 1
            self.edge[k + 1] = e
            marks = e - self.edge[k]
            if marks > 0 or k < ENDS or k >= self.count - ENDS or path.corner_at(x0, move) >= 0:
                n = DENSE
            elif x1 > x0 and not path.is_straight(move):
                n += cython.cast(cython.Py_ssize_t, min((x1 - x0) / LONG, 1.0 * MOST))
            self.first[k + 1] = self.first[k] + n + marks
        return self.first[self.count]

    @property
    def coefficients(self) -> np.ndarray:
        return np.asarray(self.c)

    @property
    def finite(self) -> bool:
        """Whether all derivatives of the path are numbers."""
        return bool(np.isfinite(np.asarray(self.factor).sum()))

    def sample(self, budget: cython.Py_ssize_t) -> bool:
        """Sample the path and write rows until a budget (see SAMPLE_COST) is spent; True when all is done."""
        path: JointPath = self.path
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
        path: JointPath = self.path
        x: cython.double[::1] = self.x
        f: cython.double[:, :, ::1] = self.factor
        x3: cython.double = x[k + 3] - 3.0 * x[k + 2] + 3.0 * x[k + 1] - x[k]
        x2: cython.double = x[k + 2] - 2.0 * x[k + 1] + x[k] + u * x3
        x1: cython.double = 0.5 * (x[k + 2] - x[k]) + u * (x2 - 0.5 * u * x3)
        at_x: cython.double = min(max(spline(x, k, u), path.first_x), path.end_x)
        if at_x != self.sampled_x:
            move = path.find(at_x, self.move)
            corner = path.at(at_x, move, 3)
            if move != self.move or corner != self.corner:
                y = 1.0
                for o in range(3):
                    y *= _UNIT_S
                    for i in range(self.joints):
                        self.per_limit[o, i] = 1.0 / (y * path.limit(move, corner, o, i))
            self.move, self.corner, self.sampled_x = move, corner, at_x
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
        """Write the even pace of a segment of n even samples, and its rows: velocity and acceleration at the
        beginning, velocity inside, which damps swings of the profile, and jerk at both ends."""
        square: cython.double = 1e-6
        cube: cython.double = 1e-18
        p: cython.Py_ssize_t = self.first[k]
        f: cython.double[:, :, ::1] = self.factor
        for o in range(p, self.first[k + 1]):
            for i in range(self.joints):
                square = max(square, f[o, 0, i] * f[o, 0, i], fabs(f[o, 1, i]))
                cube = max(cube, fabs(f[o, 3, i]))
        cube = root(cube)
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

    @cython.locals(y=cython.double, first=cython.double, second=cython.double, fade=cython.double)
    def guess(self, durations: cython.double[::1]) -> None:
        """Write a first guess over the last segments, of nominal durations (M,) in UNIT_S.

        It is the least even pace near each segment, averaged, and goes on from the rate before it.
        """
        m: cython.Py_ssize_t = durations.shape[0]
        n: cython.Py_ssize_t = self.count - m
        pace: cython.double[:, ::1] = np.empty((2, m))
        for k in range(m):
            pace[0, k] = FASTEST
            for i in range(max(k - SPAN, 0), min(k + SPAN + 1, m)):
                pace[0, k] = min(pace[0, k], PACE * self.even[n + i] * durations[i] * durations[i])
        for e in range(2):
            for k in range(m):
                y = 0.0
                for i in range(k - SPAN // 2, k + SPAN // 2 + 1):
                    y += pace[e, min(max(i, 0), m - 1)]
                pace[1 - e, k] = y / (SPAN // 2 * 2 + 1)
        first, second, fade = 0.0, 0.0, 1.0
        if self.fixed > 0:
            y = 2.0 * durations[0] - durations[min(1, m - 1)]
            first = self.c[n] * y * y / pace[0, 0] - 1.0
            second = (self.c[n + 1] * durations[0] * durations[0] / pace[0, 0] - 1.0) / FADE
            fade = FADE * FADE
        for k in range(self.fixed, m + 2):
            i = min(max(k - 1, 0), m - 1)
            y = max(1.0 + (first + (second - first) * k) * fade, LEAST)
            self.c[n + k] = pace[0, i] / (durations[i] * durations[i]) * y
            fade *= FADE

    def begin(self, enough: cython.double) -> None:
        """Begin to solve from c, within limits or not. `enough` is the duality gap that ends a round, as a
        part of the duration; a profile mostly loses a tenth of it."""
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
                budget -= self._check(self.at, True)
                self.at += 1
            if self.at == self.count:
                self.rounds += 1
                if self.excess > 1.0 and self.rounds <= ROUNDS:
                    self._restart(WARM_GAP, WARM_SLACK)
                else:
                    self._end()
        return bool(self.rounds > ROUNDS)

    def slow_down(self) -> None:
        """Slow all of a profile from rest to rest down to its limits."""
        self.excess = 1.0
        for k in range(self.count):
            self._check(k, False)
        self._end()

    @cython.cfunc
    def _end(self) -> cython.void:
        """Take the profile as it is; one from rest to rest is slowed down by the excess."""
        self.rounds = ROUNDS + 1
        self.keeps_limits = self.excess < ACCEPTED or self.fixed == 0
        if self.fixed == 0:
            for k in range(self.count + 2):
                self.c[k] /= self.excess

    @cython.cfunc
    def _check(self, k: cython.Py_ssize_t, adds: cython.bint) -> cython.Py_ssize_t:
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
                self.excess = max(self.excess, y if o == 1 else y * y if o == 0 else root(y * y))
                if adds:
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
            self.rounds, self.keeps_limits = ROUNDS + 1, False
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

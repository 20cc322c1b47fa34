"""Joint positions of a chain over time, in loops; compiled by Cython.

x is a cubic B-spline over theta, which counts cells, and theta goes with time as b(theta) =
(dtheta/dt)^2 says, a quadratic B-spline over the same cells.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

import cython
from cython.cimports.libc.math import fabs, sqrt

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.queue.chain_kernel import JointPath
    from cython.cimports.iiwa_sim.motion.queue.shapes_kernel import part_at, spline
else:
    from iiwa_sim.motion.queue.chain_kernel import JointPath
    from iiwa_sim.motion.queue.shapes_kernel import part_at, spline

_SMALL = cython.declare(cython.double, 0.05)
# Number of terms of the series that is taken up to there.
_TERMS = cython.declare(cython.int, 12)
_SLIGHT = cython.declare(cython.double, 0.1)
# Number of terms of the inverse's series that is taken up to there.
_FEW_TERMS = cython.declare(cython.int, 6)
_HALVINGS = cython.declare(cython.int, 60)


@cython.cfunc
@cython.exceptval(check=False)
def _time(c0: cython.double, c1: cython.double, c2: cython.double, u: cython.double) -> cython.double:
    """The time from the beginning of a cell to its part u (0 to 1): exact, also where b nearly comes to 0.

    With r = sqrt(b) and s = r(0) + r(u), the integral of 1 / r is 2 u / s times atanh(x) / x with x^2 = w =
    d2b/dtheta2 u^2 / (2 s^2); or atan, where w < 0.
    """
    s: cython.double = sqrt(_b(c0, c1, c2, 0.0)) + sqrt(_b(c0, c1, c2, u))
    w: cython.double = 0.5 * (c0 - 2.0 * c1 + c2) * u * u / (s * s)
    part: cython.double = 2.0 * u / s
    total: cython.double = 1.0 / (2.0 * _TERMS + 1.0)
    for _ in range(_HALVINGS):
        if -_SMALL < w < _SMALL:
            break
        # atanh(x) = 2 atanh(x / (1 + sqrt(1 - x^2)))
        s = 1.0 + sqrt(max(1.0 - w, 0.0))
        part *= 2.0 / s
        w /= s * s
    for k in range(_TERMS - 1, -1, -1):
        total = total * w + 1.0 / (2.0 * k + 1.0)
    return part * total


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _b(c0: cython.double, c1: cython.double, c2: cython.double, u: cython.double) -> cython.double:
    return 0.5 * (c0 + c1) + u * (c1 - c0) + 0.5 * u * u * (c0 - 2.0 * c1 + c2)


@cython.cfunc
@cython.exceptval(check=False)
def _part(c0: cython.double, c1: cython.double, c2: cython.double, left: cython.double) -> cython.double:
    """The part of a cell (0..1) that is done at a time after its beginning: the inverse of `_time`.

    With (du/dt)^2 = b, d2u/dt2 is half of db/du, which is linear in u: u is r(0) t sinh(x) / x and a part of
    db/du t^2 (cosh(x) - 1) / x^2, with x^2 = w = d2b/du2 t^2 / 2. Where b comes near to 0 within the cell
    that would be a difference of large numbers: there u is looked for.
    """
    w: cython.double = 0.5 * (c0 - 2.0 * c1 + c2) * left * left
    odd: cython.double = 1.0
    even: cython.double = 1.0
    if -_SLIGHT < w < _SLIGHT:
        for k in range(_FEW_TERMS, 0, -1):
            odd = 1.0 + odd * (w / (2.0 * k * (2.0 * k + 1.0)))
            even = 1.0 + even * (w / ((2.0 * k + 1.0) * (2.0 * k + 2.0)))
        u = sqrt(_b(c0, c1, c2, 0.0)) * left * odd + 0.25 * (c1 - c0) * left * left * even
        return min(max(u, 0.0), 1.0)
    u = left * sqrt(_b(c0, c1, c2, 0.5))
    for _ in range(20):
        u = min(max(u, 0.0), 1.0)
        b = _b(c0, c1, c2, u)
        step = (_time(c0, c1, c2, u) - left) * sqrt(b)
        u -= step
        if fabs(step) < 1e-14:
            break
    return min(max(u, 0.0), 1.0)


def add_times(c: cython.double[::1], times: cython.double[::1]) -> cython.void:
    """Write times (N + 1,) of the knots, from that of the first one on, which is given."""
    for k in range(times.shape[0] - 1):
        times[k + 1] = times[k] + _time(c[k], c[k + 1], c[k + 2], 1.0)


@cython.cclass
class Motion:
    """Where a chain is when. It remembers the cell it was in last: times close to each other cost least."""

    way: JointPath
    controls: cython.double[::1]
    clock: cython.double[::1]
    times: cython.double[::1]
    unit: cython.double
    cell: cython.Py_ssize_t
    part: cython.double
    move: cython.Py_ssize_t
    speed: cython.double
    acceleration: cython.double
    jerk: cython.double

    def __init__(
        self,
        way: JointPath,
        controls: cython.double[::1],
        clock: cython.double[::1],
        times: cython.double[::1],
        unit: cython.double,
    ) -> None:
        """`controls` (N + 3,) of x, `clock` (N + 2,) of b; `times` (N + 1,) of the knots are in s, `unit` is
        the unit of time of the clock in s."""
        self.way, self.controls, self.clock, self.times, self.unit = way, controls, clock, times, unit
        self.cell = self.move = 0
        self.part = 0.0
        self.speed = self.acceleration = self.jerk = 0.0  # of x, where it was looked at last

    @cython.cfunc
    @cython.exceptval(check=False)
    def _go_to(self, time_s: cython.double) -> cython.void:
        """Find the cell, and the part of it (0..1), in which the clock is at a time."""
        last: cython.Py_ssize_t = self.times.shape[0] - 2
        low: cython.Py_ssize_t = 0
        high: cython.Py_ssize_t = last
        k: cython.Py_ssize_t = self.cell
        if not (self.times[k] <= time_s and (k == last or time_s < self.times[k + 1])):
            if k < last and self.times[k + 1] <= time_s and (k + 1 == last or time_s < self.times[k + 2]):
                k += 1
            else:
                while low < high:
                    k = (low + high + 1) // 2
                    if self.times[k] <= time_s:
                        low = k
                    else:
                        high = k - 1
                k = low
        self.cell = k
        self.part = _part(
            self.clock[k], self.clock[k + 1], self.clock[k + 2], (time_s - self.times[k]) / self.unit
        )

    @cython.ccall
    def x(self, time_s: cython.double) -> cython.double:
        """x, the place on its course, at a time (s)."""
        self._go_to(min(max(time_s, self.times[0]), self.times[self.times.shape[0] - 1]))
        return min(max(spline(self.controls, self.cell, self.part), self.way.first_x), self.way.end_x)

    @cython.ccall
    def move_at(self, time_s: cython.double) -> cython.Py_ssize_t:
        """The move on which that is: of two in a corner the second from where the corner stands for the
        target."""
        self.move = self.way.find(self.x(time_s), self.move)
        return self.move

    def joints_along(self, times: cython.double[::1], found: cython.double[:, ::1]) -> None:
        """Write joint positions (m, n) at times (m,)."""
        for p in range(times.shape[0]):
            x = self.x(times[p])
            self.move = self.way.find(x, self.move)
            self.way.at(x, self.move, 0)
            for i in range(self.way.joint_count):
                found[p, i] = self.way.here[0, 0, i]

    @cython.cfunc
    @cython.exceptval(check=False)
    def _derive(self, k: cython.Py_ssize_t, u: cython.double) -> cython.Py_ssize_t:
        """Find q and its derivatives over x, and those of x over time, at a part of a cell. Gives the corner
        it is in, or -1."""
        x3: cython.double = self.controls[k + 3] - 3.0 * self.controls[k + 2] + 3.0 * self.controls[k + 1]
        dd: cython.double = self.clock[k] - 2.0 * self.clock[k + 1] + self.clock[k + 2]
        d: cython.double = self.clock[k + 1] - self.clock[k] + u * dd
        b: cython.double = _b(self.clock[k], self.clock[k + 1], self.clock[k + 2], u)
        rate: cython.double = sqrt(b) / self.unit
        x: cython.double = min(max(spline(self.controls, k, u), self.way.first_x), self.way.end_x)
        x3 -= self.controls[k]
        x2 = self.controls[k + 2] - 2.0 * self.controls[k + 1] + self.controls[k] + u * x3
        x1 = 0.5 * (self.controls[k + 2] - self.controls[k]) + u * (x2 - 0.5 * u * x3)
        self.speed = rate * x1
        self.acceleration = (b * x2 + 0.5 * d * x1) / (self.unit * self.unit)
        self.jerk = rate * (b * x3 + 1.5 * d * x2 + 0.5 * dd * x1) / (self.unit * self.unit)
        self.move = self.way.find(x, self.move)
        return self.way.at(x, self.move, 3)

    @cython.cfunc
    @cython.exceptval(check=False)
    def _jerk(self, i: cython.Py_ssize_t) -> cython.double:
        """The jerk of a joint over time, at the place that `_derive` has looked at last."""
        v: cython.double = self.speed
        j: cython.double = self.way.here[3, 0, i] * v * v * v
        return j + 3.0 * self.way.here[2, 0, i] * v * self.acceleration + self.way.here[1, 0, i] * self.jerk

    def along(
        self,
        times: cython.double[::1],
        found: cython.double[:, :, ::1],
        limits: cython.double[:, :, ::1],
    ) -> None:
        """Write joint positions and their derivatives over time (m, 4, n) at times (m,), and the limits that
        hold there (m, 3, n). Before the first knot and from the last one on the robot rests."""
        for p in range(times.shape[0]):
            self.x(times[p])
            c = self._derive(self.cell, self.part)
            if times[p] < self.times[0] or times[p] >= self.times[self.times.shape[0] - 1]:
                self.speed = self.acceleration = self.jerk = 0.0
            v = self.speed
            for i in range(self.way.joint_count):
                found[p, 0, i] = self.way.here[0, 0, i]
                found[p, 1, i] = self.way.here[1, 0, i] * v
                found[p, 2, i] = self.way.here[2, 0, i] * v * v + self.way.here[1, 0, i] * self.acceleration
                found[p, 3, i] = self._jerk(i)
                limits[p, 0, i] = self.way.limit(self.move, c, 0, i)
                limits[p, 1, i] = self.way.limit(self.move, c, 1, i)
                limits[p, 2, i] = self.way.limit(self.move, c, 2, i)

    @cython.cfunc
    @cython.exceptval(check=False)
    def _widen(
        self,
        k: cython.Py_ssize_t,
        u: cython.double,
        p: cython.Py_ssize_t,
        least: cython.double[:, ::1],
        largest: cython.double[:, ::1],
    ) -> cython.void:
        """Widen the range of jerks in row p, of each joint, by those at a part of a cell."""
        self._derive(k, u)
        for i in range(self.way.joint_count):
            y = self._jerk(i)
            least[p, i] = min(least[p, i], y)
            largest[p, i] = max(largest[p, i], y)

    def jerks(
        self, times: cython.double[::1], least: cython.double[:, ::1], largest: cython.double[:, ::1]
    ) -> None:
        """Write the least and the largest jerks (m - 1, n) from each of rising times (m,) to the next.

        They are looked for at these times, on both sides of knots, and at the marks of corners.
        """
        marks = self.way.edges
        e: cython.Py_ssize_t = 0
        for p in range(times.shape[0] - 1):
            for i in range(self.way.joint_count):
                least[p, i] = largest[p, i] = 0.0
            if times[p + 1] <= self.times[0] or times[p] >= self.times[self.times.shape[0] - 1]:
                continue
            end_x = self.x(times[p + 1])
            last, part = self.cell, self.part
            x = self.x(times[p])
            k = self.cell
            self._derive(k, self.part)
            for i in range(self.way.joint_count):
                least[p, i] = largest[p, i] = self._jerk(i)
            while e < marks.shape[0] and marks[e] <= x:
                e += 1
            while e < marks.shape[0] and marks[e] < end_x:
                while k < last and spline(self.controls, k, 1.0) < marks[e]:
                    k += 1
                self._widen(k, part_at(self.controls, k, marks[e]), p, least, largest)
                e += 1
            for k in range(self.cell, last):
                self._widen(k, 1.0, p, least, largest)
                self._widen(k + 1, 0.0, p, least, largest)
            self._widen(last, part, p, least, largest)

"""The fastest run along a path without jerk limits, and its moving average; compiled by Cython.

x is where on the path: samples (m,) rising. A run is when (`times`) and how fast (`speeds`, dx/dt) it
passes them; between samples its acceleration d2x/dt2 is constant. All arrays are C-contiguous float64.
"""

# mypy: allow-untyped-decorators

import cython
from cython.cimports.libc.math import fabs, sqrt

# A joint that goes less than this per unit of x (rad) bounds nothing.
STILL = cython.declare(cython.double, 1e-9)
SLOWEST = cython.declare(cython.double, 1e-9)
CREEP = cython.declare(cython.double, 1e-12)
# A loop scales numbers between these two.
LEAST = cython.declare(cython.double, 1e-300)
LARGEST = cython.declare(cython.double, 1e300)


@cython.cfunc
@cython.exceptval(check=False)
def root(x: cython.double) -> cython.double:
    """The cube root of x > 0, by operations that give the same bits on all machines."""
    scale: cython.double = 1.0
    y: cython.double = 1.0
    if x > LARGEST:
        x = LARGEST
    if x < LEAST:
        x = LEAST
    while x > 8.0:
        x *= 0.125
        scale *= 2.0
    while x < 1.0:
        x *= 8.0
        scale *= 0.5
    for _ in range(7):
        y = (2.0 * y + x / (y * y)) / 3.0
    return scale * y


def rest_to_rest(
    way: cython.double,
    velocity: cython.double,
    acceleration: cython.double,
    jerk: cython.double,
    times: cython.double[::1],
    jerks: cython.double[::1],
) -> float:
    """The fastest motion from rest to rest over a way, within limits of velocity, acceleration and jerk.

    Writes how long each of its seven phases lasts and which jerk it has, (7,) each; gives the whole time."""
    building: cython.double = acceleration / jerk
    rest: cython.double = 0.0
    total: cython.double = 0.0
    if velocity < acceleration * building:
        building = sqrt(velocity / jerk)
    even = max(velocity / (building * jerk) - building, 0.0)
    if velocity * (2.0 * building + even) <= way:
        rest = way / velocity - (2.0 * building + even)
    else:
        # It does not come to its velocity: what it comes to with full acceleration, or not even that.
        building = acceleration / jerk
        even = 0.5 * (sqrt(building * building + 4.0 * way / acceleration) - 3.0 * building)
        if even < 0.0:
            even = 0.0
            building = root(0.5 * way / jerk)
    for k in range(7):
        times[k] = rest if k == 3 else even if k % 4 == 1 else building
        jerks[k] = jerk if k == 0 or k == 6 else -jerk if k == 2 or k == 4 else 0.0
        total += times[k]
    return float(total)


def phases(
    times: cython.double[::1],
    jerks: cython.double[::1],
    at: cython.double[::1],
    motion: cython.double[:, ::1],
) -> None:
    """Write a motion from rest at 0 through phases that last so long (7,) at constant jerks (7,): where it is
    at rising times `at` (p,), and its first two derivatives (p, 3)."""
    k: cython.Py_ssize_t = 0
    begins: cython.double = 0.0
    x: cython.double = 0.0
    v: cython.double = 0.0
    a: cython.double = 0.0
    for p in range(at.shape[0]):
        while k < times.shape[0] - 1 and begins + times[k] <= at[p]:
            t, j = times[k], jerks[k]
            x += t * (v + t * (0.5 * a + t * j / 6.0))
            v += t * (a + 0.5 * t * j)
            a += t * j
            begins += t
            k += 1
        t, j = at[p] - begins, jerks[k]
        motion[p, 0] = x + t * (v + t * (0.5 * a + t * j / 6.0))
        motion[p, 1] = v + t * (a + 0.5 * t * j)
        motion[p, 2] = a + t * j


def caps(
    derivatives: cython.double[:, :, ::1],
    limits: cython.double[:, :, ::1],
    squares: cython.double[::1],
) -> cython.void:
    """Write the largest (dx/dt)^2 at samples (m,) that velocities, accelerations and jerks allow at an even
    speed.

    Where a joint turns back between two samples, the acceleration that bends its path is all there is: what a
    change of speed would add to it at either sample, the other one takes away.

    `derivatives` (m, 4, n) are q, dq/dx, d2q/dx2, d3q/dx3; `limits` (m, 3, n) those of velocity, acceleration
    and jerk.
    """
    m: cython.Py_ssize_t = derivatives.shape[0]
    n: cython.Py_ssize_t = derivatives.shape[2]
    cap: cython.double
    y: cython.double
    for k in range(m):
        cap = 1e12
        for i in range(n):
            rate = fabs(derivatives[k, 1, i])
            if rate > STILL:
                y = limits[k, 0, i] / rate
                if y * y < cap:
                    cap = y * y
            y = fabs(derivatives[k, 2, i])
            if y * cap > limits[k, 1, i]:
                cap = limits[k, 1, i] / y
            y = fabs(derivatives[k, 3, i])
            if y * y * cap * cap * cap > limits[k, 2, i] * limits[k, 2, i]:
                y = root(limits[k, 2, i] / y)
                cap = y * y
        squares[k] = cap


@cython.cfunc
@cython.exceptval(check=False)
def _room(
    derivatives: cython.double[:, :, ::1],
    limits: cython.double[:, :, ::1],
    k: cython.Py_ssize_t,
    square: cython.double,
    sign: cython.double,
) -> cython.double:
    """The largest d2x/dt2 (sign 1), or what braking allows (sign -1), at a sample at this (dx/dt)^2."""
    y: cython.double
    room: cython.double = 1e12
    for i in range(derivatives.shape[2]):
        rate = derivatives[k, 1, i]
        if fabs(rate) <= STILL:
            continue
        y = derivatives[k, 2, i] * square * sign
        y = (limits[k, 1, i] - y) / rate if rate > 0.0 else (limits[k, 1, i] + y) / -rate
        if y < room:
            room = y
    return room


def run(
    x: cython.double[::1],
    derivatives: cython.double[:, :, ::1],
    limits: cython.double[:, :, ::1],
    squares: cython.double[::1],
    start_s: cython.double,
    start_speed: cython.double,
    speeds: cython.double[::1],
    times: cython.double[::1],
) -> cython.void:
    """Write the fastest run that passes the first sample at a time with a speed, and rests at the last one.

    `squares` (m,) are those of `caps`. Where the speed is too high to keep them all, it brakes as it can.
    """
    m: cython.Py_ssize_t = x.shape[0]
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
        y = b + 2.0 * width * _room(derivatives, limits, k, b, 1.0)
        if y > speeds[k + 1]:
            y = speeds[k + 1]
            if b > squares[k]:
                # Too fast already: no more braking than a joint can do at the least.
                width = b - 2.0 * width * _room(derivatives, limits, k, 0.0, -1.0)
                if width > y:
                    y = width
        b = max(0.0, y)
    speeds[m - 1] = b if b > 1e-18 else 0.0
    times[0] = start_s
    for k in range(m):
        speeds[k] = sqrt(speeds[k])
        if k > 0:
            y = speeds[k] + speeds[k - 1]
            times[k] = times[k - 1] + 2.0 * (x[k] - x[k - 1]) / (max(SLOWEST, y))


@cython.cfunc
@cython.exceptval(check=False)
def _area(
    x: cython.double[::1],
    speeds: cython.double[::1],
    times: cython.double[::1],
    areas: cython.double[::1],
    k: cython.Py_ssize_t,
    t: cython.double,
) -> cython.double:
    """The integral of x over time up to t, which is after the sample k and before the next."""
    left: cython.double = t - times[k]
    if k >= times.shape[0] - 1:
        return areas[k] + left * x[k]
    width = times[k + 1] - times[k]
    if width <= CREEP:
        return areas[k] + left * x[k]
    return areas[k] + left * (
        x[k] + left * (0.5 * speeds[k] + left * (speeds[k + 1] - speeds[k]) / (6.0 * width))
    )


def moving_average(
    x: cython.double[::1],
    speeds: cython.double[::1],
    times: cython.double[::1],
    areas: cython.double[::1],
    window: cython.double,
    at: cython.double[::1],
    mean: cython.double[:, ::1],
) -> cython.void:
    """Write the mean of x over the window before each of rising times `at` (p,), and its first two
    derivatives (p, 3).

    Before its first sample a run rests. `areas` (m,) is scratch.
    """
    m: cython.Py_ssize_t = times.shape[0]
    head: cython.Py_ssize_t = 0
    tail: cython.Py_ssize_t = 0
    areas[0] = 0.0
    for k in range(m - 1):
        areas[k + 1] = _area(x, speeds, times, areas, k, times[k + 1])
    for p in range(at.shape[0]):
        mean[p, 0] = 0.0
        mean[p, 1] = 0.0
        mean[p, 2] = 0.0
        for e in range(2):
            if e == 0:
                t = at[p]
                while head < m - 1 and times[head + 1] <= t:
                    head += 1
                k = head
                sign = 1.0 / window
            else:
                t = at[p] - window
                while tail < m - 1 and times[tail + 1] <= t:
                    tail += 1
                k = tail
                sign = -1.0 / window
            left = t - times[k]
            place = x[k]
            speed = 0.0
            if left < 0.0:
                area = left * place
            else:
                area = _area(x, speeds, times, areas, k, t)
                if k < m - 1 and times[k + 1] - times[k] > CREEP:
                    width = (speeds[k + 1] - speeds[k]) / (times[k + 1] - times[k])
                    speed = speeds[k] + left * width
                    place += left * (speeds[k] + 0.5 * left * width)
            mean[p, 0] += sign * area
            mean[p, 1] += sign * place
            mean[p, 2] += sign * speed

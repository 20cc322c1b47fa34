"""How near a clock comes to the limits, and when it passes the knots; compiled by Cython.

Rows, c and theta as in `clock_kernel`.
"""

# mypy: allow-untyped-decorators

import cython
from cython.cimports.libc.math import fabs, sqrt

MORE = cython.declare(cython.double, 1.04)  # a broken limit is widened by so much more than needed,
AND = cython.declare(cython.double, 2e-3)  # and this


def widened(
    a1: cython.double[:, ::1],
    a2: cython.double[:, ::1],
    cap: cython.double[::1],
    j1: cython.double[:, ::1],
    j2: cython.double[:, ::1],
    j3: cython.double[:, ::1],
    c: cython.double[::1],
    wide_a1: cython.double[:, ::1],
    wide_a2: cython.double[:, ::1],
    wide_cap: cython.double[::1],
    wide_j1: cython.double[:, ::1],
    wide_j2: cython.double[:, ::1],
    wide_j3: cython.double[:, ::1],
) -> float:
    """Write rows like the given ones, but so much wider, knot by knot and cell end by cell end, that c keeps
    them.

    Gives the largest load: below 1 all are as they were.
    """
    cells: cython.Py_ssize_t = j1.shape[0] // 2
    n: cython.Py_ssize_t = a1.shape[1]
    k: cython.Py_ssize_t
    i: cython.Py_ssize_t
    o: cython.Py_ssize_t
    b: cython.double
    d: cython.double
    dd: cython.double
    root: cython.double
    load: cython.double
    y: cython.double
    largest: cython.double = 0.0
    for k in range(cells + 1):
        b = 0.5 * (c[k] + c[k + 1])
        d = c[k + 1] - c[k]
        load = b / cap[k]
        for i in range(n):
            y = fabs(a2[k, i] * b + a1[k, i] * d)
            if y > load:
                load = y
        if load > largest:
            largest = load
        y = load * MORE + AND if load > 0.9998 else 1.0
        wide_cap[k] = cap[k] * y
        y = 1.0 / y
        for i in range(n):
            wide_a1[k, i] = a1[k, i] * y
            wide_a2[k, i] = a2[k, i] * y
    for o in range(2 * cells):
        k = o // 2
        dd = c[k] - 2.0 * c[k + 1] + c[k + 2]
        k += o % 2
        b = 0.5 * (c[k] + c[k + 1])
        d = c[k + 1] - c[k]
        root = sqrt(b)
        load = 0.0
        for i in range(n):
            y = root * fabs(j3[o, i] * b + j2[o, i] * d + j1[o, i] * dd)
            if y > load:
                load = y
        if load > largest:
            largest = load
        y = 1.0 / (load * MORE + AND) if load > 0.9998 else 1.0
        for i in range(n):
            wide_j1[o, i] = j1[o, i] * y
            wide_j2[o, i] = j2[o, i] * y
            wide_j3[o, i] = j3[o, i] * y
    return float(largest)


def steady_loads(
    a1: cython.double[:, ::1],
    a2: cython.double[:, ::1],
    cap: cython.double[::1],
    j1: cython.double[:, ::1],
    j2: cython.double[:, ::1],
    j3: cython.double[:, ::1],
    c: cython.double[::1],
) -> tuple[float, float]:
    """The largest load of velocities (squared) and accelerations, and that of jerks."""
    cells: cython.Py_ssize_t = j1.shape[0] // 2
    n: cython.Py_ssize_t = a1.shape[1]
    k: cython.Py_ssize_t
    i: cython.Py_ssize_t
    o: cython.Py_ssize_t
    b: cython.double
    d: cython.double
    dd: cython.double
    root: cython.double
    y: cython.double
    square: cython.double = 0.0
    cube: cython.double = 0.0
    for k in range(cells + 1):
        b = 0.5 * (c[k] + c[k + 1])
        d = c[k + 1] - c[k]
        if b / cap[k] > square:
            square = b / cap[k]
        for i in range(n):
            y = fabs(a2[k, i] * b + a1[k, i] * d)
            if y > square:
                square = y
    for o in range(2 * cells):
        k = o // 2
        dd = c[k] - 2.0 * c[k + 1] + c[k + 2]
        k += o % 2
        b = 0.5 * (c[k] + c[k + 1])
        d = c[k + 1] - c[k]
        root = sqrt(b)
        for i in range(n):
            y = root * fabs(j3[o, i] * b + j2[o, i] * d + j1[o, i] * dd)
            if y > cube:
                cube = y
    return square, cube


def inner_loads(
    inner: cython.double[:, :, ::1],
    cells: cython.Py_ssize_t[::1],
    parts: cython.double[::1],
    limits: cython.double[:, :, ::1],
    c: cython.double[::1],
    loads: cython.double[:, ::1],
) -> cython.void:
    """The largest velocity, acceleration and jerk over their limits in each cell (N, 3).

    `inner` (m, 3, n) are the first three derivatives of joints over theta at parts (m,) of cells (m,),
    `limits` (N, 3, n) of velocity, acceleration and jerk per cell, in the clock's unit of time.
    """
    n: cython.Py_ssize_t = inner.shape[2]
    k: cython.Py_ssize_t
    i: cython.Py_ssize_t
    o: cython.Py_ssize_t
    u: cython.double
    b: cython.double
    d: cython.double
    dd: cython.double
    root: cython.double
    y: cython.double
    for k in range(limits.shape[0]):
        loads[k, 0] = 0.0
        loads[k, 1] = 0.0
        loads[k, 2] = 0.0
    for o in range(inner.shape[0]):
        k = cells[o]
        u = parts[o]
        dd = c[k] - 2.0 * c[k + 1] + c[k + 2]
        d = (c[k + 1] - c[k]) + u * dd
        b = 0.5 * (c[k] + c[k + 1]) + u * (c[k + 1] - c[k]) + 0.5 * u * u * dd
        root = sqrt(b)
        for i in range(n):
            y = root * fabs(inner[o, 0, i]) / limits[k, 0, i]
            if y > loads[k, 0]:
                loads[k, 0] = y
            y = fabs(inner[o, 1, i] * b + 0.5 * inner[o, 0, i] * d) / limits[k, 1, i]
            if y > loads[k, 1]:
                loads[k, 1] = y
            y = inner[o, 2, i] * b + 1.5 * inner[o, 1, i] * d + 0.5 * inner[o, 0, i] * dd
            y = root * fabs(y) / limits[k, 2, i]
            if y > loads[k, 2]:
                loads[k, 2] = y


@cython.cfunc
@cython.exceptval(check=False)
def _time(c0: cython.double, c1: cython.double, c2: cython.double, u: cython.double) -> cython.double:
    """From the beginning of a cell to its part u, by Gauss' rule of six places."""
    return u * (
        0.08566224618958517 / sqrt(_b(c0, c1, c2, 0.033765242898423986 * u))
        + 0.1803807865240693 / sqrt(_b(c0, c1, c2, 0.1693953067668677 * u))
        + 0.23395696728634552 / sqrt(_b(c0, c1, c2, 0.38069040695840156 * u))
        + 0.23395696728634552 / sqrt(_b(c0, c1, c2, 0.6193095930415985 * u))
        + 0.1803807865240693 / sqrt(_b(c0, c1, c2, 0.8306046932331322 * u))
        + 0.08566224618958517 / sqrt(_b(c0, c1, c2, 0.966234757101576 * u))
    )


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _b(c0: cython.double, c1: cython.double, c2: cython.double, u: cython.double) -> cython.double:
    return 0.5 * (c0 + c1) + u * (c1 - c0) + 0.5 * u * u * (c0 - 2.0 * c1 + c2)


def add_times(c: cython.double[::1], times: cython.double[::1]) -> cython.void:
    """Write times (N + 1,) of the knots, from that of the first one on, which is given."""
    k: cython.Py_ssize_t
    for k in range(times.shape[0] - 1):
        times[k + 1] = times[k] + _time(c[k], c[k + 1], c[k + 2], 1.0)


def places(
    c: cython.double[::1],
    times: cython.double[::1],
    at: cython.double[::1],
    cells: cython.Py_ssize_t[::1],
    parts: cython.double[::1],
) -> cython.void:
    """Write in which cell, and which part of it (0..1), the clock is at rising times (m,); `times` (N + 1,)
    as by `add_times`."""
    last: cython.Py_ssize_t = times.shape[0] - 2
    low: cython.Py_ssize_t = 0
    high: cython.Py_ssize_t = last
    k: cython.Py_ssize_t
    p: cython.Py_ssize_t
    _: cython.int
    left: cython.double
    u: cython.double
    step: cython.double
    if at.shape[0] > 0:
        while low < high:
            k = (low + high + 1) // 2
            if times[k] <= at[0]:
                low = k
            else:
                high = k - 1
    k = low
    for p in range(at.shape[0]):
        while k < last and times[k + 1] <= at[p]:
            k += 1
        left = at[p] - times[k]
        u = left * sqrt(_b(c[k], c[k + 1], c[k + 2], 0.5))
        for _ in range(20):
            if u > 1.0:
                u = 1.0
            if u < 0.0:
                u = 0.0
            step = (_time(c[k], c[k + 1], c[k + 2], u) - left) * sqrt(_b(c[k], c[k + 1], c[k + 2], u))
            u -= step
            if fabs(step) < 1e-14:
                break
        if u > 1.0:
            u = 1.0
        if u < 0.0:
            u = 0.0
        cells[p] = k
        parts[p] = u

"""How near a clock comes to the limits; compiled by Cython.

Rows, c and theta as in `clock_kernel`.
"""

# mypy: allow-untyped-decorators

import cython
from cython.cimports.libc.math import fabs, sqrt

MORE = cython.declare(cython.double, 1.04)  # a broken limit is widened by so much more than needed,
AND = cython.declare(cython.double, 2e-3)  # and this
VELOCITY_MORE = cython.declare(cython.double, 1.001)
MOST_TIMES = cython.declare(cython.double, 2.0)
ALMOST = cython.declare(cython.double, 1.001)
LEAST_LOAD = cython.declare(cython.double, 0.4)


def widened(
    a1: cython.double[:, ::1],
    a2: cython.double[:, ::1],
    cap: cython.double[::1],
    j1: cython.double[:, ::1],
    j2: cython.double[:, ::1],
    j3: cython.double[:, ::1],
    counts: cython.Py_ssize_t[:, ::1],
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
        for i in range(counts[k, 0]):
            y = fabs(a2[k, i] * b + a1[k, i] * d)
            if y > load:
                load = y
        if load > largest:
            largest = load
        y = load * MORE + AND if load > 0.9998 else 1.0
        wide_cap[k] = cap[k] * y
        y = 1.0 / y
        for i in range(counts[k, 0]):
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
        for i in range(counts[o // 2, 1 + o % 2]):
            y = root * fabs(j3[o, i] * b + j2[o, i] * d + j1[o, i] * dd)
            if y > load:
                load = y
        if load > largest:
            largest = load
        y = 1.0 / (load * MORE + AND) if load > 0.9998 else 1.0
        for i in range(counts[o // 2, 1 + o % 2]):
            wide_j1[o, i] = j1[o, i] * y
            wide_j2[o, i] = j2[o, i] * y
            wide_j3[o, i] = j3[o, i] * y
    return float(largest)


def inner_loads(
    inner: cython.double[:, :, ::1],
    starts: cython.Py_ssize_t[::1],
    parts: cython.double[::1],
    per_limit: cython.double[:, :, ::1],
    c: cython.double[::1],
    loads: cython.double[:, ::1],
) -> None:
    """Write the largest velocity, acceleration and jerk over their limits in each cell (N, 3).

    `inner` (m, 3, n) are the first three derivatives of joints over theta at parts (m,) of cells, where
    those of the cell k are from `starts[k]` on; `per_limit` (N, 3, n) is 1 over limits, in the clock's unit
    of time.
    """
    k: cython.Py_ssize_t
    i: cython.Py_ssize_t
    o: cython.Py_ssize_t
    u: cython.double
    b: cython.double
    d: cython.double
    dd: cython.double
    root: cython.double
    y: cython.double
    velocity: cython.double
    acceleration: cython.double
    jerk: cython.double
    for k in range(per_limit.shape[0]):
        velocity = 0.0
        acceleration = 0.0
        jerk = 0.0
        dd = c[k] - 2.0 * c[k + 1] + c[k + 2]
        for o in range(starts[k], starts[k + 1]):
            u = parts[o]
            d = (c[k + 1] - c[k]) + u * dd
            b = 0.5 * (c[k] + c[k + 1]) + u * (c[k + 1] - c[k]) + 0.5 * u * u * dd
            root = sqrt(b)
            for i in range(inner.shape[2]):
                y = root * fabs(inner[o, 0, i]) * per_limit[k, 0, i]
                if y > velocity:
                    velocity = y
                y = fabs(inner[o, 1, i] * b + 0.5 * inner[o, 0, i] * d) * per_limit[k, 1, i]
                if y > acceleration:
                    acceleration = y
                y = inner[o, 2, i] * b + 1.5 * inner[o, 1, i] * d + 0.5 * inner[o, 0, i] * dd
                y = root * fabs(y) * per_limit[k, 2, i]
                if y > jerk:
                    jerk = y
        loads[k, 0] = velocity
        loads[k, 1] = acceleration
        loads[k, 2] = jerk


def knot_loads(
    a1: cython.double[:, ::1],
    a2: cython.double[:, ::1],
    cap: cython.double[::1],
    j1: cython.double[:, ::1],
    j2: cython.double[:, ::1],
    j3: cython.double[:, ::1],
    counts: cython.Py_ssize_t[:, ::1],
    c: cython.double[::1],
    loads: cython.double[:, ::1],
) -> None:
    """Write the largest velocity (squared) and acceleration at each knot, and the jerks at the beginning and
    the end of the cell behind it (N + 1, 4), over what rows allow."""
    cells: cython.Py_ssize_t = j1.shape[0] // 2
    k: cython.Py_ssize_t
    i: cython.Py_ssize_t
    o: cython.Py_ssize_t
    e: cython.int
    b: cython.double
    d: cython.double
    dd: cython.double
    load: cython.double
    y: cython.double
    for k in range(cells + 1):
        b = 0.5 * (c[k] + c[k + 1])
        d = c[k + 1] - c[k]
        loads[k, 0] = b / cap[k]
        load = 0.0
        for i in range(counts[k, 0]):
            y = fabs(a2[k, i] * b + a1[k, i] * d)
            if y > load:
                load = y
        loads[k, 1] = load
        loads[k, 2] = 0.0
        loads[k, 3] = 0.0
        if k == cells:
            break
        dd = c[k] - 2.0 * c[k + 1] + c[k + 2]
        for e in range(2):
            if e == 1:
                b = 0.5 * (c[k + 1] + c[k + 2])
                d = c[k + 2] - c[k + 1]
            o = 2 * k + e
            load = 0.0
            for i in range(counts[k, 1 + e]):
                y = fabs(j3[o, i] * b + j2[o, i] * d + j1[o, i] * dd)
                if y > load:
                    load = y
            loads[k, 2 + e] = sqrt(b) * load


@cython.cfunc
@cython.exceptval(check=False)
def _worst(
    inner: cython.double[:, :, ::1],
    starts: cython.Py_ssize_t[::1],
    parts: cython.double[::1],
    per_limit: cython.double[:, :, ::1],
    c: cython.double[::1],
    k: cython.Py_ssize_t,
    half: cython.int,
    order: cython.int,
    joint: cython.Py_ssize_t[::1],
) -> cython.double:
    """The largest acceleration (order 1) or jerk (order 2) over its limit in half of a cell; writes the place
    and the joint, -1 where it is within the limit."""
    n: cython.Py_ssize_t = inner.shape[2]
    o: cython.Py_ssize_t
    i: cython.Py_ssize_t
    u: cython.double
    b: cython.double
    d: cython.double
    dd: cython.double = c[k] - 2.0 * c[k + 1] + c[k + 2]
    y: cython.double
    most: cython.double = 1.0
    joint[0] = joint[1] = -1
    for o in range(starts[k], starts[k + 1]):
        u = parts[o]
        if (u < 0.5) != (half == 0):
            continue
        d = (c[k + 1] - c[k]) + u * dd
        b = 0.5 * (c[k] + c[k + 1]) + u * (c[k + 1] - c[k]) + 0.5 * u * u * dd
        for i in range(n):
            if order == 1:
                y = fabs(inner[o, 1, i] * b + 0.5 * inner[o, 0, i] * d)
            else:
                y = inner[o, 2, i] * b + 1.5 * inner[o, 1, i] * d + 0.5 * inner[o, 0, i] * dd
                y = sqrt(b) * fabs(y)
            y *= per_limit[k, order, i]
            if y > most:
                most = y
                joint[0] = o
                joint[1] = i
    return most


def put_worst(
    inner: cython.double[:, :, ::1],
    starts: cython.Py_ssize_t[::1],
    parts: cython.double[::1],
    per_limit: cython.double[:, :, ::1],
    c: cython.double[::1],
    loads: cython.double[:, ::1],
    allowed: cython.double[:, ::1],
    first: cython.Py_ssize_t,
    joint: cython.Py_ssize_t[::1],
    a1: cython.double[:, ::1],
    a2: cython.double[:, ::1],
    j1: cython.double[:, ::1],
    j2: cython.double[:, ::1],
    j3: cython.double[:, ::1],
    counts: cython.Py_ssize_t[:, ::1],
) -> None:
    """Where accelerations or jerks within a cell from `first` on are larger than allowed, add the row of the
    worst place and joint of either half to those of that end, so that it counts there as it does now.

    What is too much there is then as allowed for `tighten`. `joint` (2,) is scratch.
    """
    slots: cython.Py_ssize_t = a1.shape[1]
    k: cython.Py_ssize_t
    i: cython.Py_ssize_t
    o: cython.Py_ssize_t
    p: cython.Py_ssize_t
    half: cython.int
    order: cython.int
    b: cython.double
    d: cython.double
    dd: cython.double
    y: cython.double
    most: cython.double
    for k in range(first, per_limit.shape[0]):
        dd = c[k] - 2.0 * c[k + 1] + c[k + 2]
        for order in range(1, 3):
            if loads[k, order] <= allowed[k, order]:
                continue
            loads[k, order] = 0.0
            for half in range(2):
                most = _worst(inner, starts, parts, per_limit, c, k, half, order, joint)
                if joint[0] < 0:
                    continue
                p, i = joint[0], joint[1]
                b = 0.5 * (c[k + half] + c[k + half + 1])
                d = c[k + half + 1] - c[k + half]
                y = per_limit[k, order, i]
                if order == 1:
                    o = min(counts[k + half, 0], slots - 1)
                    counts[k + half, 0] = o + 1
                    y *= _times(most, y * fabs(inner[p, 1, i] * b + 0.5 * inner[p, 0, i] * d))
                    a1[k + half, o] = 0.5 * inner[p, 0, i] * y
                    a2[k + half, o] = inner[p, 1, i] * y
                else:
                    o = min(counts[k, 1 + half], slots - 1)
                    counts[k, 1 + half] = o + 1
                    b = sqrt(b) * fabs(
                        inner[p, 2, i] * b + 1.5 * inner[p, 1, i] * d + 0.5 * inner[p, 0, i] * dd
                    )
                    y *= _times(most, y * b)
                    j1[2 * k + half, o] = 0.5 * inner[p, 0, i] * y
                    j2[2 * k + half, o] = 1.5 * inner[p, 1, i] * y
                    j3[2 * k + half, o] = inner[p, 2, i] * y


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _times(load: cython.double, at_end: cython.double) -> cython.double:
    """How many times more a row is to count at an end, where it is a load within the cell."""
    return min(max(ALMOST * load / max(at_end, 1e-9), 1.0), MOST_TIMES)


def tighten(
    loads: cython.double[:, ::1],
    ends: cython.double[:, ::1],
    allowed: cython.double[:, ::1],
    near: cython.Py_ssize_t,
    overdone: cython.double,
    overdone_near: cython.double,
    tight: cython.double[:, ::1],
    most: cython.double[:, ::1],
) -> None:
    """Let what counts for a knot or the end of a cell be as many times larger as limits were passed within
    cells: `tight` and at most `most` (N + 1, 4), in the order of `knot_loads`.

    `loads` (N, 3) are those of `inner_loads`, of which `allowed` (N, 3) are; `ends` (N + 1, 4) those of
    `knot_loads`. What is too much is counted `overdone` times, in the cells before `near` otherwise.
    """
    cells: cython.Py_ssize_t = loads.shape[0]
    k: cython.Py_ssize_t
    o: cython.Py_ssize_t
    e: cython.int
    over: cython.double
    far: cython.double
    times: cython.double
    velocity: cython.double
    acceleration: cython.double
    for k in range(cells + 1):
        velocity = 1.0
        acceleration = 1.0
        for o in range(max(k - 1, 0), min(k + 1, cells)):
            if loads[o, 0] > allowed[o, 0]:
                velocity = max(velocity, loads[o, 0] * loads[o, 0] * VELOCITY_MORE)
            if loads[o, 1] > allowed[o, 1]:
                times = overdone_near if o < near else overdone
                acceleration = max(acceleration, 1.0 + times * (loads[o, 1] - 1.0))
        tight[k, 0] = min(tight[k, 0] * velocity, most[k, 0])
        tight[k, 1] = min(tight[k, 1] * acceleration, most[k, 1])
        if k < cells and loads[k, 2] > allowed[k, 2]:
            over = overdone_near if k < near else overdone
            over = min(1.0 + over * (loads[k, 2] - 1.0), 2.0)
            if k >= near:
                # A jerk inside a cell may be far above those at its ends: then these are to count for it.
                far = max(ends[k, 2], ends[k, 3])
                over /= min(max(far, LEAST_LOAD), 1.0)
            for e in range(2, 4):
                tight[k, e] = min(tight[k, e] * over, most[k, e])


def tightened(
    rows_a1: cython.double[:, ::1],
    rows_a2: cython.double[:, ::1],
    rows_cap: cython.double[::1],
    rows_j1: cython.double[:, ::1],
    rows_j2: cython.double[:, ::1],
    rows_j3: cython.double[:, ::1],
    counts: cython.Py_ssize_t[:, ::1],
    tight: cython.double[:, ::1],
    a1: cython.double[:, ::1],
    a2: cython.double[:, ::1],
    cap: cython.double[::1],
    j1: cython.double[:, ::1],
    j2: cython.double[:, ::1],
    j3: cython.double[:, ::1],
) -> None:
    """Write rows that count so many times (N + 1, 4) more."""
    k: cython.Py_ssize_t
    i: cython.Py_ssize_t
    o: cython.Py_ssize_t
    y: cython.double
    for k in range(cap.shape[0]):
        cap[k] = rows_cap[k] / tight[k, 0]
        for i in range(counts[k, 0]):
            a1[k, i] = rows_a1[k, i] * tight[k, 1]
            a2[k, i] = rows_a2[k, i] * tight[k, 1]
    for o in range(j1.shape[0]):
        y = tight[o // 2, 2 + o % 2]
        for i in range(counts[o // 2, 1 + o % 2]):
            j1[o, i] = rows_j1[o, i] * y
            j2[o, i] = rows_j2[o, i] * y
            j3[o, i] = rows_j3[o, i] * y

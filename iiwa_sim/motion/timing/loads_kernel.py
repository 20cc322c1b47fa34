"""How near a clock comes to the limits; compiled by Cython.

c and theta as in `clock_kernel`, rows as in `bounds_kernel`.
"""

# mypy: allow-untyped-decorators

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.timing.bounds_kernel import Rows
else:
    from iiwa_sim.motion.timing.bounds_kernel import Rows

# A load is a value over its limit. Between two places whose loads are below this no limit can be passed.
SMALL = cython.declare(cython.double, 0.75)
# The same for velocities, which change less between places.
NEARLY = cython.declare(cython.double, 0.97)
# What is too much by this, of velocities, and of accelerations and jerks, counts alike.
TOO_FAST = cython.declare(cython.double, 3e-4)
TOO_MUCH = cython.declare(cython.double, 0.004)
# Gaps between places shorter than this part of a cell are not looked into.
LEAST_GAP = cython.declare(cython.double, 1e-3)
# Number of parts in which a gap is looked into.
BETWEEN = cython.declare(cython.int, 8)


def inner_loads(
    rows: Rows,
    c: cython.double[::1],
    begins: cython.Py_ssize_t,
    ends: cython.Py_ssize_t,
    loads: cython.double[:, ::1],
) -> None:
    """Write the largest velocity, acceleration and jerk over their limits in cells begins..ends - 1, of (N,
    3); 0 where they are small."""
    y: cython.double
    found: cython.double[:, :, ::1] = room(rows)
    at: cython.double[:, ::1] = np.empty((3, found.shape[2]))
    for k in range(begins, ends):
        dd = c[k] - 2.0 * c[k + 1] + c[k + 2]
        places(rows, c, k, at)
        # Between coefficients lies b, and its derivative between their differences.
        most_b = max(c[k], c[k + 1], c[k + 2])
        most_d = max(fabs(c[k + 1] - c[k]), fabs(c[k + 2] - c[k + 1]))
        rate = sqrt(most_b)
        for order in range(3):
            largest = 0.0
            for i in range(rows.inner.shape[2]):
                y = rate * rows.peaks[k, 0, i]
                if order == 1:
                    y = most_b * rows.peaks[k, 1, i] + 0.5 * most_d * rows.peaks[k, 0, i]
                elif order == 2:
                    y = most_b * rows.peaks[k, 2, i] + 1.5 * most_d * rows.peaks[k, 1, i]
                    y = rate * (y + 0.5 * fabs(dd) * rows.peaks[k, 0, i])
                if y * rows.per_limit[k, order, i] >= SMALL:
                    fill(rows, k, i, order, dd, at, found)
                    largest = max(largest, _most(rows, c, k, i, order, found))
            loads[k, order] = largest


def beyond(loads: cython.double[:, ::1], allowed: cython.double[:, ::1]) -> float:
    """How far velocities, accelerations and jerks over limits (N, 3) are beyond what is allowed, counted in
    what is too much of each; negative where they are not."""
    most: cython.double = -1e12
    for k in range(loads.shape[0]):
        most = max(most, (loads[k, 0] - allowed[k, 0]) / TOO_FAST)
        most = max(most, max(loads[k, 1] - allowed[k, 1], loads[k, 2] - allowed[k, 2]) / TOO_MUCH)
    return float(most)


@cython.cfunc
@cython.exceptval(check=False)
def _most(
    rows: Rows,
    c: cython.double[::1],
    k: cython.Py_ssize_t,
    i: cython.Py_ssize_t,
    order: cython.Py_ssize_t,
    found: cython.double[:, :, ::1],
) -> cython.double:
    """The largest load of a joint at the places of a cell, and between them where it may be more."""
    most: cython.double = 0.0
    for p in range(rows.starts[k + 1] - rows.starts[k]):
        most = max(most, fabs(found[order, i, p]))
    if most < SMALL:
        return most
    for p in range(rows.starts[k + 1] - rows.starts[k]):
        most = max(most, load_at(found, rows.parts, rows.starts[k], rows.starts[k + 1], order, i, p))
        # Each gap between places once.
        if p == 0:
            continue
        y = max(fabs(found[order, i, p - 1]), fabs(found[order, i, p]))
        if order == 2 and y >= SMALL:
            y = jerk_within(rows, c, k, i, rows.starts[k] + p - 1) * rows.per_limit[k, 2, i]
        elif order == 0 and y >= NEARLY:
            y = speed_within(rows, c, k, i, rows.starts[k] + p - 1) * rows.per_limit[k, 0, i]
        else:
            continue
        most = max(most, y)
    return most


@cython.cfunc
def room(rows: Rows) -> cython.double[:, :, ::1]:
    """An array (3, n, m) with room for the m places of any cell: `fill` writes to it."""
    most: cython.Py_ssize_t = 0
    for k in range(rows.bounds.cells):
        most = max(most, rows.starts[k + 1] - rows.starts[k])
    found: cython.double[:, :, ::1] = np.empty((3, rows.inner.shape[2], most))
    return found


@cython.cfunc
@cython.exceptval(check=False)
def places(rows: Rows, c: cython.double[::1], k: cython.Py_ssize_t, at: cython.double[:, ::1]) -> cython.void:
    """Write b, its derivative and the root of b (3, m) at the places in a cell."""
    dd: cython.double = c[k] - 2.0 * c[k + 1] + c[k + 2]
    for p in range(rows.starts[k + 1] - rows.starts[k]):
        u = rows.parts[rows.starts[k] + p]
        at[0, p] = 0.5 * (c[k] + c[k + 1]) + u * (c[k + 1] - c[k]) + 0.5 * u * u * dd
        at[1, p] = (c[k + 1] - c[k]) + u * dd
        at[2, p] = sqrt(at[0, p])


@cython.cfunc
@cython.exceptval(check=False)
def fill(
    rows: Rows,
    k: cython.Py_ssize_t,
    i: cython.Py_ssize_t,
    order: cython.Py_ssize_t,
    dd: cython.double,
    at: cython.double[:, ::1],
    found: cython.double[:, :, ::1],
) -> cython.void:
    """Write velocities, accelerations or jerks of a joint over their limits at the places in a cell, where
    `places` has been."""
    y: cython.double
    for p in range(rows.starts[k + 1] - rows.starts[k]):
        o = rows.starts[k] + p
        y = rows.inner[o, 0, i]
        if order == 0:
            y *= at[2, p]
        elif order == 1:
            y = rows.inner[o, 1, i] * at[0, p] + 0.5 * y * at[1, p]
        else:
            y = rows.inner[o, 2, i] * at[0, p] + 1.5 * rows.inner[o, 1, i] * at[1, p] + 0.5 * y * dd
            y *= at[2, p]
        found[order, i, p] = y * rows.per_limit[k, order, i]


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def load_at(
    found: cython.double[:, :, ::1],
    parts: cython.double[::1],
    first: cython.Py_ssize_t,
    last: cython.Py_ssize_t,
    order: cython.Py_ssize_t,
    i: cython.Py_ssize_t,
    p: cython.Py_ssize_t,
) -> cython.double:
    """The load of a joint at a place of first..last - 1, or where it is largest between that and those beside
    it, by a parabola through three on the same side of a jump."""
    load: cython.double = found[order, i, p]
    sign: cython.double = 1.0 if load > 0.0 else -1.0
    m: cython.Py_ssize_t = p
    load *= sign
    if load < SMALL:
        return load
    if p == 0 or parts[first + p - 1] == parts[first + p]:
        m += 1
    elif first + p == last - 1 or parts[first + p + 1] == parts[first + p]:
        m -= 1
    if m == 0 or first + m >= last - 1:
        return load
    before = parts[first + m] - parts[first + m - 1]
    behind = parts[first + m + 1] - parts[first + m]
    if not (before > 0.0 and behind > 0.0):
        return load
    rises = sign * (found[order, i, m] - found[order, i, m - 1]) / before
    falls = sign * (found[order, i, m] - found[order, i, m + 1]) / behind
    slope = rises * behind - falls * before
    if (m == p and (rises < 0.0 or falls < 0.0)) or rises + falls <= 0.0:
        return load
    # The vertex is to lie between the place in the middle and that which is largest.
    if fabs(slope) > 2.0 * (rises + falls) * (behind if slope > 0.0 else before) or slope * (p - m) < 0.0:
        return load
    return max(load, sign * found[order, i, m] + 0.25 * slope * slope / ((rises + falls) * (before + behind)))


@cython.cfunc
@cython.exceptval(check=False)
def jerk_within(
    rows: Rows,
    c: cython.double[::1],
    k: cython.Py_ssize_t,
    i: cython.Py_ssize_t,
    o: cython.Py_ssize_t,
) -> cython.double:
    """The largest jerk of a joint between the places o and o + 1 of the cell k.

    The third derivative over theta is taken for the cubic that has its values at both places, and leads from
    the first and second derivatives at the one to those at the other.
    """
    h: cython.double = rows.parts[o + 1] - rows.parts[o]
    if h < LEAST_GAP:
        return 0.0
    first: cython.double = rows.inner[o, 2, i]
    last: cython.double = rows.inner[o + 1, 2, i]
    # The third derivative is first (1 - t) + last t + t (1 - t) (even + odd (2 t - 1)).
    even: cython.double = 6.0 * ((rows.inner[o + 1, 1, i] - rows.inner[o, 1, i]) / h - 0.5 * (first + last))
    odd: cython.double = (rows.inner[o + 1, 0, i] - rows.inner[o, 0, i] - h * rows.inner[o, 1, i]) / (h * h)
    odd = 60.0 * (first / 3.0 + last / 6.0 + even / 12.0 - odd)
    dd: cython.double = c[k] - 2.0 * c[k + 1] + c[k + 2]
    largest: cython.double = 0.0
    for m in range(1, BETWEEN):
        t = cython.cast(cython.double, m) / BETWEEN
        third = first + t * (last - first + (1.0 - t) * (even + odd * (2.0 * t - 1.0)))
        second = first * (1.0 - 0.5 * t) + t * (0.5 * last + even * (0.5 - t / 3.0))
        second = rows.inner[o, 1, i] + h * t * (second - odd * t * (0.5 - t * (1.0 - 0.5 * t)))
        slope = rows.inner[o, 0, i] + t * (rows.inner[o + 1, 0, i] - rows.inner[o, 0, i])
        slope -= t * (1.0 - t) * 0.5 * h * (rows.inner[o + 1, 1, i] - rows.inner[o, 1, i])
        u = rows.parts[o] + t * h
        d = (c[k + 1] - c[k]) + u * dd
        b = 0.5 * (c[k] + c[k + 1]) + u * (c[k + 1] - c[k]) + 0.5 * u * u * dd
        largest = max(largest, sqrt(b) * fabs(third * b + 1.5 * second * d + 0.5 * slope * dd))
    return largest


@cython.cfunc
@cython.exceptval(check=False)
def speed_within(
    rows: Rows,
    c: cython.double[::1],
    k: cython.Py_ssize_t,
    i: cython.Py_ssize_t,
    o: cython.Py_ssize_t,
) -> cython.double:
    """The largest velocity of a joint between the places o and o + 1 of the cell k.

    The first derivative over theta is taken for the parabola that leads from the one to the other.
    """
    h: cython.double = rows.parts[o + 1] - rows.parts[o]
    bend: cython.double = 0.5 * h * (rows.inner[o + 1, 1, i] - rows.inner[o, 1, i])
    largest: cython.double = 0.0
    if h < LEAST_GAP:
        return 0.0
    for m in range(1, BETWEEN):
        t = cython.cast(cython.double, m) / BETWEEN
        slope = rows.inner[o, 0, i] + t * (rows.inner[o + 1, 0, i] - rows.inner[o, 0, i])
        slope -= t * (1.0 - t) * bend
        u = rows.parts[o] + t * h
        u = 0.5 * (c[k] + c[k + 1]) + u * (c[k + 1] - c[k]) + 0.5 * u * u * (c[k] - 2.0 * c[k + 1] + c[k + 2])
        largest = max(largest, sqrt(u) * fabs(slope))
    return largest

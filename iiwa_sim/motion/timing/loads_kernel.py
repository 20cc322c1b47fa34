"""How near a clock comes to the limits; compiled by Cython.

c and theta as in `clock_kernel`, rows as in `bounds_kernel`.
"""

# mypy: allow-untyped-decorators

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt
from numpy.typing import NDArray

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.timing.bounds_kernel import Bounds, Rows
else:
    from iiwa_sim.motion.timing.bounds_kernel import Bounds, Rows

MOST_TIMES = cython.declare(cython.double, 2.0)
ALMOST = cython.declare(cython.double, 1.001)
# A load is a value over its limit. Between two places whose loads are below this no limit can be passed.
SMALL = cython.declare(cython.double, 0.75)
# The same for velocities, which change less between places.
NEARLY = cython.declare(cython.double, 0.97)
# Gaps between places shorter than this part of a cell are not looked into.
LEAST_GAP = cython.declare(cython.double, 1e-3)
# Number of parts in which a gap is looked into.
BETWEEN = cython.declare(cython.int, 8)


def inner_loads(
    rows: Rows,
    c: cython.double[::1],
    until: cython.Py_ssize_t,
    loads: cython.double[:, ::1],
) -> None:
    """Write the largest velocity, acceleration and jerk over their limits in the first cells (N, 3)."""
    largest: cython.double
    most: cython.double
    found: cython.double[:, :, ::1] = _room(rows)
    for k in range(until):
        _fill(rows, c, k, found)
        for order in range(3):
            largest = 0.0
            for i in range(rows.inner.shape[2]):
                most = 0.0
                for p in range(rows.starts[k + 1] - rows.starts[k]):
                    most = max(most, fabs(found[order, i, p]))
                if most >= SMALL:
                    for p in range(rows.starts[k + 1] - rows.starts[k]):
                        most = max(
                            most, _load(found, rows.parts, rows.starts[k], rows.starts[k + 1], order, i, p)
                        )
                        # Each gap between places once.
                        if p == 0:
                            continue
                        y = max(fabs(found[order, i, p - 1]), fabs(found[order, i, p]))
                        if order == 2 and y >= SMALL:
                            y = _within(rows, c, k, i, rows.starts[k] + p - 1) * rows.per_limit[k, 2, i]
                        elif order == 0 and y >= NEARLY:
                            y = _fastest(rows, c, k, i, rows.starts[k] + p - 1) * rows.per_limit[k, 0, i]
                        else:
                            continue
                        most = max(most, y)
                largest = max(largest, most)
            loads[k, order] = largest


@cython.cfunc
def _room(rows: Rows) -> cython.double[:, :, ::1]:
    """An array (3, n, m) with room for the m places of any cell: `_fill` writes to it."""
    most: cython.Py_ssize_t = 0
    for k in range(rows.bounds.cells):
        most = max(most, rows.starts[k + 1] - rows.starts[k])
    found: cython.double[:, :, ::1] = np.empty((3, rows.inner.shape[2], most))
    return found


@cython.cfunc
@cython.exceptval(check=False)
def _fill(
    rows: Rows,
    c: cython.double[::1],
    k: cython.Py_ssize_t,
    found: cython.double[:, :, ::1],
) -> cython.void:
    """Write velocities, accelerations and jerks over their limits (3, n, m) at the places in a cell."""
    dd: cython.double = c[k] - 2.0 * c[k + 1] + c[k + 2]
    for o in range(rows.starts[k], rows.starts[k + 1]):
        p = o - rows.starts[k]
        u = rows.parts[o]
        d = (c[k + 1] - c[k]) + u * dd
        b = 0.5 * (c[k] + c[k + 1]) + u * (c[k + 1] - c[k]) + 0.5 * u * u * dd
        root = sqrt(b)
        for i in range(rows.inner.shape[2]):
            found[0, i, p] = root * rows.inner[o, 0, i] * rows.per_limit[k, 0, i]
            found[1, i, p] = (rows.inner[o, 1, i] * b + 0.5 * rows.inner[o, 0, i] * d) * rows.per_limit[
                k, 1, i
            ]
            y = rows.inner[o, 2, i] * b + 1.5 * rows.inner[o, 1, i] * d + 0.5 * rows.inner[o, 0, i] * dd
            found[2, i, p] = root * y * rows.per_limit[k, 2, i]


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _load(
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
def _beside(
    rows: Rows,
    c: cython.double[::1],
    k: cython.Py_ssize_t,
    i: cython.Py_ssize_t,
    p: cython.Py_ssize_t,
    order: cython.Py_ssize_t,
) -> cython.double:
    """The largest velocity or jerk of a joint, over its limit, between a place of the cell k and those beside
    it."""
    largest: cython.double = 0.0
    for o in range(rows.starts[k] + p - 1, rows.starts[k] + p + 1):
        if rows.starts[k] <= o < rows.starts[k + 1] - 1:
            y = _within(rows, c, k, i, o) if order == 2 else _fastest(rows, c, k, i, o)
            largest = max(largest, y)
    return largest * rows.per_limit[k, order, i]


@cython.cfunc
@cython.exceptval(check=False)
def _within(
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
def _fastest(
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


def knot_loads(
    bounds: Bounds,
    c: cython.double[::1],
    loads: cython.double[:, ::1],
) -> None:
    """Write the largest velocity (squared) and acceleration at each knot, and the jerks at the beginning and
    the end of the cell behind it (N + 1, 4), over what rows allow."""
    cells: cython.Py_ssize_t = bounds.cells
    for k in range(cells + 1):
        b = 0.5 * (c[k] + c[k + 1])
        d = c[k + 1] - c[k]
        loads[k, 0] = b / bounds.cap[k]
        load = 0.0
        for i in range(bounds.counts[k, 0]):
            y = fabs(bounds.a2[k, i] * b + bounds.a1[k, i] * d)
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
            for i in range(bounds.counts[k, 1 + e]):
                y = fabs(bounds.j3[o, i] * b + bounds.j2[o, i] * d + bounds.j1[o, i] * dd)
                if y > load:
                    load = y
            loads[k, 2 + e] = sqrt(b) * load


@cython.cfunc
@cython.exceptval(check=False)
def _worst(
    found: cython.double[:, :, ::1],
    rows: Rows,
    c: cython.double[::1],
    k: cython.Py_ssize_t,
    half: cython.int,
    order: cython.Py_ssize_t,
    joint: cython.Py_ssize_t[::1],
) -> cython.double:
    """The largest load in half of a cell; writes the place and the joint, -1 where it is within the limit."""
    first: cython.Py_ssize_t = rows.starts[k]
    last: cython.Py_ssize_t = rows.starts[k + 1]
    most: cython.double = 1.0
    joint[0] = joint[1] = -1
    for p in range(last - first):
        if (rows.parts[first + p] < 0.5) != (half == 0):
            continue
        for i in range(found.shape[1]):
            y = _load(found, rows.parts, first, last, order, i, p)
            if (order == 2 and y >= SMALL) or (order == 0 and y >= NEARLY):
                y = max(y, _beside(rows, c, k, i, p, order))
            if y > most:
                most = y
                joint[0] = first + p
                joint[1] = i
    return most


def cut(
    rows: Rows, c: cython.double[::1], loads: cython.double[:, ::1], allowed: cython.double[:, ::1]
) -> NDArray[np.float64]:
    """Rows (M, 7) for where velocities, accelerations and jerks within cells are larger than allowed (N, 3):
    of the worst place and joint in either half of a cell. See `Rows`."""
    m: cython.Py_ssize_t = 0
    joint: cython.Py_ssize_t[::1] = np.empty(2, dtype=np.intp)
    found: cython.double[:, :, ::1] = _room(rows)
    for k in range(rows.bounds.cells):
        for order in range(3):
            m += 2 if loads[k, order] > allowed[k, order] else 0
    cuts_array = np.zeros((m, 7))
    cuts: cython.double[:, ::1] = cuts_array
    m = 0
    for k in range(rows.bounds.cells):
        if not (loads[k, 0] > allowed[k, 0] or loads[k, 1] > allowed[k, 1] or loads[k, 2] > allowed[k, 2]):
            continue
        _fill(rows, c, k, found)
        for order in range(3):
            if loads[k, order] <= allowed[k, order]:
                continue
            for half in range(2):
                most = _worst(found, rows, c, k, half, order, joint)
                if joint[0] < 0:
                    continue
                p = joint[0]
                u = rows.parts[p]
                first, second, third = (
                    rows.inner[p, 0, joint[1]],
                    rows.inner[p, 1, joint[1]],
                    rows.inner[p, 2, joint[1]],
                )
                # The factors of b, b' and b'' there; what is larger beside the place counts for it.
                most /= max(fabs(found[order, joint[1], p - rows.starts[k]]), 1e-9)
                most = ALMOST * (most * most if order == 0 else most)
                most = rows.per_limit[k, order, joint[1]] * min(max(most, 1.0), MOST_TIMES)
                if order == 0:
                    b, d, dd = first * first * rows.per_limit[k, 0, joint[1]] * most, 0.0, 0.0
                elif order == 1:
                    b, d, dd = second * most, 0.5 * first * most, 0.0
                else:
                    b, d, dd = third * most, 1.5 * second * most, 0.5 * first * most
                cuts[m, 0] = k
                cuts[m, 4] = 0.5 - u + 0.5 * u * u
                cuts[m, 5] = 0.5 + u - u * u
                cuts[m, 6] = 0.5 * u * u
                cuts[m, 1] = b * cuts[m, 4] - d * (1.0 - u) + dd
                cuts[m, 2] = b * cuts[m, 5] + d * (1.0 - 2.0 * u) - 2.0 * dd
                cuts[m, 3] = b * cuts[m, 6] + d * u + dd
                if order < 2:
                    cuts[m, 4] = cuts[m, 5] = cuts[m, 6] = 0.0
                m += 1
    chosen: NDArray[np.float64] = cuts_array[:m]
    return chosen

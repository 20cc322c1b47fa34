"""Rows for where a clock comes too near to the limits inside of cells; compiled by Cython.

c and theta as in `clock_kernel`, rows as in `bounds_kernel`, loads as in `loads_kernel`.
"""

# mypy: allow-untyped-decorators

import cython
import numpy as np
from cython.cimports.libc.math import fabs
from numpy.typing import NDArray

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.timing.bounds_kernel import Rows
    from cython.cimports.iiwa_sim.motion.timing.loads_kernel import (
        fill,
        jerk_within,
        load_at,
        places,
        room,
        speed_within,
    )
else:
    from iiwa_sim.motion.timing.bounds_kernel import Rows
    from iiwa_sim.motion.timing.loads_kernel import (
        fill,
        jerk_within,
        load_at,
        places,
        room,
        speed_within,
    )

MOST_TIMES = cython.declare(cython.double, 2.0)
ALMOST = cython.declare(cython.double, 1.001)
# As in `loads_kernel`.
SMALL = cython.declare(cython.double, 0.75)
NEARLY = cython.declare(cython.double, 0.97)


def cut(
    rows: Rows, c: cython.double[::1], loads: cython.double[:, ::1], allowed: cython.double[:, ::1]
) -> NDArray[np.float64]:
    """Rows (M, 7) for where velocities, accelerations and jerks within cells are larger than allowed (N, 3):
    of the worst place and joint in either half of a cell. See `Rows`."""
    m: cython.Py_ssize_t = 0
    joint: cython.Py_ssize_t[::1] = np.empty(2, dtype=np.intp)
    found: cython.double[:, :, ::1] = room(rows)
    at: cython.double[:, ::1] = np.empty((3, found.shape[2]))
    for k in range(rows.bounds.cells):
        for order in range(3):
            m += 2 if loads[k, order] > allowed[k, order] else 0
    cuts_array = np.zeros((m, 7))
    cuts: cython.double[:, ::1] = cuts_array
    m = 0
    for k in range(rows.bounds.cells):
        if not (loads[k, 0] > allowed[k, 0] or loads[k, 1] > allowed[k, 1] or loads[k, 2] > allowed[k, 2]):
            continue
        dd = c[k] - 2.0 * c[k + 1] + c[k + 2]
        places(rows, c, k, at)
        for order in range(3):
            if loads[k, order] <= allowed[k, order]:
                continue
            for i in range(rows.inner.shape[2]):
                fill(rows, k, i, order, dd, at, found)
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
                    b, d, e = first * first * rows.per_limit[k, 0, joint[1]] * most, 0.0, 0.0
                elif order == 1:
                    b, d, e = second * most, 0.5 * first * most, 0.0
                else:
                    b, d, e = third * most, 1.5 * second * most, 0.5 * first * most
                cuts[m, 0] = k
                cuts[m, 4] = 0.5 - u + 0.5 * u * u
                cuts[m, 5] = 0.5 + u - u * u
                cuts[m, 6] = 0.5 * u * u
                cuts[m, 1] = b * cuts[m, 4] - d * (1.0 - u) + e
                cuts[m, 2] = b * cuts[m, 5] + d * (1.0 - 2.0 * u) - 2.0 * e
                cuts[m, 3] = b * cuts[m, 6] + d * u + e
                if order < 2:
                    cuts[m, 4] = cuts[m, 5] = cuts[m, 6] = 0.0
                m += 1
    chosen: NDArray[np.float64] = cuts_array[:m]
    return chosen


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
            y = load_at(found, rows.parts, first, last, order, i, p)
            if (order == 2 and y >= SMALL) or (order == 0 and y >= NEARLY):
                y = max(y, _beside(rows, c, k, i, p, order))
            if y > most:
                most = y
                joint[0] = first + p
                joint[1] = i
    return most


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
            y = jerk_within(rows, c, k, i, o) if order == 2 else speed_within(rows, c, k, i, o)
            largest = max(largest, y)
    return largest * rows.per_limit[k, order, i]

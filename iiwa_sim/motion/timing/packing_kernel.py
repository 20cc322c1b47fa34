"""What bounds a clock, as its steps take it (`clock_kernel.Steps`); compiled by Cython."""

# mypy: allow-untyped-decorators

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.libc.math import fabs
from numpy.typing import NDArray

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.timing.bounds_kernel import Bounds, Rows
else:
    from iiwa_sim.motion.timing.bounds_kernel import Bounds, Rows

COLUMNS = cython.declare(cython.Py_ssize_t, 13)
NOT_MET = cython.declare(cython.double, -1.0)  # the multiplier of a row that steps have not met yet


def packed(
    given: Rows, fixed: cython.Py_ssize_t
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64], NDArray[np.float64]]:
    """`cells`, `first`, `weights` and `rows` of `Steps`, without cuts, but with room for them; of rows the
    first three columns."""
    bounds: Bounds = given.bounds
    cells: cython.Py_ssize_t = bounds.cells
    g: cython.Py_ssize_t = 0
    r: cython.Py_ssize_t = 2 * cells + 1
    for k in range(cells + 1):
        for e in range(3 if k < cells else 1):
            r += bounds.counts[k, e]
    r += given.cuts.shape[0]
    cells_array = np.empty(3 * cells + 1, dtype=np.intp)
    first_array = np.zeros(3 * cells + 2, dtype=np.intp)
    weights_array = np.zeros((3 * cells + 1, 4))
    rows_array = np.empty((r, COLUMNS))
    cell: cython.Py_ssize_t[::1] = cells_array
    first: cython.Py_ssize_t[::1] = first_array
    weights: cython.double[:, ::1] = weights_array
    rows: cython.double[:, ::1] = rows_array
    r = 0
    for k in range(cells):
        for e in range(4):
            if (k == 0 and e < 2 and fixed > 0) or (k < cells - 1 and e == 3):
                continue
            if e % 3 == 0:
                r = _knot(rows, given, k + e // 3, e // 3, r)
                if e == 0:
                    r = _middle(rows, given, k, r)
            else:
                r = _jerks(rows, given, k, e - 1, r)
                weights[g, e - 1] = weights[g, e] = 0.5
            cell[g] = k
            g += 1
            first[g] = r
    return cells_array[:g], first_array[: g + 1], weights_array[:g], rows_array


def merged(
    of: cython.Py_ssize_t[::1],
    first: cython.Py_ssize_t[::1],
    weights: cython.double[:, ::1],
    rows: cython.double[:, ::1],
    cuts: NDArray[np.float64],
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64], cython.double[:, ::1]]:
    """Groups and rows of cells (see `packed`) with cuts (M, 7), see `Rows`, as groups of their own behind
    those of their cells: in the rows that are given, if these have room for them."""
    g: cython.Py_ssize_t = of.shape[0]
    m: cython.Py_ssize_t = cuts.shape[0]
    groups: cython.Py_ssize_t = g + m
    r: cython.Py_ssize_t = first[g] + m
    of_array, first_array = np.empty(groups, dtype=np.intp), np.zeros(groups + 1, dtype=np.intp)
    weights_array = np.empty((groups, 4))
    new_of: cython.Py_ssize_t[::1] = of_array
    new_first: cython.Py_ssize_t[::1] = first_array
    new_weights: cython.double[:, ::1] = weights_array
    new: cython.double[:, ::1] = cuts[cuts[:, 0].argsort(kind="stable")]
    new_rows: cython.double[:, ::1] = rows if rows.shape[0] >= r else np.empty((r, COLUMNS))
    for i in range(groups - 1, -1, -1):
        new_first[i + 1] = r
        if m > 0 and (g == 0 or new[m - 1, 0] >= of[g - 1]):
            m -= 1
            r -= 1
            new_of[i] = cython.cast(cython.Py_ssize_t, new[m, 0])
            for f in range(3):
                new_rows[r, f], new_weights[i, f] = new[m, 1 + f], new[m, 4 + f]
            new_weights[i, 3] = 1.0
            for f in range(3, COLUMNS):
                new_rows[r, f] = NOT_MET
        else:
            g -= 1
            new_of[i] = of[g]
            for f in range(4):
                new_weights[i, f] = weights[g, f]
            # From the last row on, as they may be the same rows.
            for k in range(first[g + 1] - 1, first[g] - 1, -1):
                r -= 1
                for f in range(COLUMNS):
                    new_rows[r, f] = rows[k, f]
    return of_array, first_array, weights_array, new_rows


@cython.cfunc
@cython.exceptval(check=False)
def _knot(
    rows: cython.double[:, ::1],
    given: Rows,
    k: cython.Py_ssize_t,
    shift: cython.Py_ssize_t,
    r: cython.Py_ssize_t,
) -> cython.Py_ssize_t:
    """Write what bounds velocities and accelerations at a knot, for two factors from a shift on, from the
    row r on. Gives the row behind."""
    rows[r, 2 - 2 * shift] = 0.0
    rows[r, shift] = rows[r, shift + 1] = 0.5 * given.tight[k, 0] / given.bounds.cap[k]
    r += 1
    for i in range(given.bounds.counts[k, 0]):
        y = given.tight[k, 1] * given.bounds.a1[k, i]
        b = 0.5 * given.tight[k, 1] * given.bounds.a2[k, i]
        rows[r, shift], rows[r, shift + 1], rows[r, 2 - 2 * shift] = b - y, b + y, 0.0
        r += 1
    return r


@cython.cfunc
@cython.exceptval(check=False)
def _middle(
    rows: cython.double[:, ::1], given: Rows, k: cython.Py_ssize_t, r: cython.Py_ssize_t
) -> cython.Py_ssize_t:
    """Pack the rows that bound velocities in the middle of a cell: without them a clock that is as fast as
    they allow at all knots might swing from cell to cell, at no cost."""
    middle: cython.Py_ssize_t = given.starts[k]
    for p in range(given.starts[k] + 1, given.starts[k + 1]):
        if fabs(given.parts[p] - 0.5) < fabs(given.parts[middle] - 0.5):
            middle = p
    u: cython.double = given.parts[middle]
    most: cython.double = 0.0
    for i in range(given.inner.shape[2]):
        most = max(most, fabs(given.inner[middle, 0, i]) * given.per_limit[k, 0, i])
    most *= most * given.tight[k, 0]
    rows[r, 0] = most * (0.5 - u + 0.5 * u * u)
    rows[r, 1] = most * (0.5 + u - u * u)
    rows[r, 2] = most * 0.5 * u * u
    return r + 1


@cython.cfunc
@cython.exceptval(check=False)
def _jerks(
    rows: cython.double[:, ::1],
    given: Rows,
    k: cython.Py_ssize_t,
    end: cython.Py_ssize_t,
    r: cython.Py_ssize_t,
) -> cython.Py_ssize_t:
    """Pack the rows that bound jerks at the beginning or the end of a cell."""
    y: cython.double = given.tight[k, 2 + end]
    for i in range(given.bounds.counts[k, 1 + end]):
        f1 = y * given.bounds.j1[2 * k + end, i]
        f2 = y * given.bounds.j2[2 * k + end, i]
        f3 = 0.5 * y * given.bounds.j3[2 * k + end, i]
        rows[r, 0], rows[r, 1], rows[r, 2] = f1, -2.0 * f1, f1
        rows[r, end] += f3 - f2
        rows[r, end + 1] += f3 + f2
        r += 1
    return r

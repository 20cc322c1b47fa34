"""x of a chain as a cubic B-spline through a motion; compiled by Cython."""

# mypy: allow-untyped-decorators

import cython
import numpy as np
from numpy.typing import NDArray


def through(
    before: cython.double[::1],
    motion: cython.double[:, ::1],
    widths: cython.double[::1],
    end_x: cython.double,
) -> NDArray[np.float64]:
    """Coefficients of x that go on from those before: `motion` (N + 1, 3) is x and its first two derivatives
    over time at the knots, `widths` (N,) are the times of cells (s)."""
    kept: cython.Py_ssize_t = before.shape[0]
    cells: cython.Py_ssize_t = widths.shape[0]
    k: cython.Py_ssize_t
    width: cython.double
    second: cython.double
    falls: cython.bint = False
    # The point of the knot k is k + 1: its value without a sixth of its second derivative over theta.
    found_array = np.empty(kept + cells)
    found: cython.double[::1] = found_array
    for k in range(kept):
        found[k] = before[k]
    for k in range(2, cells):
        width = 0.5 * (widths[k - 1] + widths[k])
        second = motion[k, 2] * (width * width) + motion[k, 1] * (widths[k] - widths[k - 1])
        found[kept + k - 2] = motion[k, 0] - second / 6.0
    for k in range(kept + cells - 3, kept + cells):
        found[k] = end_x
    for k in range(kept, kept + cells):
        falls = falls or found[k] < found[k - 1]
    if falls:
        _rise(found, motion, kept - 1)
    chosen: NDArray[np.float64] = found_array
    return chosen


@cython.cfunc
@cython.exceptval(check=False)
def _rise(found: cython.double[::1], motion: cython.double[:, ::1], first: cython.Py_ssize_t) -> cython.void:
    """Let x never go back: where cells are too wide for how it changes, points behind the `first`, but for
    the last three, are brought between the values at the knots beside theirs."""
    k: cython.Py_ssize_t
    m: cython.Py_ssize_t = found.shape[0] - first
    before: cython.bint = found[first + 1] < found[first]
    behind: cython.bint
    for k in range(1, m - 3):
        behind = found[first + k + 1] < found[first + k]
        if before or behind:
            found[first + k] = min(
                max(found[first + k], 0.5 * (motion[k, 0] + motion[k + 1, 0])),
                0.5 * (motion[k + 1, 0] + motion[k + 2, 0]),
            )
        before = behind
    for k in range(1, m - 3):
        found[first + k] = min(max(found[first + k], found[first + k - 1]), found[first + m - 1])

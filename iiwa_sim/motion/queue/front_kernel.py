"""How much of a chain is kept when it is planned on; compiled by Cython.

controls, clock and times as in `motion_kernel`.
"""

# mypy: allow-untyped-decorators

import cython
from cython.cimports.libc.math import sqrt

# Until so long before it begins to brake at its end, a chain moves as one would that goes on.
BESIDE_BRAKING_S = cython.declare(cython.double, 0.1)
AHEAD_CELLS = cython.declare(cython.Py_ssize_t, 2)


@cython.cfunc
@cython.exceptval(check=False)
def _rate(
    controls: cython.double[::1], clock: cython.double[::1], unit: cython.double, k: cython.Py_ssize_t
) -> cython.double:
    """dx/dt (1/s) at a knot."""
    return 0.5 * (controls[k + 2] - controls[k]) * sqrt(0.5 * (clock[k] + clock[k + 1])) / unit


@cython.cfunc
@cython.exceptval(check=False)
def _knot(times: cython.double[::1], time_s: cython.double) -> cython.Py_ssize_t:
    """The first knot that is not before a time."""
    low: cython.Py_ssize_t = 0
    high: cython.Py_ssize_t = times.shape[0]
    while low < high:
        k = (low + high) // 2
        if times[k] < time_s:
            low = k + 1
        else:
            high = k
    return low


def kept(
    controls: cython.double[::1],
    clock: cython.double[::1],
    times: cython.double[::1],
    unit: cython.double,
    since_s: cython.double,
    time_s: cython.double,
    free_s: cython.double,
    until_x: cython.double,
    half_s: cython.double,
) -> tuple[int, int, int]:
    """Three knots: the last one before `since_s`, those up to which the clock and x are kept.

    The clock is kept up to the first knot behind `time_s`, or up to `free_s` before the chain brakes at its
    end if that is later; x up to a little before it brakes, or before x is `half_s` from `until_x`.
    """
    last: cython.Py_ssize_t = times.shape[0] - 1
    low: cython.Py_ssize_t = 0
    k: cython.Py_ssize_t = last
    brakes_s: cython.double = 0.0
    while k > 0 and _rate(controls, clock, unit, k) <= _rate(controls, clock, unit, k - 1):
        k -= 1
    if k > 0:
        brakes_s = times[k]
    k = max(min(_knot(times, max(time_s, brakes_s - free_s)), last - 1), 1)
    first = max(min(_knot(times, since_s) - 1, k - 1), 0)
    end = min(_knot(times, max(brakes_s - BESIDE_BRAKING_S, 0.5 * (brakes_s + times[k]))), last - 1)
    high: cython.Py_ssize_t = end + AHEAD_CELLS
    while low < high:
        o = (low + high) // 2
        x = (controls[o] + 4.0 * controls[o + 1] + controls[o + 2]) / 6.0
        if x + half_s * _rate(controls, clock, unit, o) < until_x:
            low = o + 1
        else:
            high = o
    return first, k, max(min(end, low - AHEAD_CELLS), k)

"""First guesses of a clock, at an even pace over nominal time, how near it is to the limits at knots, and a
way on where it is stuck; compiled by Cython.

c and theta as in `clock_kernel`, rows as in `bounds_kernel`.
"""

# mypy: allow-untyped-decorators

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt
from numpy.typing import NDArray

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.timing.bounds_kernel import Bounds, Rows
    from cython.cimports.iiwa_sim.motion.timing.run_kernel import root
else:
    from iiwa_sim.motion.timing.bounds_kernel import Bounds, Rows
    from iiwa_sim.motion.timing.run_kernel import root

# A clock that goes evenly begins at this part of what limits allow.
STEADY = cython.declare(cython.double, 0.97)
# A first guess goes at this part of the even pace that the limits of a cell and its neighbours allow.
PACE = cython.declare(cython.double, 0.98)
# The square of its pace is at most this part of the nominal one.
MOST = cython.declare(cython.double, 1.2)
# Number of cells over which the pace is averaged.
SPAN = cython.declare(cython.Py_ssize_t, 8)
# Where a plan goes on from an older one, the pace falls to no less than this part of what it was there.
LEAST = cython.declare(cython.double, 0.2)
# exp(-1/5): the older pace fades within some five cells.
FADE = cython.declare(cython.double, 0.8187307530779818)
GROW = cython.declare(cython.double, 1.2214027581601699)  # exp(1/5)
# A chain whose clock is less than this part of what it is beside there nearly stands still.
STUCK = cython.declare(cython.double, 0.02)


def steady(bounds: Bounds, widths: cython.double[::1]) -> NDArray[np.float64]:
    """The clock (N + 2,) that goes evenly over cells of nominal times (N,), as fast as all limits allow,
    almost."""
    cells: cython.Py_ssize_t = bounds.cells
    # Loads: of squared velocities and of accelerations, which go with b, and of jerks, with b^(3/2).
    square: cython.double = 1e-12
    cube: cython.double = 1e-18
    found: NDArray[np.float64] = np.empty(cells + 2)
    c: cython.double[::1] = found
    for k in range(cells + 2):
        width = widths[min(max(k - 1, 0), cells - 1)]
        c[k] = 1.0 / (width * width)
    for k in range(cells + 1):
        b = 0.5 * (c[k] + c[k + 1])
        d = c[k + 1] - c[k]
        square = max(square, b / bounds.cap[k])
        for i in range(bounds.counts[k, 0]):
            square = max(square, fabs(bounds.a2[k, i] * b + bounds.a1[k, i] * d))
    for o in range(2 * cells):
        k = o // 2
        dd = c[k] - 2.0 * c[k + 1] + c[k + 2]
        k += o % 2
        b = 0.5 * (c[k] + c[k + 1])
        d = c[k + 1] - c[k]
        for i in range(bounds.counts[o // 2, 1 + o % 2]):
            cube = max(cube, sqrt(b) * fabs(bounds.j3[o, i] * b + bounds.j2[o, i] * d + bounds.j1[o, i] * dd))
    cube = root(cube)
    square = STEADY / max(square, cube * cube)
    for k in range(cells + 2):
        c[k] *= square
    return found


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


def going_on(
    rows: Rows,
    widths: cython.double[::1],
    scratch: cython.double[:, ::1],
    c: cython.double[::1],
) -> None:
    """Write a first guess behind the first two of c (M + 2,), which are given: from their pace to what limits
    allow at an even one over cells of nominal times (M,), the last of all.

    `scratch` is (2, M).
    """
    count: cython.Py_ssize_t = widths.shape[0]
    behind: cython.Py_ssize_t = rows.bounds.cells - count
    jerk: cython.double
    room: cython.double
    fade: cython.double = FADE
    for k in range(count):
        m = behind + k
        square = max(1.0 / rows.bounds.cap[m], 1.0 / rows.bounds.cap[m + 1])
        for o in range(m, m + 2):
            for i in range(rows.bounds.counts[o, 0]):
                square = max(square, fabs(rows.bounds.a2[o, i]))
        jerk = 0.0
        for o in range(2):
            for i in range(rows.bounds.counts[m, 1 + o]):
                jerk = max(jerk, fabs(rows.bounds.j3[2 * m + o, i]))
        for o in range(rows.starts[m], rows.starts[m + 1]):
            for i in range(rows.inner.shape[2]):
                jerk = max(jerk, fabs(rows.inner[o, 2, i]) * rows.per_limit[m, 2, i])
        even = 1.0 / widths[k]
        room = root(jerk * even * even * even) if jerk > 1e-12 else 0.0
        room = max(square * even * even, room * room)
        scratch[0, k] = PACE / max(room, 1.0 / MOST)
    # No faster than beside it, and changing gently.
    for k in range(count):
        room = MOST
        for m in range(max(k - SPAN, 0), min(k + SPAN + 1, count)):
            room = min(room, scratch[0, m])
        scratch[1, k] = room
    _smooth(scratch[1], scratch[0], count)
    _smooth(scratch[0], scratch[1], count)
    first = c[0] * (2.0 * widths[0] - widths[1]) * (2.0 * widths[0] - widths[1]) / scratch[1, 0] - 1.0
    second = c[1] * widths[0] * widths[0] / scratch[1, 0] - 1.0
    for k in range(2, count + 2):
        fade *= FADE
        even = 1.0 + (first + (second * GROW - first) * k) * fade
        m = min(k - 1, count - 1)
        c[k] = scratch[1, m] / (widths[m] * widths[m]) * max(even, LEAST)


@cython.cfunc
@cython.exceptval(check=False)
def _smooth(values: cython.double[::1], means: cython.double[::1], count: cython.Py_ssize_t) -> cython.void:
    """Write means over SPAN cells around each; beyond the ends values are as there."""
    for k in range(count):
        total = 0.0
        for m in range(k - SPAN // 2, k + SPAN // 2 + 1):
            total += values[min(max(m, 0), count - 1)]
        means[k] = total / (SPAN // 2 * 2 + 1)


def lifted(c: cython.double[::1], fixed: cython.Py_ssize_t) -> bool:
    """Whether steps have led to where the chain all but stands still for a knot: there it keeps all limits,
    and none leads out. Such coefficients are then like those beside them."""
    before: cython.double = c[max(fixed - 1, 0)]
    found: cython.bint = False
    for k in range(max(fixed, 1), c.shape[0] - 1):
        beside = 0.5 * (before + c[k + 1])
        before = c[k]
        if c[k] < STUCK * beside:
            c[k] = 0.5 * beside
            found = True
    return bool(found)

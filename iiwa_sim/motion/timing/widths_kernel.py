"""How long the cells of a chain are in nominal time; compiled by Cython.

They are short at short corners, long where nothing happens for long, and change gently.
"""

# mypy: allow-untyped-decorators

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt
from numpy.typing import NDArray

CELL_S = cython.declare(cython.double, 0.01)
# Least number of cells of a chain from rest, and of what is planned anew behind cells that are kept.
LEAST_CELLS = cython.declare(cython.Py_ssize_t, 24)
LEAST_LEFT = cython.declare(cython.Py_ssize_t, 16)
# A corner gets about so many cells,
CORNER_CELLS = cython.declare(cython.double, 12.0)
# none of them shorter than this: accelerations of a corner come and go within some cells.
SHORTEST_S = cython.declare(cython.double, 0.0025)
# Time over which the density of cells is averaged.
BESIDE_S = cython.declare(cython.double, 0.08)
# Cells farther than this from any event are longer, by at most that part of the distance.
NEAR_S = cython.declare(cython.double, 0.2)
WIDER = cython.declare(cython.double, 0.1)
# Step of the grid on which the density is found, in cells.
PER_CELL = cython.declare(cython.double, 0.2)
# A change of acceleration by more than this part of the largest one is an event.
SWITCH = cython.declare(cython.double, 0.1)
# exp(-1/5): the width of cells that are kept fades within some five cells.
FADE = cython.declare(cython.double, 0.8187307530779818)
GROW = cython.declare(cython.double, 1.2214027581601699)  # exp(1/5)
LONGEST_S = cython.declare(cython.double, 1e7)
NO_TIME_S = cython.declare(cython.double, 1e-300)  # as many cells a second would overflow
LEAST_PART = cython.declare(cython.double, 0.2)
ALMOST = cython.declare(cython.double, 1e-9)


def switches(times: cython.double[::1], speeds: cython.double[::1]) -> NDArray[np.float64]:
    """Times at which the acceleration of a run, constant between samples (m,), changes by much."""
    m: cython.Py_ssize_t = times.shape[0]
    most: cython.double = 0.0
    found: list[float] = []
    for k in range(m - 1):
        behind = (speeds[k + 1] - speeds[k]) / max(times[k + 1] - times[k], ALMOST)
        most = max(most, fabs(behind))
    before = 0.0
    for k in range(m - 1):
        behind = (speeds[k + 1] - speeds[k]) / max(times[k + 1] - times[k], ALMOST)
        if fabs(behind - before) > SWITCH * most:
            found.append(times[k])
        before = behind
    return np.array(found)


@cython.cfunc
@cython.exceptval(check=False)
def _base(
    t: cython.double, before: cython.double, behind: cython.double, cell_s: cython.double
) -> cython.double:
    """Density of cells (1/s) at a time between two events."""
    way: cython.double = behind - before
    if way <= 4.0 * NEAR_S:
        return 1.0 / cell_s
    far = max((t - before) * (behind - t) / way - NEAR_S, 0.0)
    return 1.0 / (cell_s + WIDER * far * far / (far + NEAR_S))


def widths(
    end_s: cython.double,
    begins: cython.double[::1],
    ends: cython.double[::1],
    events: cython.double[::1],
    first: cython.double[::1],
) -> NDArray[np.float64]:
    """Widths (s) of cells from 0 to an end, with corners (k,) from when to when, beginning like `first` (0 to
    2,).

    `events` (e,), rising, are when anything else happens. Raises ArithmeticError where `end_s` or `first` are
    no times that a motion can take; what else is no number is ignored.
    """
    least: cython.Py_ssize_t = LEAST_CELLS if first.shape[0] == 0 else LEAST_LEFT
    cell_s: cython.double = min(CELL_S, end_s / least)
    m: cython.Py_ssize_t = 0
    room: cython.Py_ssize_t = 1024
    k: cython.Py_ssize_t
    low: cython.Py_ssize_t = 0
    count: cython.Py_ssize_t
    t: cython.double = 0.0
    before: cython.double = 0.0
    behind: cython.double
    wish: cython.double
    off: cython.double = 0.0
    grow: cython.double = 0.0
    if not NO_TIME_S < end_s < LONGEST_S:
        raise ArithmeticError(f"a motion that takes {end_s} s")
    for k in range(first.shape[0]):
        if not NO_TIME_S < first[k] < LONGEST_S:
            raise ArithmeticError(f"a cell that takes {first[k]} s")
    grid_array = np.empty((4, room))
    grid: cython.double[:, ::1] = grid_array
    behind = _next_event(0.0, end_s, begins, ends, events)
    while True:
        while t >= behind and behind < end_s:
            before = behind
            behind = _next_event(before, end_s, begins, ends, events)
        density = _base(t, before, behind, cell_s)
        while low < begins.shape[0] and ends[low] + BESIDE_S < t:
            low += 1
        for k in range(low, begins.shape[0]):
            if begins[k] - BESIDE_S > t:
                break
            if ends[k] + BESIDE_S >= t:
                wish = 1.0 / max((ends[k] - begins[k]) / CORNER_CELLS, SHORTEST_S)
                density = max(density, wish)
        if m == room:
            grid_array = np.concatenate([grid_array, np.empty((4, room))], axis=1)
            grid = grid_array
            room = 2 * room
        grid[0, m] = t
        grid[1, m] = density
        m += 1
        if t >= end_s:
            break
        # No step passes the beginning of a corner unseen.
        t = min(t + min(PER_CELL / density, PER_CELL * CELL_S + 0.1 * max(behind - t, 0.0)), end_s)
    if begins.shape[0] > 0:
        for _ in range(2):
            _smooth(grid, m, end_s)
    grid[2, 0] = 0.0
    for k in range(1, m):
        grid[2, k] = grid[2, k - 1] + 0.5 * (grid[1, k] + grid[1, k - 1]) * (grid[0, k] - grid[0, k - 1])
    total = grid[2, m - 1]
    count = max(4 * int(0.25 * total + 0.5), least)
    found_array = np.empty((2, count))
    found: cython.double[:, ::1] = found_array
    low = 0
    before = 0.0
    for k in range(count):
        t = total * (k + 1) / count
        while low < m - 2 and grid[2, low + 1] < t:
            low += 1
        # Between places the density is linear.
        t -= grid[2, low]
        density = (grid[1, low + 1] - grid[1, low]) / max(grid[0, low + 1] - grid[0, low], 1e-300)
        behind = grid[1, low] + sqrt(max(grid[1, low] * grid[1, low] + 2.0 * density * t, 0.0))
        behind = grid[0, low] + 2.0 * t / behind
        if k == count - 1:
            behind = end_s
        found[0, k] = behind - before
        before = behind
    for _ in range(2):
        for k in range(count):
            found[1, k] = (
                6.0 * found[0, k]
                + 4.0 * (found[0, _inside(k - 1, count)] + found[0, _inside(k + 1, count)])
                + found[0, _inside(k - 2, count)]
                + found[0, _inside(k + 2, count)]
            ) * 0.0625
        for k in range(count):
            found[0, k] = found[1, k]
    fade = 0.0
    if first.shape[0] > 0:
        off = first[0] / found[0, 0] - 1.0
        fade = 1.0
    if first.shape[0] > 1:
        grow = (first[1] / found[0, 1] - 1.0) * GROW - off
    before = 0.0
    behind = 0.0
    for k in range(count):
        found[1, k] = fade
        found[0, k] *= max(1.0 + (off + grow * k) * fade, LEAST_PART)
        before += found[0, k]
        behind += found[0, k] * (1.0 - fade)
        fade *= FADE
    for k in range(count):
        found[0, k] *= 1.0 + (end_s - before) / behind * (1.0 - found[1, k])
    chosen: NDArray[np.float64] = found_array[0].copy()
    return chosen


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _inside(k: cython.Py_ssize_t, count: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """The place k, mirrored at the first or the last of so many where it lies outside."""
    if k < 0:
        return -k
    return k if k < count else 2 * (count - 1) - k


@cython.cfunc
def _next_event(
    t: cython.double,
    end_s: cython.double,
    begins: cython.double[::1],
    ends: cython.double[::1],
    events: cython.double[::1],
) -> cython.double:
    """The first event or border of a corner after a time."""
    found: cython.double = end_s
    for k in range(begins.shape[0]):
        if t < begins[k] < found:
            found = begins[k]
        if t < ends[k] < found:
            found = ends[k]
    for k in range(events.shape[0]):
        if t < events[k] < found:
            found = events[k]
    return found


@cython.cfunc
def _smooth(grid: cython.double[:, ::1], m: cython.Py_ssize_t, end_s: cython.double) -> cython.void:
    """Let the density (row 1) be its mean over BESIDE_S; rows 2 and 3 are used."""
    low: cython.Py_ssize_t = 0
    high: cython.Py_ssize_t = 0
    grid[2, 0] = 0.0
    for k in range(1, m):
        grid[2, k] = grid[2, k - 1] + 0.5 * (grid[1, k] + grid[1, k - 1]) * (grid[0, k] - grid[0, k - 1])
    for k in range(m):
        begins = max(grid[0, k] - 0.5 * BESIDE_S, 0.0)
        ends = min(grid[0, k] + 0.5 * BESIDE_S, end_s)
        while low < m - 2 and grid[0, low + 1] < begins:
            low += 1
        while high < m - 2 and grid[0, high + 1] < ends:
            high += 1
        grid[3, k] = (_sum_at(grid, high, ends) - _sum_at(grid, low, begins)) / (ends - begins)
    for k in range(m):
        grid[1, k] = grid[3, k]


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _sum_at(grid: cython.double[:, ::1], k: cython.Py_ssize_t, t: cython.double) -> cython.double:
    return grid[2, k] + (grid[2, k + 1] - grid[2, k]) * (t - grid[0, k]) / max(
        grid[0, k + 1] - grid[0, k], 1e-300
    )

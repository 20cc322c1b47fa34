"""What bounds the clock of a chain, cell by cell (see `timing.clock_kernel`); compiled by Cython.

Rows are found at knots and at both ends of each cell; limits are looked at in more places, at parts of
cells from end to end, some more of them in corners, and on both sides of where jerks jump there.
"""

# mypy: allow-untyped-decorators

import cython
from cython.cimports.libc.math import fabs

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.queue.chain_kernel import JointPath
    from cython.cimports.iiwa_sim.motion.queue.shapes_kernel import part_at, spline
    from cython.cimports.iiwa_sim.motion.timing.bounds_kernel import Rows
    from cython.cimports.iiwa_sim.motion.timing.choice_kernel import chosen
else:
    from iiwa_sim.motion.queue.chain_kernel import JointPath
    from iiwa_sim.motion.queue.shapes_kernel import part_at, spline
    from iiwa_sim.motion.timing.bounds_kernel import Rows
    from iiwa_sim.motion.timing.choice_kernel import chosen

UNIT_S = 0.01
"""The clock counts time in this unit."""
_UNIT_S = cython.declare(cython.double, 0.01)
# Jerks inside a cell count as larger than those at its ends by this factor at most.
PEAK = cython.declare(cython.double, 1.1)
# Limits are looked at in so many places of a cell, its ends included: outside of corners, and in corners.
PLAIN = cython.declare(cython.int, 3)
BENT = cython.declare(cython.int, 7)
# The first and last so many cells of a chain, where the clock may bend most, get so many more places.
ENDS = cython.declare(cython.Py_ssize_t, 3)
MORE = cython.declare(cython.int, 4)
# A long cell gets one more place for each such part of x, up to so many in all.
LONG = cython.declare(cython.double, 0.0101)
MOST = cython.declare(cython.int, 24)
# A jump of the third derivative is looked at on both sides: at the edge of a corner so near to it, as a part
# of the corner, and as a part of the cell; at any other jump so near, as a part of the cell.
JUMP = cython.declare(cython.double, 1.5e-5)
SAME = cython.declare(cython.double, 0.01)
AT_ONCE = cython.declare(cython.double, 1e-6)


def layout(
    way: JointPath, controls: cython.double[::1], first: cython.Py_ssize_t, starts: cython.Py_ssize_t[::1]
) -> int:
    """Write where in the list of places those of the cells from `first` on begin (N + 1,), and give their
    number.

    `controls` (N + 3,) is x as a cubic B-spline over the cells.
    """
    edges = way.edges
    e: cython.Py_ssize_t = 0
    move: cython.Py_ssize_t = 0
    count: cython.Py_ssize_t
    ends: cython.double = spline(controls, first, 0.0)
    bent: cython.bint
    while e < edges.shape[0] and edges[e] < ends:
        e += 1
    for k in range(first, controls.shape[0] - 3):
        begins, ends = ends, spline(controls, k, 1.0)
        move = way.find(begins, move)
        bent = way.corner_at(begins, move) >= 0
        count = 0
        while e < edges.shape[0] and edges[e] < ends:
            count += 1
            e += 1
        if bent or count > 0:
            starts[k + 1] = starts[k] + count + BENT
        else:
            # A cell from a trial clock may run backwards, or be no number: it has its least places, too.
            long = min(max(0.0, (ends - begins) / LONG), 1.0 * MOST)
            count = PLAIN if way.is_straight(move) else PLAIN + int(long)
            if k < ENDS or k >= controls.shape[0] - 3 - ENDS:
                count += MORE
            starts[k + 1] = starts[k] + min(count, MOST)
    return int(starts[controls.shape[0] - 3])


@cython.cfunc
@cython.exceptval(check=False)
def _spread(
    parts: cython.double[::1], first: cython.Py_ssize_t, last: cython.Py_ssize_t, used: cython.Py_ssize_t
) -> cython.void:
    """Fill the places first..last - 1 of a cell: its ends, those that lie behind `first` already, rising, and
    others, each in the middle of what is the widest gap."""
    parts[first] = 0.0
    if used == 0:
        for o in range(1, last - first):
            parts[first + o] = cython.cast(cython.double, o) / (last - first - 1)
        return
    parts[first + used + 1] = 1.0
    for p in range(first + used + 2, last):
        widest = first
        for o in range(first, p - 1):
            if parts[o + 1] - parts[o] > parts[widest + 1] - parts[widest]:
                widest = o
        for o in range(p, widest + 1, -1):
            parts[o] = parts[o - 1]
        parts[widest + 1] = 0.5 * (parts[widest] + parts[widest + 2])


@cython.cfunc
@cython.exceptval(check=False)
def _over_theta(
    way: JointPath,
    controls: cython.double[::1],
    k: cython.Py_ssize_t,
    u: cython.double,
    out: cython.double[:, ::1],
    at: cython.Py_ssize_t,
) -> cython.void:
    """Write three derivatives of joints over theta at a part of a cell to rows from `at` on; what `way` found
    last is there."""
    x3 = controls[k + 3] - 3.0 * controls[k + 2] + 3.0 * controls[k + 1] - controls[k]
    x2 = (controls[k + 2] - 2.0 * controls[k + 1] + controls[k]) + u * x3
    x1 = 0.5 * (controls[k + 2] - controls[k]) + u * (x2 - 0.5 * u * x3)
    for i in range(way.joint_count):
        f1 = way.here[1, 0, i]
        f2 = way.here[2, 0, i]
        out[at, i] = f1 * x1
        out[at + 1, i] = f2 * x1 * x1 + f1 * x2
        out[at + 2, i] = way.here[3, 0, i] * x1 * x1 * x1 + 3.0 * f2 * x1 * x2 + f1 * x3


@cython.cfunc
@cython.exceptval(check=False)
def _narrow(
    way: JointPath, move: cython.Py_ssize_t, corner: cython.Py_ssize_t, limits: cython.double[:, ::1]
) -> cython.void:
    """Lower limits (3, n), where they are higher, to those of a move, or of a corner between two."""
    for o in range(3):
        for i in range(way.joint_count):
            limits[o, i] = min(limits[o, i], way.limit(move, corner, o, i))


def write(
    way: JointPath,
    controls: cython.double[::1],
    first: cython.Py_ssize_t,
    last: cython.Py_ssize_t,
    rows: Rows,
    scratch: cython.double[:, ::1],
) -> None:
    """Write what belongs to the cells first..last - 1 and their first knots, and to the last knot of all.

    `scratch` is (15, n). Limits that change within a cell are taken at their least. Rows of joints that do
    not matter are left out: `counts` (N + 1, 3) says how many are kept at a knot, and at the ends of the cell
    behind it.
    """
    n: cython.Py_ssize_t = way.joint_count
    cells: cython.Py_ssize_t = controls.shape[0] - 3
    e: cython.Py_ssize_t = 0
    limits: cython.double[:, ::1] = scratch[12:15]
    edges = way.edges
    alike: cython.bint = False  # whether limits did not change in the cell before,
    known: cython.bint  # and in this one
    if first >= last:
        return
    x = min(max(spline(controls, first, 0.0), way.first_x), way.end_x)
    move = way.find(x, 0)
    corner = way.at(x, move, 3)
    while e < edges.shape[0] and edges[e] < x:
        e += 1
    for k in range(first, last):
        # Rows 0 to 2 of the scratch are the beginning of the cell, which `way` found last, 3 to 5 its end.
        _over_theta(way, controls, k, 0.0, scratch, 0)
        if not alike:
            for o in range(3):
                for i in range(n):
                    limits[o, i] = 1e300
            _narrow(way, move, corner, limits)
        known = alike
        alike = True
        x = spline(controls, k, 1.0)
        used = 0
        while e < edges.shape[0] and edges[e] < x and rows.starts[k] + used + 2 < rows.starts[k + 1]:
            used += 1
            rows.parts[rows.starts[k] + used] = part_at(controls, k, edges[e])
            e += 1
        _spread(rows.parts, rows.starts[k], rows.starts[k + 1], used)
        for o in range(3):
            for i in range(n):
                rows.inner[rows.starts[k], o, i] = scratch[o, i]
        x = min(max(spline(controls, k, 0.0), way.first_x), way.end_x)
        for p in range(rows.starts[k] + 1, rows.starts[k + 1]):
            u = rows.parts[p]
            last_x, x = x, min(max(spline(controls, k, u), way.first_x), way.end_x)
            before_move, before_corner = move, corner
            move = way.find(x, move)
            corner = way.at(x, move, 3)
            if move != before_move or corner != before_corner:
                _narrow(way, move, corner, limits)
                alike = known = False
            _over_theta(way, controls, k, u, rows.inner[p], 0)
            if u - rows.parts[p - 1] < AT_ONCE:
                rows.parts[p] = rows.parts[p - 1]
            o = max(corner, before_corner)
            if o >= 0:
                span = way.before[o] * (way.targets[o] - way.targets[o - 1])
                span += way.after[o] * (way.targets[o + 1] - way.targets[o])
                if x - last_x < JUMP * span and u - rows.parts[p - 1] < SAME:
                    # What is behind the jump is told for the place of the jump.
                    y = u - rows.parts[p - 1]
                    for i in range(n):
                        rows.inner[p, 0, i] -= y * (rows.inner[p, 1, i] - 0.5 * y * rows.inner[p, 2, i])
                        rows.inner[p, 1, i] -= y * rows.inner[p, 2, i]
                    rows.parts[p] = rows.parts[p - 1]
        _over_theta(way, controls, k, 1.0, scratch, 3)
        for p in range(rows.starts[k], rows.starts[k + 1]):
            for o in range(3):
                for i in range(n):
                    rows.peaks[k, o, i] = max(rows.peaks[k, o, i], fabs(rows.inner[p, o, i]))
        y = 1.0
        for o in range(3):
            y *= _UNIT_S
            for i in range(n):
                rows.per_limit[k, o, i] = rows.per_limit[k - 1, o, i] if known else 1.0 / (limits[o, i] * y)
        _knot(scratch, 0, k, rows)
        if k == cells - 1:
            _knot(scratch, 3, k + 1, rows)
        # A corner may begin inside: then what asks most of a joint in that half stands for an end.
        for half in range(2):
            o = 2 * k + half
            for i in range(n):
                y = rows.per_limit[k, 2, i]
                most = PEAK * max(fabs(scratch[2, i]), fabs(scratch[5, i]))
                rows.bounds.j1[o, i] = 0.5 * scratch[3 * half, i] * y
                rows.bounds.j2[o, i] = 1.5 * scratch[3 * half + 1, i] * y
                rows.bounds.j3[o, i] = scratch[3 * half + 2, i] * y
                if rows.peaks[k, 2, i] <= most:
                    continue
                for p in range(rows.starts[k], rows.starts[k + 1]):
                    if (rows.parts[p] < 0.5) == (half == 0) and fabs(rows.inner[p, 2, i]) > most:
                        most = fabs(rows.inner[p, 2, i])
                        rows.bounds.j1[o, i] = 0.5 * rows.inner[p, 0, i] * y
                        rows.bounds.j2[o, i] = 1.5 * rows.inner[p, 1, i] * y
                        rows.bounds.j3[o, i] = rows.inner[p, 2, i] * y
            rows.bounds.counts[k, 1 + half] = chosen(
                rows.bounds.j1, rows.bounds.j2, rows.bounds.j3, o, n, 3, scratch
            )


@cython.cfunc
@cython.exceptval(check=False)
def _knot(
    scratch: cython.double[:, ::1],
    at: cython.Py_ssize_t,
    k: cython.Py_ssize_t,
    rows: Rows,
) -> cython.void:
    """Write the rows of velocities and accelerations at a knot, from the derivatives in the scratch."""
    before: cython.Py_ssize_t = k - 1 if k > 0 else 0
    behind: cython.Py_ssize_t = k if k < rows.bounds.cells else rows.bounds.cells - 1
    rows.bounds.cap[k] = 1e12
    for i in range(scratch.shape[1]):
        y = max(rows.per_limit[before, 1, i], rows.per_limit[behind, 1, i])
        rows.bounds.a1[k, i] = 0.5 * scratch[at, i] * y
        rows.bounds.a2[k, i] = scratch[at + 1, i] * y
        y = fabs(scratch[at, i]) * max(rows.per_limit[before, 0, i], rows.per_limit[behind, 0, i])
        if y * y * rows.bounds.cap[k] > 1.0:
            rows.bounds.cap[k] = 1.0 / (y * y)
    rows.bounds.counts[k, 0] = chosen(
        rows.bounds.a1, rows.bounds.a2, rows.bounds.a2, k, scratch.shape[1], 2, scratch
    )

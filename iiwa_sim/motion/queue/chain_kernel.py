"""Where a chain of moves goes, and how fast, in loops; compiled by Cython.

x runs along a chain: the move k lies between `targets[k]` and `targets[k + 1]`, and goes evenly with its
own s. Round the target k the moves before and behind it are added: with v from 0 to 1 the first goes to
its end as s = 1 - before F(1 - v) while the second sets out as s = after F(v), F being a cubic up to rho
and then a parabola; and x is what both have done. So outside a corner a chain is exactly on the path of
one move.

A chain as arrays of float64, for K moves: `targets` (K + 1,), `before`, `after`, `rho` (K + 1,) of the
corners (0 where there is none); their polynomials put together as `borders`, `offsets` and
`coefficients`, where `pieces` (K + 1,) is the index of each move's first border.
"""

# mypy: allow-untyped-decorators

import cython
from cython.cimports.libc.math import fabs

PEAK = cython.declare(cython.double, 1.1)  # of jerks inside a cell, over those at its ends
PLACES = cython.declare(cython.double, 1e-15)


@cython.cfunc
def _polynomial(
    borders: cython.double[::1],
    offsets: cython.Py_ssize_t[::1],
    coefficients: cython.double[:, ::1],
    first: cython.Py_ssize_t,
    last: cython.Py_ssize_t,
    s: cython.double,
    order: cython.int,
    out: cython.double[:, ::1],
) -> cython.void:
    """q, q', q'', q''' (4, n) of the polynomial with borders first..last, up to an order, by Clenshaw's
    recurrence."""
    n: cython.Py_ssize_t = coefficients.shape[1]
    piece: cython.Py_ssize_t = first
    row: cython.Py_ssize_t
    i: cython.Py_ssize_t
    start: cython.Py_ssize_t
    end: cython.Py_ssize_t
    scale: cython.double
    x: cython.double
    a: cython.double
    b0: cython.double
    b1: cython.double
    b2: cython.double
    c0: cython.double
    c1: cython.double
    c2: cython.double
    d0: cython.double
    d1: cython.double
    d2: cython.double
    e0: cython.double
    e1: cython.double
    e2: cython.double
    while piece < last - 1 and borders[piece + 1] <= s:
        piece += 1
    # A move of p pieces has p + 1 borders and p + 1 offsets.
    start = offsets[piece]
    end = offsets[piece + 1]
    scale = 2.0 / (borders[piece + 1] - borders[piece])
    x = (s - borders[piece]) * scale - 1.0
    if end - start == 2:
        for i in range(n):
            out[0, i] = coefficients[start, i] + x * coefficients[start + 1, i]
            out[1, i] = coefficients[start + 1, i] * scale
            out[2, i] = 0.0
            out[3, i] = 0.0
        return
    if order == 0:
        for i in range(n):
            b1 = 0.0
            b2 = 0.0
            for row in range(end - 1, start, -1):
                b0 = coefficients[row, i] + 2.0 * x * b1 - b2
                b2 = b1
                b1 = b0
            out[0, i] = coefficients[start, i] + x * b1 - b2
        return
    for i in range(n):
        b1 = 0.0
        b2 = 0.0
        c1 = 0.0
        c2 = 0.0
        d1 = 0.0
        d2 = 0.0
        e1 = 0.0
        e2 = 0.0
        for row in range(end - 1, start, -1):
            a = coefficients[row, i]
            e0 = 6.0 * d1 + 2.0 * x * e1 - e2
            d0 = 4.0 * c1 + 2.0 * x * d1 - d2
            c0 = 2.0 * b1 + 2.0 * x * c1 - c2
            b0 = a + 2.0 * x * b1 - b2
            b2 = b1
            b1 = b0
            c2 = c1
            c1 = c0
            d2 = d1
            d1 = d0
            e2 = e1
            e1 = e0
        out[0, i] = coefficients[start, i] + x * b1 - b2
        out[1, i] = (b1 + x * c1 - c2) * scale
        out[2, i] = (2.0 * c1 + x * d1 - d2) * scale * scale
        out[3, i] = (3.0 * d1 + x * e1 - e2) * scale * scale * scale


@cython.cfunc
@cython.inline
def _height(rho: cython.double) -> cython.double:
    return 1.0 / (rho * (3.0 - 3.0 * rho + rho * rho))


@cython.cfunc
@cython.inline
def _shape(v: cython.double, rho: cython.double, height: cython.double, order: cython.int) -> cython.double:
    """F(v), or a derivative of it."""
    if v < rho:
        if order == 0:
            return height * v * v * v
        if order == 1:
            return 3.0 * height * v * v
        if order == 2:
            return 6.0 * height * v
        return 6.0 * height
    if order == 0:
        return height * rho * (3.0 * v * v - 3.0 * rho * v + rho * rho)
    if order == 1:
        return height * rho * (6.0 * v - 3.0 * rho)
    if order == 2:
        return 6.0 * height * rho
    return 0.0


@cython.cfunc
def _corner(
    x: cython.double,
    first_x: cython.double,
    second_x: cython.double,
    rho: cython.double,
) -> cython.double:
    """v at an x from the target of a corner that spans from -first_x to second_x."""
    height: cython.double = _height(rho)
    low: cython.double = 0.0
    high: cython.double = 1.0
    v: cython.double = (x + first_x) / (first_x + second_x)
    y: cython.double
    slope: cython.double
    _: cython.int
    for _ in range(60):
        y = second_x * _shape(v, rho, height, 0) - first_x * _shape(1.0 - v, rho, height, 0) - x
        if y > 0.0:
            high = v
        else:
            low = v
        slope = second_x * _shape(v, rho, height, 1) + first_x * _shape(1.0 - v, rho, height, 1)
        y = v - y / slope
        if y < low or y > high:
            y = 0.5 * (low + high)
        if fabs(y - v) < PLACES:
            return y
        v = y
    return v


@cython.cfunc
def _at(
    x: cython.double,
    k: cython.Py_ssize_t,
    order: cython.int,
    targets: cython.double[::1],
    before: cython.double[::1],
    after: cython.double[::1],
    rho: cython.double[::1],
    pieces: cython.Py_ssize_t[::1],
    borders: cython.double[::1],
    offsets: cython.Py_ssize_t[::1],
    coefficients: cython.double[:, ::1],
    one: cython.double[:, ::1],
    other: cython.double[:, ::1],
) -> cython.Py_ssize_t:
    """Write q and its derivatives over x (4, n) to `one`, at an x on the move k. Gives the corner it is in,
    or -1."""
    n: cython.Py_ssize_t = coefficients.shape[1]
    i: cython.Py_ssize_t
    c: cython.Py_ssize_t
    length: cython.double = targets[k + 1] - targets[k]
    next_length: cython.double
    first_x: cython.double
    second_x: cython.double
    height: cython.double
    v: cython.double
    v1: cython.double
    v2: cython.double
    v3: cython.double
    x1: cython.double
    x2: cython.double
    x3: cython.double
    a1: cython.double
    a2: cython.double
    a3: cython.double
    b1: cython.double
    b2: cython.double
    b3: cython.double
    y1: cython.double
    y2: cython.double
    y3: cython.double
    c = -1
    if before[k + 1] > 0.0 and x > targets[k + 1] - before[k + 1] * length:
        c = k + 1
    elif after[k] > 0.0 and x < targets[k] + after[k] * length:
        c = k
    if c < 0:
        v = (x - targets[k]) / length
        _polynomial(borders, offsets, coefficients, pieces[k], pieces[k + 1] - 1, v, order, one)
        if order > 0:
            v = 1.0 / length
            for i in range(n):
                one[1, i] *= v
                one[2, i] *= v * v
                one[3, i] *= v * v * v
        return c
    length = targets[c] - targets[c - 1]
    next_length = targets[c + 1] - targets[c]
    first_x = before[c] * length
    second_x = after[c] * next_length
    v = _corner(x - targets[c], first_x, second_x, rho[c])
    height = _height(rho[c])
    y1 = 1.0 - before[c] * _shape(1.0 - v, rho[c], height, 0)
    _polynomial(borders, offsets, coefficients, pieces[c - 1], pieces[c] - 1, y1, order, one)
    y1 = after[c] * _shape(v, rho[c], height, 0)
    _polynomial(borders, offsets, coefficients, pieces[c], pieces[c + 1] - 1, y1, order, other)
    # The second begins where the first ends, at the values of their polynomials.
    if order > 0:
        a1 = _shape(1.0 - v, rho[c], height, 1)
        a2 = -_shape(1.0 - v, rho[c], height, 2)
        a3 = _shape(1.0 - v, rho[c], height, 3)
        b1 = _shape(v, rho[c], height, 1)
        b2 = _shape(v, rho[c], height, 2)
        b3 = _shape(v, rho[c], height, 3)
        x1 = first_x * a1 + second_x * b1
        x2 = first_x * a2 + second_x * b2
        x3 = first_x * a3 + second_x * b3
        v1 = 1.0 / x1
        v2 = -x2 * v1 * v1 * v1
        v3 = (3.0 * x2 * x2 - x1 * x3) * v1 * v1 * v1 * v1 * v1
        # s of both over x
        y1 = before[c]
        a3 = y1 * (a3 * v1 * v1 * v1 + 3.0 * a2 * v1 * v2 + a1 * v3)
        a2 = y1 * (a2 * v1 * v1 + a1 * v2)
        a1 = y1 * a1 * v1
        y1 = after[c]
        b3 = y1 * (b3 * v1 * v1 * v1 + 3.0 * b2 * v1 * v2 + b1 * v3)
        b2 = y1 * (b2 * v1 * v1 + b1 * v2)
        b1 = y1 * b1 * v1
        for i in range(n):
            y1 = one[1, i] * a1
            y2 = one[2, i] * a1 * a1 + one[1, i] * a2
            y3 = one[3, i] * a1 * a1 * a1 + 3.0 * one[2, i] * a1 * a2 + one[1, i] * a3
            one[1, i] = y1 + other[1, i] * b1
            one[2, i] = y2 + other[2, i] * b1 * b1 + other[1, i] * b2
            one[3, i] = y3 + other[3, i] * b1 * b1 * b1 + 3.0 * other[2, i] * b1 * b2 + other[1, i] * b3
    for i in range(n):
        one[0, i] += other[0, i]
    _polynomial(borders, offsets, coefficients, pieces[c], pieces[c + 1] - 1, 0.0, 0, other)
    for i in range(n):
        one[0, i] -= other[0, i]
    return c


def derivatives(
    x: cython.double[::1],
    targets: cython.double[::1],
    before: cython.double[::1],
    after: cython.double[::1],
    rho: cython.double[::1],
    pieces: cython.Py_ssize_t[::1],
    borders: cython.double[::1],
    offsets: cython.Py_ssize_t[::1],
    coefficients: cython.double[:, ::1],
    limits: cython.double[:, :, ::1],
    scratch: cython.double[:, :, ::1],
    found: cython.double[:, :, ::1],
    limits_there: cython.double[:, :, ::1],
) -> cython.void:
    """Write q, dq/dx, d2q/dx2, d3q/dx3 (m, 4, n) at rising x (m,), and the limits that hold there (m, 3, n).

    `limits` (K, 3, n) are velocity, acceleration and jerk of each move: in a corner the larger of two.
    `scratch` is (2, 4, n).
    """
    m: cython.Py_ssize_t = x.shape[0]
    n: cython.Py_ssize_t = coefficients.shape[1]
    last: cython.Py_ssize_t = targets.shape[0] - 2
    k: cython.Py_ssize_t = 0
    p: cython.Py_ssize_t
    i: cython.Py_ssize_t
    o: cython.Py_ssize_t
    c: cython.Py_ssize_t
    one: cython.double[:, ::1] = scratch[0]
    other: cython.double[:, ::1] = scratch[1]
    for p in range(m):
        while k < last and x[p] >= targets[k + 1]:
            k += 1
        while k > 0 and x[p] < targets[k]:
            k -= 1
        c = _at(x[p], k, 3, targets, before, after, rho, pieces, borders, offsets, coefficients, one, other)
        for o in range(4):
            for i in range(n):
                found[p, o, i] = one[o, i]
        for o in range(3):
            for i in range(n):
                limits_there[p, o, i] = limits[k, o, i]
                if c >= 0:
                    if limits[c - 1, o, i] > limits_there[p, o, i]:
                        limits_there[p, o, i] = limits[c - 1, o, i]
                    if limits[c, o, i] > limits_there[p, o, i]:
                        limits_there[p, o, i] = limits[c, o, i]


def rows(
    controls: cython.double[::1],
    found: cython.double[:, :, ::1],
    limits: cython.double[:, :, ::1],
    inner_cells: cython.Py_ssize_t[::1],
    inner_parts: cython.double[::1],
    found_inside: cython.double[:, :, ::1],
    limits_inside: cython.double[:, :, ::1],
    unit: cython.double,
    ends: cython.double[:, ::1],
    a1: cython.double[:, ::1],
    a2: cython.double[:, ::1],
    cap: cython.double[::1],
    j1: cython.double[:, ::1],
    j2: cython.double[:, ::1],
    j3: cython.double[:, ::1],
    inner: cython.double[:, :, ::1],
    cell_limits: cython.double[:, :, ::1],
) -> cython.void:
    """Write the rows of `clock_kernel` and what `inner_loads` wants.

    `controls` (N + 3,) is x as a cubic B-spline over the cells; `found` and `limits` (N + 1, ...) are
    those of `derivatives` at the knots, `found_inside` and `limits_inside` (m, ...) at parts (m,) of
    cells (m,). Limits that change within a cell are taken at their least. `unit` is the unit of time of
    the clock in s, `ends` (2 N, n) scratch.
    """
    cells: cython.Py_ssize_t = controls.shape[0] - 3
    n: cython.Py_ssize_t = found.shape[2]
    k: cython.Py_ssize_t
    i: cython.Py_ssize_t
    a: cython.Py_ssize_t
    p: cython.Py_ssize_t
    o: cython.Py_ssize_t
    e: cython.Py_ssize_t
    u: cython.double
    x1: cython.double
    x2: cython.double
    x3: cython.double
    y: cython.double
    q1: cython.double
    q2: cython.double
    q3: cython.double
    scale: cython.double
    for k in range(cells):
        for o in range(3):
            for i in range(n):
                y = limits[k, o, i]
                if limits[k + 1, o, i] < y:
                    y = limits[k + 1, o, i]
                cell_limits[k, o, i] = y
    for a in range(inner.shape[0]):
        k = inner_cells[a]
        for o in range(3):
            for i in range(n):
                if limits_inside[a, o, i] < cell_limits[k, o, i]:
                    cell_limits[k, o, i] = limits_inside[a, o, i]
    scale = 1.0
    for o in range(3):
        scale *= unit
        for k in range(cells):
            for i in range(n):
                cell_limits[k, o, i] *= scale
    for k in range(cells + 1):
        x1 = 0.5 * (controls[k + 2] - controls[k])
        x2 = controls[k + 2] - 2.0 * controls[k + 1] + controls[k]
        cap[k] = 1e12
        for i in range(n):
            q1 = found[k, 1, i] * x1
            q2 = found[k, 2, i] * x1 * x1 + found[k, 1, i] * x2
            e = k if k < cells else cells - 1
            o = k - 1 if k > 0 else 0
            y = cell_limits[e, 1, i]
            if cell_limits[o, 1, i] < y:
                y = cell_limits[o, 1, i]
            a1[k, i] = 0.5 * q1 / y
            a2[k, i] = q2 / y
            y = cell_limits[e, 0, i]
            if cell_limits[o, 0, i] < y:
                y = cell_limits[o, 0, i]
            if fabs(q1) > 1e-6 * y:
                y = y / q1
                if y * y < cap[k]:
                    cap[k] = y * y
            for e in range(2):
                if (e == 0 and k == cells) or (e == 1 and k == 0):
                    continue
                # The end of the cell before, or the beginning of this one.
                o = 2 * k if e == 0 else 2 * k - 1
                p = k if e == 0 else k - 1
                x3 = controls[p + 3] - 3.0 * controls[p + 2] + 3.0 * controls[p + 1] - controls[p]
                q3 = found[k, 3, i] * x1 * x1 * x1 + 3.0 * found[k, 2, i] * x1 * x2 + found[k, 1, i] * x3
                y = 1.0 / cell_limits[p, 2, i]
                j1[o, i] = 0.5 * q1 * y
                j2[o, i] = 1.5 * q2 * y
                j3[o, i] = q3 * y
                ends[o, i] = q3 * y
    for a in range(inner.shape[0]):
        k = inner_cells[a]
        u = inner_parts[a]
        x3 = controls[k + 3] - 3.0 * controls[k + 2] + 3.0 * controls[k + 1] - controls[k]
        x2 = (controls[k + 2] - 2.0 * controls[k + 1] + controls[k]) + u * x3
        x1 = 0.5 * (controls[k + 2] - controls[k]) + u * (x2 - 0.5 * u * x3)
        for i in range(n):
            inner[a, 0, i] = found_inside[a, 1, i] * x1
            inner[a, 1, i] = found_inside[a, 2, i] * x1 * x1 + found_inside[a, 1, i] * x2
            inner[a, 2, i] = (
                found_inside[a, 3, i] * x1 * x1 * x1
                + 3.0 * found_inside[a, 2, i] * x1 * x2
                + found_inside[a, 1, i] * x3
            )
    # A corner may begin inside: then what asks most of a joint in that half stands for an end.
    for a in range(inner.shape[0]):
        k = inner_cells[a]
        o = 2 * k if inner_parts[a] < 0.5 else 2 * k + 1
        for i in range(n):
            y = 1.0 / cell_limits[k, 2, i]
            q1 = PEAK * fabs(ends[2 * k, i])
            if PEAK * fabs(ends[2 * k + 1, i]) > q1:
                q1 = PEAK * fabs(ends[2 * k + 1, i])
            if fabs(j3[o, i]) > q1:
                q1 = fabs(j3[o, i])
            if fabs(inner[a, 2, i]) * y > q1:
                j1[o, i] = 0.5 * inner[a, 0, i] * y
                j2[o, i] = 1.5 * inner[a, 1, i] * y
                j3[o, i] = inner[a, 2, i] * y


def positions(
    controls: cython.double[::1],
    cells: cython.Py_ssize_t[::1],
    parts: cython.double[::1],
    targets: cython.double[::1],
    before: cython.double[::1],
    after: cython.double[::1],
    rho: cython.double[::1],
    pieces: cython.Py_ssize_t[::1],
    borders: cython.double[::1],
    offsets: cython.Py_ssize_t[::1],
    coefficients: cython.double[:, ::1],
    scratch: cython.double[:, :, ::1],
    found: cython.double[:, ::1],
) -> cython.void:
    """Write joint positions (m, n) at parts of cells (m,) that follow each other. `controls` (N + 3,) is x
    as a cubic B-spline, `scratch` is (2, 4, n)."""
    n: cython.Py_ssize_t = coefficients.shape[1]
    last: cython.Py_ssize_t = targets.shape[0] - 2
    k: cython.Py_ssize_t = 0
    p: cython.Py_ssize_t
    i: cython.Py_ssize_t
    u: cython.double
    w: cython.double
    x: cython.double
    one: cython.double[:, ::1] = scratch[0]
    other: cython.double[:, ::1] = scratch[1]
    for p in range(cells.shape[0]):
        i = cells[p]
        u = parts[p]
        w = 1.0 - u
        x = (
            w * w * w * controls[i]
            + (3.0 * u * u * u - 6.0 * u * u + 4.0) * controls[i + 1]
            + (3.0 * w * w * w - 6.0 * w * w + 4.0) * controls[i + 2]
            + u * u * u * controls[i + 3]
        ) / 6.0
        if x > targets[last + 1]:
            x = targets[last + 1]
        if x < targets[0]:
            x = targets[0]
        while k < last and x >= targets[k + 1]:
            k += 1
        while k > 0 and x < targets[k]:
            k -= 1
        _at(x, k, 0, targets, before, after, rho, pieces, borders, offsets, coefficients, one, other)
        for i in range(n):
            found[p, i] = one[0, i]

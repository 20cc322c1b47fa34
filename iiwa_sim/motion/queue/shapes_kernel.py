"""Functions of one variable of which chains are made: of corners, and of x over cells; compiled by Cython."""

# mypy: allow-untyped-decorators

import cython
from cython.cimports.libc.math import fabs

PLACES = cython.declare(cython.double, 1e-15)
# A step of Newton's method as small as this, as a part of a cell, leaves nothing but rounding.
STEP = cython.declare(cython.double, 1e-9)


@cython.ccall
@cython.exceptval(check=False)
def shape(v: cython.double, rho: cython.double, height: cython.double, order: cython.int) -> cython.double:
    """F(v), the shape of corners: a cubic up to rho, then a parabola; or its derivative of an order.

    `height` is what makes F(1) = 1: 1 / (rho (3 - 3 rho + rho^2))."""
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
@cython.exceptval(check=False)
def corner_part(
    x: cython.double,
    first_x: cython.double,
    second_x: cython.double,
    rho: cython.double,
    height: cython.double,
) -> cython.double:
    """v (0 to 1) in a corner from first_x before its target to second_x behind it, at an x counted from the
    target."""
    low: cython.double = 0.0
    high: cython.double = 1.0
    v: cython.double = (x + first_x) / (first_x + second_x)
    for _ in range(60):
        y = second_x * shape(v, rho, height, 0) - first_x * shape(1.0 - v, rho, height, 0) - x
        if y > 0.0:
            high = v
        else:
            low = v
        slope = second_x * shape(v, rho, height, 1) + first_x * shape(1.0 - v, rho, height, 1)
        y = v - y / slope
        if y < low or y > high:
            y = 0.5 * (low + high)
        if fabs(y - v) < PLACES:
            return y
        v = y
    return v


@cython.cfunc
@cython.exceptval(check=False)
def spline(controls: cython.double[::1], cell: cython.Py_ssize_t, part: cython.double) -> cython.double:
    """x at a part of a cell; `controls` (N + 3,) are those of a cubic B-spline over cells."""
    u: cython.double = part
    w: cython.double = 1.0 - u
    return (
        w * w * w * controls[cell]
        + (3.0 * u * u * u - 6.0 * u * u + 4.0) * controls[cell + 1]
        + (3.0 * w * w * w - 6.0 * w * w + 4.0) * controls[cell + 2]
        + u * u * u * controls[cell + 3]
    ) / 6.0


@cython.cfunc
@cython.exceptval(check=False)
def spline_slope(controls: cython.double[::1], cell: cython.Py_ssize_t, part: cython.double) -> cython.double:
    """dx per cell at a part of a cell; `controls` (N + 3,) are those of a cubic B-spline over cells."""
    u: cython.double = part
    w: cython.double = 1.0 - u
    return 0.5 * (
        u * u * (controls[cell + 3] - controls[cell + 2])
        + (1.0 + 2.0 * u * w) * (controls[cell + 2] - controls[cell + 1])
        + w * w * (controls[cell + 1] - controls[cell])
    )


@cython.cfunc
@cython.exceptval(check=False)
def part_at(controls: cython.double[::1], k: cython.Py_ssize_t, x: cython.double) -> cython.double:
    """The part of a cell where x is, to rounding: x never falls over a border of pieces that is near it.

    `controls` (N + 3,) are those of a cubic B-spline that grows over the cell k. Found by
    Newton's method, which halves where a step would leave what is known to hold x."""
    low: cython.double = 0.0
    high: cython.double = 1.0
    first: cython.double = spline(controls, k, 0.0)
    last: cython.double = spline(controls, k, 1.0)
    if x <= first or x >= last:
        return 0.0 if x <= first else 1.0
    part: cython.double = (x - first) / (last - first)
    for _ in range(60):
        y = spline(controls, k, part) - x
        if y > 0.0:
            high = part
        else:
            low = part
        slope = spline_slope(controls, k, part)
        y = part - y / slope if slope > 0.0 else -1.0
        if y < low or y > high:
            y = 0.5 * (low + high)
        if fabs(y - part) < STEP:
            return y
        part = y
    return part

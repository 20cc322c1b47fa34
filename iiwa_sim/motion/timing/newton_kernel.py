"""The equations of a step to a faster clock, and their solution; compiled by Cython.

c, n, t and w as in `clock_kernel`, rows and groups as its `Steps` has them.
"""

# mypy: allow-untyped-decorators

import cython
from cython.cimports.libc.math import sqrt

TIE = cython.declare(cython.double, 10.0)  # keeps the ends, where nothing moves yet, like what is beside them


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def limit(
    weights: cython.double[:, ::1], g: cython.Py_ssize_t, c: cython.double[::1], k: cython.Py_ssize_t
) -> cython.double:
    """What the rows of a group of the cell k stay below."""
    b: cython.double = weights[g, 0] * c[k] + weights[g, 1] * c[k + 1] + weights[g, 2] * c[k + 2]
    return 1.0 / sqrt(b) if b > 0.0 else 1.0


@cython.cfunc
@cython.exceptval(check=False)
def assemble(
    of: cython.Py_ssize_t[::1],
    first: cython.Py_ssize_t[::1],
    weights: cython.double[:, ::1],
    rows: cython.double[:, ::1],
    c: cython.double[::1],
    mu: cython.double,
    begins: cython.Py_ssize_t,
    ends: cython.Py_ssize_t,
    group: cython.Py_ssize_t,
    last_group: cython.Py_ssize_t,
    fixed: cython.Py_ssize_t,
    a: cython.double,
    b: cython.double,
    band: cython.double[:, ::1],
    right: cython.double[::1],
) -> cython.double:
    """Write the equations of a step, which aims at mu to be left to gain at each row: a band, of which the
    diagonal and two beside it, and the right side. Gives the time of all cells.

    Slacks have gone the part a of their last changes, multipliers the part b.
    """
    m: cython.Py_ssize_t = c.shape[0]
    n: cython.double
    t: cython.double
    o: cython.double
    v: cython.double
    s: cython.double
    up: cython.double
    p0: cython.double
    p1: cython.double
    p2: cython.double
    u0: cython.double
    u1: cython.double
    u2: cython.double
    time: cython.double = 0.0
    for k in range(begins, ends + 2):
        band[k, 0] = band[k, 1] = band[k, 2] = right[k] = 0.0
    for e in range(2):
        k = (m - 2) * e
        if (begins > 0 or fixed > 0) if e == 0 else ends < m - 2:
            continue
        y = 2.0 * TIE * (c[k + 1] - c[k])
        right[k] += y
        right[k + 1] -= y
        band[k, 0] += 2.0 * TIE
        band[k, 1] -= 2.0 * TIE
        band[k + 1, 0] += 2.0 * TIE
    for k in range(begins, ends):
        c0, c1, c2 = c[k], c[k + 1], c[k + 2]
        y = 1.0 / ((c0 + 6.0 * c1 + c2) * 0.125)
        s = sqrt(y)
        time += s
        y *= s
        right[k] += 0.0625 * y
        right[k + 1] += 0.375 * y
        right[k + 2] += 0.0625 * y
        y *= 0.75 * s * s
        band[k, 0] += 0.015625 * y
        band[k, 1] += 0.09375 * y
        band[k, 2] += 0.015625 * y
        band[k + 1, 0] += 0.5625 * y
        band[k + 1, 1] += 0.09375 * y
        band[k + 2, 0] += 0.015625 * y
    for g in range(group, last_group):
        k = of[g]
        c0, c1, c2 = c[k], c[k + 1], c[k + 2]
        w = limit(weights, g, c, k)
        weights[g, 3] = w
        u0 = u1 = u2 = s = up = 0.0
        if weights[g, 1] > 0.0:
            # w goes with b, and b with these parts of c.
            y = -0.5 * w * w * w
            u0, u1, u2 = y * weights[g, 0], y * weights[g, 1], y * weights[g, 2]
        for r in range(first[g], first[g + 1]):
            y = rows[r, 0] * c0 + rows[r, 1] * c1 + rows[r, 2] * c2
            n = rows[r, 3] + b * rows[r, 7]
            o = rows[r, 4] + b * rows[r, 8]
            rows[r, 3], rows[r, 4] = n, o
            p0, p1 = w - y, w + y
            t = max(rows[r, 5] + a * rows[r, 9], p0)
            v = max(rows[r, 6] + a * rows[r, 10], p1)
            rows[r, 5], rows[r, 6] = t, v
            p0 -= t
            p1 -= v
            rows[r, 9], rows[r, 10] = p0, p1
            t, v = 1.0 / t, 1.0 / v
            rows[r, 11], rows[r, 12] = t, v
            n *= t
            o *= v
            t = mu * t - n * p0
            v = mu * v - o * p1
            up += t + v
            v -= t
            t = o - n
            o += n
            # n g g' + o h h', with g = u - p and h = u + p, is (o + n) (p + e u) (p + e u)' + s u u'.
            n = t / o
            s += o - n * t
            p0, p1, p2 = rows[r, 0], rows[r, 1], rows[r, 2]
            right[k] += v * p0
            right[k + 1] += v * p1
            right[k + 2] += v * p2
            p0 += n * u0
            p1 += n * u1
            p2 += n * u2
            t = o * p0
            band[k, 0] += t * p0
            band[k, 1] += t * p1
            band[k, 2] += t * p2
            t = o * p1
            band[k + 1, 0] += t * p1
            band[k + 1, 1] += t * p2
            band[k + 2, 0] += o * p2 * p2
        if weights[g, 1] > 0.0:
            right[k] += up * u0
            right[k + 1] += up * u1
            right[k + 2] += up * u2
            band[k, 0] += s * u0 * u0
            band[k, 1] += s * u0 * u1
            band[k, 2] += s * u0 * u2
            band[k + 1, 0] += s * u1 * u1
            band[k + 1, 1] += s * u1 * u2
            band[k + 2, 0] += s * u2 * u2
    return time


@cython.cfunc
@cython.exceptval(check=False)
def solve(
    right: cython.double[::1],
    band: cython.double[:, ::1],
    step: cython.double[::1],
    begins: cython.Py_ssize_t,
    ends: cython.Py_ssize_t,
    least: cython.Py_ssize_t,
    most: cython.Py_ssize_t,
) -> cython.bint:
    """Newton's step in the rows least..most - 1, by L D L' of the band, in place; none in the others from
    begins to ends - 1. False where it is not positive."""
    d: cython.double
    for i in range(begins, least):
        step[i] = 0.0
    for i in range(most, ends):
        step[i] = 0.0
    for i in range(least, most):
        if not band[i, 0] > 0.0:
            return False
        d = 1.0 / band[i, 0]
        e, f = band[i, 1] * d, band[i, 2] * d
        if i + 1 < most:
            band[i + 1, 0] -= e * band[i, 1]
            band[i + 1, 1] -= e * band[i, 2]
        if i + 2 < most:
            band[i + 2, 0] -= f * band[i, 2]
        band[i, 0], band[i, 1], band[i, 2] = d, e, f
        d = right[i]
        if i - 1 >= least:
            d -= band[i - 1, 1] * step[i - 1]
        if i - 2 >= least:
            d -= band[i - 2, 2] * step[i - 2]
        step[i] = d
    for i in range(most - 1, least - 1, -1):
        d = step[i] * band[i, 0]
        if i + 1 < most:
            d -= band[i, 1] * step[i + 1]
        if i + 2 < most:
            d -= band[i, 2] * step[i + 2]
        step[i] = d
    return True

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
    d0: cython.double
    d1: cython.double
    d2: cython.double
    h00: cython.double
    h01: cython.double
    h02: cython.double
    h11: cython.double
    h12: cython.double
    h22: cython.double
    r0: cython.double
    r1: cython.double
    r2: cython.double
    time: cython.double = 0.0
    for k in range(m):
        band[k, 0] = band[k, 1] = band[k, 2] = right[k] = 0.0
    for e in range(1 if fixed > 0 else 0, 2):
        k = (m - 2) * e
        y = 2.0 * TIE * (c[k + 1] - c[k])
        right[k] += y
        right[k + 1] -= y
        band[k, 0] += 2.0 * TIE
        band[k, 1] -= 2.0 * TIE
        band[k + 1, 0] += 2.0 * TIE
    for k in range(m - 2):
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
    for g in range(of.shape[0]):
        k = of[g]
        c0, c1, c2 = c[k], c[k + 1], c[k + 2]
        w = limit(weights, g, c, k)
        weights[g, 3] = w
        s = up = d0 = d1 = d2 = 0.0
        r0 = r1 = r2 = h00 = h01 = h02 = h11 = h12 = h22 = 0.0
        for r in range(first[g], first[g + 1]):
            p0, p1, p2 = rows[r, 0], rows[r, 1], rows[r, 2]
            y = p0 * c0 + p1 * c1 + p2 * c2
            rows[r, 3] = n = rows[r, 3] + b * rows[r, 7]
            rows[r, 4] = o = rows[r, 4] + b * rows[r, 8]
            rows[r, 5] = t = max(rows[r, 5] + a * rows[r, 9], w - y)
            rows[r, 6] = v = max(rows[r, 6] + a * rows[r, 10], w + y)
            q = 1.0 / (t * v)
            rows[r, 11] = x = v * q
            rows[r, 12] = z = t * q
            rows[r, 9] = t = w - y - t
            rows[r, 10] = v = w + y - v
            n *= x
            o *= z
            t = mu * x - n * t
            v = mu * z - o * v
            up += t + v
            v -= t
            r0 += v * p0
            r1 += v * p1
            r2 += v * p2
            t = o - n
            o += n
            s += o
            d0 += t * p0
            d1 += t * p1
            d2 += t * p2
            t = o * p0
            h00 += t * p0
            h01 += t * p1
            h02 += t * p2
            t = o * p1
            h11 += t * p1
            h12 += t * p2
            h22 += o * p2 * p2
        if weights[g, 1] > 0.0:
            # w goes with b, and b with these parts of c.
            y = -0.5 * w * w * w
            p0, p1, p2 = y * weights[g, 0], y * weights[g, 1], y * weights[g, 2]
            r0 += up * p0
            r1 += up * p1
            r2 += up * p2
            h00 += p0 * (s * p0 + 2.0 * d0)
            h01 += p0 * (s * p1 + d1) + p1 * d0
            h02 += p0 * (s * p2 + d2) + p2 * d0
            h11 += p1 * (s * p1 + 2.0 * d1)
            h12 += p1 * (s * p2 + d2) + p2 * d1
            h22 += p2 * (s * p2 + 2.0 * d2)
        right[k] += r0
        right[k + 1] += r1
        right[k + 2] += r2
        band[k, 0] += h00
        band[k, 1] += h01
        band[k, 2] += h02
        band[k + 1, 0] += h11
        band[k + 1, 1] += h12
        band[k + 2, 0] += h22
    return time


@cython.cfunc
@cython.exceptval(check=False)
def solve(
    right: cython.double[::1],
    band: cython.double[:, ::1],
    step: cython.double[::1],
    fixed: cython.Py_ssize_t,
) -> cython.bint:
    """Newton's step from row `fixed` on, by L D L' of the band, in place; False where it is not positive."""
    m: cython.Py_ssize_t = right.shape[0]
    d: cython.double
    for i in range(fixed):
        step[i] = 0.0
    for i in range(fixed, m):
        if not band[i, 0] > 0.0:
            return False
        d = 1.0 / band[i, 0]
        e, f = band[i, 1] * d, band[i, 2] * d
        if i + 1 < m:
            band[i + 1, 0] -= e * band[i, 1]
            band[i + 1, 1] -= e * band[i, 2]
        if i + 2 < m:
            band[i + 2, 0] -= f * band[i, 2]
        band[i, 0], band[i, 1], band[i, 2] = d, e, f
        d = right[i]
        if i - 1 >= fixed:
            d -= band[i - 1, 1] * step[i - 1]
        if i - 2 >= fixed:
            d -= band[i - 2, 2] * step[i - 2]
        step[i] = d
    for i in range(m - 1, fixed - 1, -1):
        d = step[i] * band[i, 0]
        if i + 1 < m:
            d -= band[i, 1] * step[i + 1]
        if i + 2 < m:
            d -= band[i, 2] * step[i + 2]
        step[i] = d
    return True

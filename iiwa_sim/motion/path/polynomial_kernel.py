"""Values and derivatives of Chebyshev polynomials in pieces, see `iiwa_sim.motion.path.piecewise_kernel`.

Derivatives come from the same recurrence as the polynomials themselves: T(k + 1) = 2 x T(k) - T(k - 1), and
what that is when it is differentiated.
"""

# mypy: allow-untyped-decorators

import cython


@cython.ccall
@cython.exceptval(check=False)
def piece_at(borders: cython.double[::1], s: cython.double) -> cython.Py_ssize_t:
    """The piece in which s lies; the first or last one where s is outside 0..1."""
    low: cython.Py_ssize_t = 0
    high: cython.Py_ssize_t = borders.shape[0] - 1
    while high - low > 1:
        middle = (low + high) // 2
        if s < borders[middle]:
            high = middle
        else:
            low = middle
    return low


@cython.ccall
@cython.exceptval(check=False)
def evaluate(
    borders: cython.double[::1],
    offsets: cython.Py_ssize_t[::1],
    coefficients: cython.double[:, ::1],
    piece: cython.Py_ssize_t,
    s: cython.double,
    orders: cython.int,
    values: cython.double[:, :, ::1],
    row: cython.Py_ssize_t,
) -> cython.void:
    """Joint positions at s on a piece into `values[0, row]`, and their derivatives up to the order `orders`,
    3 at most, into `values[1, row]` and so on: `values` is (orders + 1 or more, rows, joints)."""
    count: cython.Py_ssize_t = coefficients.shape[1]
    first: cython.Py_ssize_t = offsets[piece]
    last: cython.Py_ssize_t = offsets[piece + 1]
    scale: cython.double = 2.0 / (borders[piece + 1] - borders[piece])
    x: cython.double = (s - borders[piece]) * scale - 1.0
    double_x: cython.double = 2.0 * x
    # T(k) and its derivatives d, e, f; those of k - 1 (before) and their next.
    t0: cython.double = 1.0
    t1: cython.double = x
    d0: cython.double = 0.0
    d1: cython.double = 1.0
    e0: cython.double = 0.0
    e1: cython.double = 0.0
    f0: cython.double = 0.0
    f1: cython.double = 0.0
    for j in range(count):
        values[0, row, j] = coefficients[first, j]
    for k in range(1, orders + 1):
        for j in range(count):
            values[k, row, j] = 0.0
    if orders == 0:
        for k in range(first + 1, last):
            for j in range(count):
                values[0, row, j] += coefficients[k, j] * t1
            t = double_x * t1 - t0
            t0 = t1
            t1 = t
        return
    for k in range(first + 1, last):
        for j in range(count):
            c = coefficients[k, j]
            values[0, row, j] += c * t1
            values[1, row, j] += c * d1
        if orders > 1:
            for j in range(count):
                values[2, row, j] += coefficients[k, j] * e1
        if orders > 2:
            for j in range(count):
                values[3, row, j] += coefficients[k, j] * f1
        t = double_x * f1 - f0 + 6.0 * e1
        f0 = f1
        f1 = t
        t = double_x * e1 - e0 + 4.0 * d1
        e0 = e1
        e1 = t
        t = double_x * d1 - d0 + 2.0 * t1
        d0 = d1
        d1 = t
        t = double_x * t1 - t0
        t0 = t1
        t1 = t
    t = scale
    for k in range(1, orders + 1):
        for j in range(count):
            values[k, row, j] *= t
        t *= scale


def derivatives(
    borders: cython.double[::1],
    offsets: cython.Py_ssize_t[::1],
    coefficients: cython.double[:, ::1],
    s: cython.double[::1],
    values: cython.double[:, :, ::1],
) -> None:
    """Joint positions and as many derivatives as there is room for in `values` (1 to 4, m, n), at s (m,)."""
    orders: cython.int = values.shape[0] - 1
    for row in range(s.shape[0]):
        evaluate(borders, offsets, coefficients, piece_at(borders, s[row]), s[row], orders, values, row)

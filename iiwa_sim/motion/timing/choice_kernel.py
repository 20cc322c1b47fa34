"""Which rows of joints bound a clock, and which need not be looked at; compiled by Cython."""

# mypy: allow-untyped-decorators

import cython
from cython.cimports.libc.math import fabs

# A row is left out where another one bounds the clock more, with this margin.
SURE = cython.declare(cython.double, 1.5)
# A row whose parts of the largest of all rows are together less than this is left out in any case.
SMALL = cython.declare(cython.double, 0.19)


@cython.cfunc
@cython.exceptval(check=False)
def chosen(
    first: cython.double[:, ::1],
    second: cython.double[:, ::1],
    third: cython.double[:, ::1],
    k: cython.Py_ssize_t,
    n: cython.Py_ssize_t,
    orders: cython.int,
    scratch: cython.double[:, ::1],
) -> cython.Py_ssize_t:
    """Bring to the front those rows of joints at the place k that matter, and give their number.

    A row does not matter that is a part of another one, or so small beside others that the load of such a
    part would not be passed. Rows 6 to 9 of the scratch are used.
    """
    left: cython.Py_ssize_t = 0
    kept: cython.Py_ssize_t = 0
    u: cython.double = 1e-300
    v: cython.double = 1e-300
    w: cython.double = 1e-300
    for i in range(n):
        u = max(u, fabs(first[k, i]))
        v = max(v, fabs(second[k, i]))
        w = max(w, fabs(third[k, i]))
    u, v, w = 1.0 / u, 1.0 / v, (1.0 / w if orders == 3 else 0.0)
    for i in range(n):
        x, y, z = first[k, i] * u, second[k, i] * v, third[k, i] * w
        if fabs(x) + fabs(y) + fabs(z) < SMALL:
            continue
        scratch[6, left], scratch[7, left], scratch[8, left] = x, y, z
        scratch[9, left] = x * x + y * y + z * z
        first[k, left], second[k, left] = first[k, i], second[k, i]
        if orders == 3:
            third[k, left] = third[k, i]
        left += 1
    while kept < left:
        best = kept
        for i in range(kept + 1, left):
            if scratch[9, i] > scratch[9, best]:
                best = i
        if best != kept:
            for o in range(4):
                y = scratch[6 + o, best]
                scratch[6 + o, best] = scratch[6 + o, kept]
                scratch[6 + o, kept] = y
            first[k, best], first[k, kept] = first[k, kept], first[k, best]
            second[k, best], second[k, kept] = second[k, kept], second[k, best]
            if orders == 3:
                third[k, best], third[k, kept] = third[k, kept], third[k, best]
        rest = 2.0
        for m in range(kept):
            part = (
                scratch[6, kept] * scratch[6, m]
                + scratch[7, kept] * scratch[7, m]
                + scratch[8, kept] * scratch[8, m]
            ) / scratch[9, m]
            y = fabs(part) + SURE * (
                fabs(scratch[6, kept] - part * scratch[6, m])
                + fabs(scratch[7, kept] - part * scratch[7, m])
                + fabs(scratch[8, kept] - part * scratch[8, m])
            )
            rest = min(rest, y)
        if rest <= 1.0:
            # It is left out: the last one takes its place.
            left -= 1
            for o in range(4):
                scratch[6 + o, kept] = scratch[6 + o, left]
            first[k, kept], second[k, kept] = first[k, left], second[k, left]
            if orders == 3:
                third[k, kept] = third[k, left]
        else:
            kept += 1
    return max(kept, 1)

"""Which rows of joints bound a clock, and which need not be looked at; compiled by Cython."""

# mypy: allow-untyped-decorators

import cython
from cython.cimports.libc.math import fabs

# A row is left out where another one bounds the clock more, with this margin.
SURE = cython.declare(cython.double, 1.5)


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
    """Bring to the front what rows of joints at the place k matter, and give their number.

    A row does not matter that is a part of another one, or so small beside others that the load of such a
    part would not be passed. Rows 6 to 9 of the scratch are used.
    """
    left: cython.Py_ssize_t = n
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
        scratch[6, i] = first[k, i] * u
        scratch[7, i] = second[k, i] * v
        scratch[8, i] = third[k, i] * w
        scratch[9, i] = (
            scratch[6, i] * scratch[6, i] + scratch[7, i] * scratch[7, i] + scratch[8, i] * scratch[8, i]
        )
    while kept < left:
        best = kept
        for i in range(kept + 1, left):
            if scratch[9, i] > scratch[9, best]:
                best = i
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
            # To the end: it is left out.
            left -= 1
            for o in range(4):
                y = scratch[6 + o, left]
                scratch[6 + o, left] = scratch[6 + o, kept]
                scratch[6 + o, kept] = y
            first[k, left], first[k, kept] = first[k, kept], first[k, left]
            second[k, left], second[k, kept] = second[k, kept], second[k, left]
            if orders == 3:
                third[k, left], third[k, kept] = third[k, kept], third[k, left]
        else:
            kept += 1
    return max(kept, 1)

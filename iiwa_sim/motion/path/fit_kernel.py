"""Polynomials fitted to joint positions at the nodes of Chebyshev polynomials, as a piece of a path."""

# mypy: allow-untyped-decorators

import cython
import numpy as np
from cython.cimports.libc.math import cos, sin

from iiwa_sim.motion.limits import Array

NOT_RESOLVED = 0
HOPELESS = -1
_NOT_RESOLVED = cython.declare(cython.int, 0)
_HOPELESS = cython.declare(cython.int, -1)
_PI = cython.declare(cython.double, 3.141592653589793)
# Coefficients (rad) below this are left out.
_NOTHING = cython.declare(cython.double, 1e-13)
# With the last three coefficients (rad) below this a piece is resolved: where derivatives have to agree with
# those of neighbours, and where there are none.
_RESOLVED = cython.declare(cython.double, 1e-12)
_RESOLVED_ALONE = cython.declare(cython.double, 1e-11)
# With more a polynomial of twice the degree would not do either.
_TOO_MUCH = cython.declare(cython.double, 1e-4)
# Near singular poses rounding shows in all coefficients: below this, and where they do not fall any more.
_ROUNDING = cython.declare(cython.double, 1e-8)
_LEVEL = cython.declare(cython.double, 10.0)


def nodes_and_weights(degree: cython.int, nodes: cython.double[::1], weights: cython.double[:, ::1]) -> None:
    """The places (degree + 1,) in -1..1 where a polynomial of that degree is fitted, ends included, and what
    each value there counts in each coefficient (degree + 1, degree + 1)."""
    for k in range(degree + 1):
        nodes[k] = sin(_PI * (2 * k - degree) / (2 * degree))
    nodes[0] = -1.0
    nodes[degree] = 1.0
    for j in range(degree + 1):
        for k in range(degree + 1):
            weight = 2.0 / degree * cos(_PI * ((j * (degree - k)) % (2 * degree)) / degree)
            if k == 0 or k == degree:
                weight *= 0.5
            if j == 0 or j == degree:
                weight *= 0.5
            weights[j, k] = weight


def _nodes_and_weights(degree: int) -> tuple[Array, Array]:
    nodes, weights = np.empty(degree + 1), np.empty((degree + 1, degree + 1))
    nodes_and_weights(degree, nodes, weights)
    return nodes, weights


NODES_AND_WEIGHTS = (_nodes_and_weights(16), _nodes_and_weights(32))
"""Nodes and weights of the degrees that are tried; the nodes of the first are among those of the second."""


@cython.ccall
@cython.exceptval(check=False)
def fit(
    joints: cython.double[:, ::1],
    weights: cython.double[:, ::1],
    alone: cython.bint,
    coefficients: cython.double[:, ::1],
) -> cython.Py_ssize_t:
    """A polynomial through joint positions (rad) at the nodes that belong to `weights`: rows of coefficients.

    Its ends are met but for rounding. `alone` says that it has no neighbours. Returns how many rows there
    are, or one of the constants above: where it takes more nodes or a shorter piece, and where only the
    latter.
    """
    count: cython.Py_ssize_t = joints.shape[1]
    last: cython.Py_ssize_t = weights.shape[0] - 1
    total: cython.double
    largest: cython.double
    nothing: cython.double = _NOTHING
    tail: cython.double = 0.0
    level: cython.double = 0.0
    for i in range(last, -1, -1):
        largest = 0.0
        for j in range(count):
            total = 0.0
            for k in range(last + 1):
                total += weights[i, k] * joints[k, j]
            coefficients[i, j] = total
            largest = max(largest, total, -total)
        if i > last - 3:
            tail = max(tail, largest)
            if tail > _TOO_MUCH:
                return _HOPELESS
        elif i > last - last // 2:
            level = max(level, largest)
        elif tail > (_RESOLVED_ALONE if alone else _RESOLVED):
            if tail > _ROUNDING or level > _LEVEL * tail:
                return _NOT_RESOLVED
            nothing = max(nothing, 4.0 * tail)
    rows = last + 1
    while rows > 2:
        largest = 0.0
        for j in range(count):
            largest = max(largest, coefficients[rows - 1, j], -coefficients[rows - 1, j])
        if largest > nothing:
            break
        rows -= 1
    _meet(coefficients, rows, joints, last)
    return rows


@cython.cfunc
@cython.exceptval(check=False)
def _meet(
    coefficients: cython.double[:, ::1],
    rows: cython.Py_ssize_t,
    joints: cython.double[:, ::1],
    last: cython.Py_ssize_t,
) -> cython.void:
    """What is missing of the first and last joint positions, added evenly along the piece."""
    first_off: cython.double
    last_off: cython.double
    for j in range(joints.shape[1]):
        first_off = joints[0, j]
        last_off = joints[last, j]
        sign = 1.0
        for i in range(rows):
            first_off -= sign * coefficients[i, j]
            last_off -= coefficients[i, j]
            sign = -sign
        coefficients[0, j] += 0.5 * (first_off + last_off)
        coefficients[1, j] += 0.5 * (last_off - first_off)

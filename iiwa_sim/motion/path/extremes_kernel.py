"""How far joints go along a path, whether that is within their limits, and where the path is fastest."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from typing import NamedTuple

import cython
import numpy as np
from cython.cimports.libc.math import fabs

from iiwa_sim.motion.limits import Array

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.path.piecewise_kernel import Polynomial
else:
    from iiwa_sim.motion.path.piecewise_kernel import Polynomial

_HALVINGS = cython.declare(cython.int, 50)
_CLOSE = 1e-9  # in s: nearer together places are the same
_PARTS = 20  # in which what lies beside the fastest place is looked into


class Outside(NamedTuple):
    """The place at which a joint leaves its limits."""

    s: float
    joint: int
    """Index of the joint."""
    upwards: bool
    """Whether it leaves through the upper limit."""


def first_outside(
    path: Polynomial, lowest: cython.double[::1], highest: cython.double[::1]
) -> Outside | None:
    """The first place at which a joint leaves its limits (rad, (n,)); None where none does.

    Where a joint turns back is found, so that it cannot swing out and back between two samples.
    """
    first: cython.double = 0.0
    joint: cython.Py_ssize_t = -1
    upwards: cython.bint = False
    for piece in range(path.piece_count):
        low = path._borders[piece]
        high = path._borders[piece + 1]
        for j in range(path.joint_count):
            # No polynomial goes farther than the sum of its coefficients.
            reach = 0.0
            for k in range(path._offsets[piece] + 1, path._offsets[piece + 1]):
                reach += fabs(path._coefficients[k, j])
            x = path._coefficients[path._offsets[piece], j]
            if x - reach >= lowest[j] and x + reach <= highest[j]:
                continue
            x = _leaves(path, piece, j, lowest[j], highest[j])
            if x <= 1.0 and (joint < 0 or low + 0.5 * (high - low) * (1.0 + x) < first):
                first = low + 0.5 * (high - low) * (1.0 + x)
                joint = j
                upwards = _value(path, piece, j, x) > 0.5 * (lowest[j] + highest[j])
        if joint >= 0:
            return Outside(first, joint, bool(upwards))
    return None


@cython.cfunc
@cython.exceptval(check=False)
def _leaves(
    path: Polynomial,
    piece: cython.Py_ssize_t,
    joint: cython.Py_ssize_t,
    lowest: cython.double,
    highest: cython.double,
) -> cython.double:
    """Where in -1..1 a joint leaves its limits on a piece; 2.0 where it does not."""
    count: cython.Py_ssize_t = 2 * (path._offsets[piece + 1] - path._offsets[piece]) + 2
    x: cython.double = -1.0
    slope: cython.double = _slope(path, piece, joint, x)
    q: cython.double = _value(path, piece, joint, x)
    if q < lowest or q > highest:
        return x
    for k in range(1, count + 1):
        there = -1.0 + 2.0 * k / count
        next_slope = _slope(path, piece, joint, there)
        high = there
        if slope * next_slope < 0.0:  # it turns back between
            low = x
            i = 0
            while i < _HALVINGS:
                i += 1
                middle = 0.5 * (low + high)
                if _slope(path, piece, joint, middle) * slope > 0.0:
                    low = middle
                else:
                    high = middle
        q = _value(path, piece, joint, high)
        if lowest <= q <= highest:
            high = there
            q = _value(path, piece, joint, high)
        if q < lowest or q > highest:
            low = x
            i = 0
            while i < _HALVINGS:
                i += 1
                middle = 0.5 * (low + high)
                q = _value(path, piece, joint, middle)
                if lowest <= q <= highest:
                    low = middle
                else:
                    high = middle
            return high
        x = there
        slope = next_slope
    return 2.0


@cython.cfunc
@cython.exceptval(check=False)
def _value(
    path: Polynomial, piece: cython.Py_ssize_t, joint: cython.Py_ssize_t, x: cython.double
) -> cython.double:
    first: cython.Py_ssize_t = path._offsets[piece]
    before: cython.double = 1.0
    here: cython.double = x
    total: cython.double = path._coefficients[first, joint]
    for k in range(first + 1, path._offsets[piece + 1]):
        total += path._coefficients[k, joint] * here
        after = 2.0 * x * here - before
        before = here
        here = after
    return total


@cython.cfunc
@cython.exceptval(check=False)
def _slope(
    path: Polynomial, piece: cython.Py_ssize_t, joint: cython.Py_ssize_t, x: cython.double
) -> cython.double:
    """The derivative: that of T(k) is k U(k - 1)."""
    first: cython.Py_ssize_t = path._offsets[piece]
    before: cython.double = 0.0
    here: cython.double = 1.0
    total: cython.double = 0.0
    for k in range(first + 1, path._offsets[piece + 1]):
        total += path._coefficients[k, joint] * (k - first) * here
        after = 2.0 * x * here - before
        before = here
        here = after
    return total


def travel(path: Polynomial) -> Array:
    """How far each joint goes, there and back (rad, (n,)), but for what is missed where it turns between
    places that are looked at."""
    found: Array = np.zeros(path.joint_count)
    ways: cython.double[::1] = found
    for j in range(path.joint_count):
        for piece in range(path.piece_count):
            count = path._offsets[piece + 1] - path._offsets[piece]
            count = 4 * count if count > 2 else 1
            before = _value(path, piece, j, -1.0)
            for k in range(1, count + 1):
                q = _value(path, piece, j, -1.0 + 2.0 * k / count)
                ways[j] += fabs(q - before)
                before = q
    return found


def least_time_s(path: Polynomial, velocity: cython.double[::1]) -> tuple[float, float]:
    """How long (s) a path takes with one joint at its velocity limit (rad/s, (n,)) all the way; and the way
    (rad) of the joint that goes farthest. NaN where the path is."""
    ways: cython.double[::1] = travel(path)
    longest_s: cython.double = 0.0
    farthest: cython.double = 0.0
    for j in range(ways.shape[0]):
        time_s: cython.double = ways[j] / velocity[j]
        if time_s > longest_s or time_s != time_s:
            longest_s = time_s
        farthest = max(farthest, ways[j])
    return longest_s, farthest


def least_time_per_s(path: Polynomial, velocity: Array) -> float:
    """How long (s) a unit of s takes where it takes least.

    There the TCP of a line is fastest, with its fastest joint at the velocity limit (rad/s, (n,)).
    """
    borders, rows = path.borders.tolist(), np.diff(path.offsets).tolist()
    parts = [
        np.linspace(low, high, 4 * count, endpoint=False)
        for low, high, count in zip(borders, borders[1:], rows, strict=False)
    ]
    s = np.append(np.concatenate(parts), borders[len(rows)])
    while True:
        times_s = (np.abs(path.derivatives(s)[1]) / velocity).max(axis=1)
        k = int(times_s.argmin())
        if np.ptp(s) < _CLOSE:
            return float(times_s[k])
        s = np.linspace(s[max(k - 1, 0)], s[min(k + 1, len(s) - 1)], _PARTS + 1)

"""How far joints go along a path, whether that is within their limits, and where the path is fastest."""

# mypy: allow-untyped-decorators

import cython
from cython.cimports.libc.math import fabs

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.path.polynomial_kernel import evaluate
else:
    from iiwa_sim.motion.path.polynomial_kernel import evaluate

_HALVINGS = cython.declare(cython.int, 50)
_GOLDEN = cython.declare(cython.double, 0.6180339887498949)


def first_outside(
    borders: cython.double[::1],
    offsets: cython.Py_ssize_t[::1],
    coefficients: cython.double[:, ::1],
    lowest: cython.double[::1],
    highest: cython.double[::1],
) -> tuple[float, int]:
    """The s at which a joint first leaves its limits (rad, (n,)), and which joint; 2.0 and -1 for none."""
    first: cython.double = 2.0
    joint: cython.Py_ssize_t = -1
    for piece in range(borders.shape[0] - 1):
        low = borders[piece]
        high = borders[piece + 1]
        for j in range(coefficients.shape[1]):
            # No polynomial goes farther than the sum of its coefficients.
            reach = 0.0
            for k in range(offsets[piece] + 1, offsets[piece + 1]):
                reach += fabs(coefficients[k, j])
            x = coefficients[offsets[piece], j]
            if x - reach >= lowest[j] and x + reach <= highest[j]:
                continue
            x = _leaves(coefficients, offsets[piece], offsets[piece + 1], j, lowest[j], highest[j])
            if x <= 1.0 and low + 0.5 * (high - low) * (1.0 + x) < first:
                first = low + 0.5 * (high - low) * (1.0 + x)
                joint = j
        if joint >= 0:
            break
    return first, joint


@cython.cfunc
@cython.exceptval(check=False)
def _leaves(
    coefficients: cython.double[:, ::1],
    first: cython.Py_ssize_t,
    last: cython.Py_ssize_t,
    joint: cython.Py_ssize_t,
    lowest: cython.double,
    highest: cython.double,
) -> cython.double:
    """Where in -1..1 a joint leaves its limits on a piece of rows first to last; 2.0 where it does not."""
    count: cython.Py_ssize_t = 2 * (last - first) + 2
    x: cython.double = -1.0
    slope: cython.double = _slope(coefficients, first, last, joint, x)
    q: cython.double = _value(coefficients, first, last, joint, x)
    if q < lowest or q > highest:
        return x
    for k in range(1, count + 1):
        there = -1.0 + 2.0 * k / count
        next_slope = _slope(coefficients, first, last, joint, there)
        high = there
        if slope * next_slope < 0.0:  # it turns back between
            low = x
            i = 0
            while i < _HALVINGS:
                i += 1
                middle = 0.5 * (low + high)
                if _slope(coefficients, first, last, joint, middle) * slope > 0.0:
                    low = middle
                else:
                    high = middle
        q = _value(coefficients, first, last, joint, high)
        if lowest <= q <= highest:
            high = there
            q = _value(coefficients, first, last, joint, high)
        if q < lowest or q > highest:
            low = x
            i = 0
            while i < _HALVINGS:
                i += 1
                middle = 0.5 * (low + high)
                q = _value(coefficients, first, last, joint, middle)
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
    coefficients: cython.double[:, ::1],
    first: cython.Py_ssize_t,
    last: cython.Py_ssize_t,
    joint: cython.Py_ssize_t,
    x: cython.double,
) -> cython.double:
    before: cython.double = 1.0
    here: cython.double = x
    total: cython.double = coefficients[first, joint]
    for k in range(first + 1, last):
        total += coefficients[k, joint] * here
        after = 2.0 * x * here - before
        before = here
        here = after
    return total


@cython.cfunc
@cython.exceptval(check=False)
def _slope(
    coefficients: cython.double[:, ::1],
    first: cython.Py_ssize_t,
    last: cython.Py_ssize_t,
    joint: cython.Py_ssize_t,
    x: cython.double,
) -> cython.double:
    """The derivative: that of T(k) is k U(k - 1)."""
    before: cython.double = 0.0
    here: cython.double = 1.0
    total: cython.double = 0.0
    for k in range(first + 1, last):
        total += coefficients[k, joint] * (k - first) * here
        after = 2.0 * x * here - before
        before = here
        here = after
    return total


def travel(
    offsets: cython.Py_ssize_t[::1], coefficients: cython.double[:, ::1], ways: cython.double[::1]
) -> None:
    """How far each joint goes, there and back (rad, (n,)); turns between places looked at are cut short."""
    for j in range(coefficients.shape[1]):
        ways[j] = 0.0
        for piece in range(offsets.shape[0] - 1):
            count = offsets[piece + 1] - offsets[piece]
            count = 4 * count if count > 2 else 1
            before = _value(coefficients, offsets[piece], offsets[piece + 1], j, -1.0)
            for k in range(1, count + 1):
                q = _value(coefficients, offsets[piece], offsets[piece + 1], j, -1.0 + 2.0 * k / count)
                ways[j] += fabs(q - before)
                before = q


def least_time_per_s(
    borders: cython.double[::1],
    offsets: cython.Py_ssize_t[::1],
    coefficients: cython.double[:, ::1],
    velocity: cython.double[::1],
    room: cython.double[:, :, ::1],
) -> cython.double:
    """How long a unit of s takes at the least where it takes least, by velocity limits (rad/s, (n,)).

    `room` (2, 1, n) is for its own use.
    """
    least: cython.double = _time_per_s(borders, offsets, coefficients, velocity, 0, 0.0, room)
    for piece in range(borders.shape[0] - 1):
        low = borders[piece]
        count = 4 * (offsets[piece + 1] - offsets[piece])
        width = (borders[piece + 1] - low) / count
        before = time = _time_per_s(borders, offsets, coefficients, velocity, piece, low, room)
        for k in range(1, count + 1):
            after = _time_per_s(borders, offsets, coefficients, velocity, piece, low + k * width, room)
            if time <= before and time <= after:
                # The least is next to the place before.
                first = low + max(k - 2, 0) * width
                last = low + k * width
                least = min(
                    least,
                    _least_between(borders, offsets, coefficients, velocity, piece, first, last, room),
                )
            least = min(least, after)
            before = time
            time = after
    return least


@cython.cfunc
@cython.exceptval(check=False)
def _least_between(
    borders: cython.double[::1],
    offsets: cython.Py_ssize_t[::1],
    coefficients: cython.double[:, ::1],
    velocity: cython.double[::1],
    piece: cython.Py_ssize_t,
    low: cython.double,
    high: cython.double,
    room: cython.double[:, :, ::1],
) -> cython.double:
    """By the golden section."""
    k: cython.int = 0
    while k < _HALVINGS:
        k += 1
        one = high - _GOLDEN * (high - low)
        other = low + _GOLDEN * (high - low)
        if _time_per_s(borders, offsets, coefficients, velocity, piece, one, room) < _time_per_s(
            borders, offsets, coefficients, velocity, piece, other, room
        ):
            high = other
        else:
            low = one
    return _time_per_s(borders, offsets, coefficients, velocity, piece, 0.5 * (low + high), room)


@cython.cfunc
@cython.exceptval(check=False)
def _time_per_s(
    borders: cython.double[::1],
    offsets: cython.Py_ssize_t[::1],
    coefficients: cython.double[:, ::1],
    velocity: cython.double[::1],
    piece: cython.Py_ssize_t,
    s: cython.double,
    room: cython.double[:, :, ::1],
) -> cython.double:
    evaluate(borders, offsets, coefficients, piece, s, 1, room, 0)
    longest: cython.double = 0.0
    for j in range(velocity.shape[0]):
        longest = max(longest, fabs(room[1, 0, j]) / velocity[j])
    return longest

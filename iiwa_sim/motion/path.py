"""Paths of moves q(s), s from 0 to 1: PTP, distances of joints, joint limits, and the least time."""

from functools import cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.plan_kernel import Polynomial

_HALVINGS = 50
_CLOSE = 1e-9  # in s: nearer together places are the same
_PARTS = 20  # in which the surroundings of the fastest place are divided


class Outside(NamedTuple):
    """The place at which a joint leaves its limits."""

    s: float
    joint: int
    """Index of the joint."""
    upwards: bool
    """True if it leaves through the upper limit."""


def ptp(start: Joints, end: Joints) -> Polynomial:
    """Return the straight line in joint space between two joint positions (rad)."""
    a, b = np.array(start), np.array(end)
    return Polynomial((0.0, 1.0), [np.array([0.5 * (a + b), 0.5 * (b - a)])], start, end)


def travel(path: Polynomial) -> Array:
    """Return how far each joint goes there and back (rad, (n,)), measured between samples."""
    if path.straight:
        return np.abs(np.subtract(path.end, path.start))
    distances = np.zeros(path.joint_count)
    offsets = path.offsets.tolist()
    for low, high in pairwise(offsets):
        q = _polynomials(high - low) @ path.coefficients[low:high]
        distances += np.abs(q[1:] - q[:-1]).sum(axis=0)
    return distances


@cache
def _polynomials(rows: int) -> Array:
    """Chebyshev polynomials (4 rows + 1, rows) at even places."""
    polynomials: Array = np.cos(np.arccos(np.linspace(-1.0, 1.0, 4 * rows + 1))[:, None] * np.arange(rows))
    return polynomials


def least_time_s(path: Polynomial, velocity: Array) -> tuple[float, float]:
    """Return how long (s) a path takes with one joint at its velocity limit (rad/s, (n,)) throughout.

    The second value is how far the joint goes that goes farthest (rad). Both are NaN where the path is.
    """
    distances = travel(path)
    return float((distances / velocity).max()), float(distances.max())


def least_time_per_s(path: Polynomial, velocity: Array) -> float:
    """Return how long (s) a unit of s takes where it takes least.

    There the TCP of a line is fastest, with its fastest joint at the velocity limit (rad/s, (n,)).
    """
    s = _places(path, 4)
    while True:
        times_s = (np.abs(path.derivatives(s)[1]) / velocity).max(axis=1)
        k = int(times_s.argmin())
        if np.ptp(s) < _CLOSE:
            return float(times_s[k])
        s = np.linspace(s[max(k - 1, 0)], s[min(k + 1, len(s) - 1)], _PARTS + 1)


def first_outside(path: Polynomial, lowest: Array, highest: Array) -> Outside | None:
    """Return the first place at which a joint leaves its limits (rad, (n,)); None if no joint does.

    Turning points of joints are located, so a joint cannot swing out and back between two samples.
    """
    # No polynomial goes farther than the sum of its coefficients.
    pieces = [path.coefficients[low:high] for low, high in pairwise(path.offsets.tolist())]
    reaches = [(rows[0], np.abs(rows[1:]).sum(axis=0)) for rows in pieces]
    if all(((q - r >= lowest) & (q + r <= highest)).all() for q, r in reaches):
        return None
    s = _places(path, 2)
    slopes = path.derivatives(s)[1]
    k, joint = (slopes[:-1] * slopes[1:] < 0.0).nonzero()
    low, high, sign = s[k], s[k + 1], slopes[k, joint]
    for _ in range(_HALVINGS if len(k) else 0):
        turning = 0.5 * (low + high)
        before = path.derivatives(turning)[1, np.arange(len(k)), joint] * sign > 0.0
        low, high = np.where(before, turning, low), np.where(before, high, turning)
    s = np.sort(np.concatenate([s, high]))
    outside = _is_outside(path, s, lowest, highest)
    if not outside.any():
        return None
    place = int(outside.any(axis=1).argmax())
    begin, end = float(s[max(place - 1, 0)]), float(s[place])
    for _ in range(_HALVINGS if place else 0):
        between = 0.5 * (begin + end)
        if _is_outside(path, np.array([between]), lowest, highest).any():
            end = between
        else:
            begin = between
    index = int(_is_outside(path, np.array([end]), lowest, highest)[0].argmax())
    position = path.derivatives(np.array([end]))[0, 0, index]
    return Outside(end, index, bool(position > 0.5 * (lowest[index] + highest[index])))


def _is_outside(path: Polynomial, s: Array, lowest: Array, highest: Array) -> Array:
    q = path.derivatives(s)[0]
    outside: Array = (q < lowest) | (q > highest)
    return outside


def _places(path: Polynomial, for_each_row: int) -> Array:
    """Rising s, so many for each row of coefficients, with both ends of each piece."""
    rows = (path.offsets[1:] - path.offsets[:-1]).tolist()
    borders = path.borders
    if len(rows) == 1:
        return np.linspace(borders[0], borders[1], for_each_row * rows[0] + 1)
    # A border belongs to the piece behind it.
    ends = np.append(np.nextafter(borders[1:-1], -np.inf), borders[-1])
    places = zip(borders[:-1].tolist(), ends.tolist(), rows, strict=True)
    return np.concatenate([np.linspace(low, high, for_each_row * count + 1) for low, high, count in places])

"""Paths of moves q(s), s from 0 to 1: PTP, distances of joints, joint limits, and the least time."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.plan_kernel import Polynomial


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


def least_time_s(path: Polynomial, velocity: Array) -> tuple[float, float]:
    """Return how long (s) a path takes with one joint at its velocity limit (rad/s, (n,)) throughout.

    The second value is how far the joint goes that goes farthest (rad). Both are NaN where the path is.
    """
    # The distance that each joint goes, there and back, between samples.
    s = np.array([0.0, 1.0]) if path.straight else _places(path, 4)
    distances = np.abs(np.diff(path.derivatives(s)[0], axis=0)).sum(axis=0)
    return float((distances / velocity).max()), float(distances.max())


def least_time_per_s(path: Polynomial, velocity: Array) -> float:
    """Return how long (s) a unit of s takes where it takes least.

    There the TCP of a line is fastest, with its fastest joint at the velocity limit (rad/s, (n,)).
    """
    times_s = (np.abs(path.derivatives(_places(path, 16))[1]) / velocity).max(axis=1)
    return float(times_s.min())


def first_outside(path: Polynomial, lowest: Array, highest: Array) -> Outside | None:
    """Return the first place at which a joint leaves its limits (rad, (n,)); None if no joint does.

    Turning points of joints count, so a joint cannot swing out and back between two samples.
    """
    # No polynomial goes farther than the sum of its coefficients.
    pieces = [path.coefficients[low:high] for low, high in pairwise(path.offsets.tolist())]
    reaches = [(rows[0], np.abs(rows[1:]).sum(axis=0)) for rows in pieces]
    if all(((q - r >= lowest) & (q + r <= highest)).all() for q, r in reaches):
        return None
    s = _places(path, 8)
    q, first, second, _ = path.derivatives(s)
    turning = np.abs(first) < np.abs(second) * np.gradient(s)[:, None]
    q[turning] -= 0.5 * first[turning] ** 2 / second[turning]
    outside = (q < lowest) | (q > highest)
    if not outside.any():
        return None
    k = int(outside.any(axis=1).argmax())
    joint, before = int(outside[k].argmax()), max(k - 1, 0)
    upwards = bool(q[k, joint] > highest[joint])
    # Between samples the joint goes about straight.
    step, limit = float(q[k, joint] - q[before, joint]), float((highest if upwards else lowest)[joint])
    part = (limit - float(q[before, joint])) / step if step else 1.0
    return Outside(float(s[before] + part * (s[k] - s[before])), joint, upwards)


def _places(path: Polynomial, for_each_row: int) -> Array:
    """Return rising s, so many for each row of coefficients, with both ends of each piece."""
    rows = (path.offsets[1:] - path.offsets[:-1]).tolist()
    borders = path.borders
    if len(rows) == 1:
        return np.linspace(borders[0], borders[1], for_each_row * rows[0] + 1)
    # A border belongs to the piece behind it.
    ends = np.append(np.nextafter(borders[1:-1], -np.inf), borders[-1])
    places = zip(borders[:-1].tolist(), ends.tolist(), rows, strict=True)
    return np.concatenate([np.linspace(low, high, for_each_row * count + 1) for low, high, count in places])

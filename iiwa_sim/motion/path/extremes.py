"""How far joints go along a path, whether that is within their limits, and where the path is fastest."""

from typing import NamedTuple

import numpy as np

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.path import extremes_kernel
from iiwa_sim.motion.path.polynomial import Polynomial


class Outside(NamedTuple):
    """The place at which a joint leaves its position limits."""

    s: float
    joint: int
    """Index of the joint."""
    upwards: bool
    """Whether it leaves through the upper limit."""


def first_outside(path: Polynomial, lowest: Array, highest: Array) -> Outside | None:
    """The first place at which a joint leaves its limits (rad, (n,)); None where none does.

    Where a joint turns back is found, so that it cannot swing out and back between two samples.
    """
    s, joint = extremes_kernel.first_outside(path.borders, path.offsets, path.coefficients, lowest, highest)
    if joint < 0:
        return None
    return Outside(s, joint, bool(path.joints(s)[joint] > 0.5 * (lowest[joint] + highest[joint])))


def travel(path: Polynomial) -> Array:
    """How far each joint goes, there and back (rad, (n,)), but for what is missed where it turns between
    places that are looked at."""
    ways = np.empty(path.coefficients.shape[1])
    extremes_kernel.travel(path.offsets, path.coefficients, ways)
    return ways


def least_time_per_s(path: Polynomial, velocity: Array) -> float:
    """How long (s) a unit of the path's parameter takes where it takes least.

    There the TCP of a line is fastest, with its fastest joint at the velocity limit (rad/s, (n,)).
    """
    room = np.empty((2, 1, path.coefficients.shape[1]))
    time: float = extremes_kernel.least_time_per_s(
        path.borders, path.offsets, path.coefficients, velocity, room
    )
    return time

"""Poses of an S-R-S arm where branches meet: the straight arm, and where both solutions for A2 are one.

There the seed is followed where it is near: see `iiwa_sim.robot.follow`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import sqrt

from iiwa_sim.frames import Transform
from iiwa_sim.robot.follow import Side, follow_seed
from iiwa_sim.robot.model import Model

REACH_M = 1e-10
"""Farther than this out of reach is out of reach; closer is rounding."""

# sin^2(A4/2) below which the straight arm is meant: A4 of 1e-7 rad, which moves the wrist point by 1e-15 m.
_STRAIGHT = 2.5e-15


def settle(half2: float, h2: float, d5_sin_a3: float) -> tuple[float, float] | None:
    """sin^2(A4/2) and the square of the wrist point's x in the frame of A1 (m^2), freed from rounding.

    `half2` is the former before rounding is looked at, `h2` the square of the wrist point's distance from
    the axis of A1 (m^2), `d5_sin_a3` the length of the forearm times the sine of A3 (m). None where out of
    reach.
    """
    if half2 < -REACH_M:
        return None
    if half2 < _STRAIGHT:
        return 0.0, h2
    y2 = d5_sin_a3 * d5_sin_a3 * 4.0 * half2 * (1.0 - half2)
    if y2 <= h2:
        return half2, h2 - y2
    # The forearm sticks out sideways farther than the wrist point is from the axis of A1. That is rounding
    # where a straighter arm of the same length would do, or where it is too little to matter.
    straighter = half2 * h2 / y2
    if half2 - straighter < REACH_M:
        return straighter, 0.0
    return (half2, 0.0) if sqrt(y2) - sqrt(h2) < REACH_M else None


def follow_on_branch(
    model: Model,
    status_x: Callable[[Sequence[float]], float],
    flange: Transform,
    redundancy: float,
    status: int,
    seed: Sequence[float],
) -> tuple[float, ...] | None:
    """`follow_seed` with that redundancy on that branch."""
    start = [*seed[:2], redundancy, *seed[3:]]
    sides = (Side(3, 0.0, bool(status & 2)), Side(5, 0.0, bool(status & 4)))
    q = follow_seed(model, flange, start, sides, held=2)
    if q is None:
        return None
    x = status_x(q)
    if abs(x) > 1e-9 and (x < 0.0) != bool(status & 1):
        return None
    return q

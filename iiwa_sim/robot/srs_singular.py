"""Poses of an S-R-S arm where branches meet: the straight arm, and where both solutions for A2 are one.

There a joint goes with the square root of the pose, so rounding of 1e-16 in the pose shows as 1e-8 in that
joint, and where a second singularity meets the first, as anything in a third. Following the seed to the pose
by the least change of joints is free of that.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import pi, remainder, sqrt, tau

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.frames import Transform, multiply, rotation_vector, transpose
from iiwa_sim.robot.model import Model

REACH_M = 1e-10
"""Farther than this out of reach is out of reach; closer is rounding."""

# sin^2(A4/2) below which the straight arm is meant: A4 of 1e-7 rad, which moves the wrist point by 1e-15 m.
_STRAIGHT = 2.5e-15
# A seed farther from the pose than this (m or rad) is not followed.
_FOLLOWED = 0.02
# The seed has come to the pose when it is as close as this (m and rad) ...
_CLOSED = 1e-10
# ... and a joint that the last bits of the pose decide upon may move on by this (m, rad).
_LARGEST_STEP = 0.05
_STEPS = 8


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


def follow_seed(
    model: Model,
    status_x: Callable[[Sequence[float]], float],
    flange: Transform,
    redundancy: float,
    status: int,
    seed: Sequence[float],
) -> tuple[float, ...] | None:
    """The joints nearest to the seed that reach the pose with that redundancy on that branch.

    None where the seed is not next to the pose, or where the least change of joints does not get there.
    """
    q = list(seed)
    q[2] = redundancy
    free = [0, 1, 3, 4, 5, 6]
    for step in range(_STEPS):
        for joint, negative in ((3, status & 2), (5, status & 4)):
            # a joint that would leave its side of zero stays at zero
            if (q[joint] > 0.0 if negative else q[joint] < 0.0) and joint in free:
                q[joint] = 0.0
                free.remove(joint)
        error = _error(flange, model.flange(q))
        distance = float(np.abs(error).max())
        if distance <= _CLOSED:
            break
        if step == 0 and distance > _FOLLOWED:
            return None
        change = _least_change(model.jacobian(q)[:, free], error)
        if float(np.abs(change).max()) > _LARGEST_STEP:
            return None
        for joint, value in zip(free, change.tolist(), strict=True):
            q[joint] += value
    else:
        return None
    x = status_x(q)
    if abs(x) > 1e-9 and (x < 0.0) != bool(status & 1):
        return None
    return tuple(value if -pi < value <= pi else remainder(value, tau) for value in q)


def _error(flange: Transform, reached: Transform) -> NDArray[np.float64]:
    """What is missing (6,): m, then the rotation vector in the base (rad)."""
    axis, angle = rotation_vector(multiply(flange.rotation, transpose(reached.rotation)))
    (x, y, z), (rx, ry, rz) = flange.translation, reached.translation
    return np.array((x - rx, y - ry, z - rz, angle * axis[0], angle * axis[1], angle * axis[2]))


def _least_change(jacobian: NDArray[np.float64], error: NDArray[np.float64]) -> NDArray[np.float64]:
    """The change of joints that takes the error away but for `_CLOSED`, from strong directions only."""
    u, sigma, vt = np.linalg.svd(jacobian, full_matrices=False)
    parts = u.T @ error
    change = np.zeros(vt.shape[1])
    missing = float(parts @ parts)
    for part, strength, direction in zip(parts.tolist(), sigma.tolist(), vt, strict=True):
        if missing <= (0.3 * _CLOSED) ** 2 or strength <= 1e-12:
            break
        change += (part / strength) * direction
        missing -= part * part
    return change

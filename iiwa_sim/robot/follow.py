"""Joint positions near a seed that reach a pose, near singular poses where a closed form would lose digits.

Where branches meet, a joint goes with the square root of the pose, so rounding of 1e-16 in the pose shows as
1e-8 in that joint; where a second singularity meets the first, as any error in a third joint. Iterating from
the seed to the pose by least changes of joints avoids that.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi, remainder, tau
from operator import sub
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.frames import Transform, turn_between
from iiwa_sim.robot.model import Model

# A seed farther from the pose than this (m or rad) is not followed.
_FOLLOWED = 0.02
# The seed has reached the pose when it is as close as this (m and rad) ...
_CLOSED = 1e-10
# ... and a joint that depends on the last bits of the pose may change by this (m, rad) more.
_LARGEST_STEP = 0.05
_STEPS = 8


class Side(NamedTuple):
    """A bound on a joint, which stays on one side of a border or on it."""

    joint: int
    border: float
    """rad"""
    below: bool


def follow_seed(
    model: Model,
    flange: Transform,
    seed: Sequence[float],
    sides: Sequence[Side],
    held: int | None = None,
) -> tuple[float, ...] | None:
    """The joints nearest to the seed that reach the pose, on the given sides; the joint `held` does not move.

    Angles are in (-pi, pi]. None if the seed is not near the pose, or if least changes of joints do not reach
    it.
    """
    q = list(seed)
    for joint, border, below in sides:
        q[joint] = min(q[joint], border) if below else max(q[joint], border)
    reached = model.flange(q)
    # Most seeds are far away, which their places tell at less cost than an error does.
    if max(map(abs, map(sub, flange.translation, reached.translation))) > _FOLLOWED:
        return None
    error = _error(flange, reached)
    if float(np.abs(error).max()) > _FOLLOWED:
        return None
    free = [joint for joint in range(len(q)) if joint != held]
    for _ in range(_STEPS):
        if float(np.abs(error).max()) <= _CLOSED:
            break
        change = _least_change(model.jacobian(q)[:, free], error)
        if float(np.abs(change).max()) > _LARGEST_STEP:
            return None
        for joint, value in zip(free, change.tolist(), strict=True):
            q[joint] += value
        for joint, border, below in sides:
            # a joint that would leave its side stays at the border
            if (q[joint] > border if below else q[joint] < border) and joint in free:
                q[joint] = border
                free.remove(joint)
        error = _error(flange, model.flange(q))
    else:
        return None
    return tuple(value if -pi < value <= pi else remainder(value, tau) for value in q)


def _error(flange: Transform, reached: Transform) -> NDArray[np.float64]:
    """The error of a pose (6,): translation (m), then the rotation vector in the base (rad)."""
    axis, angle = turn_between(reached.rotation, flange.rotation)
    (x, y, z), (rx, ry, rz) = flange.translation, reached.translation
    return np.array((x - rx, y - ry, z - rz, angle * axis[0], angle * axis[1], angle * axis[2]))


def _least_change(jacobian: NDArray[np.float64], error: NDArray[np.float64]) -> NDArray[np.float64]:
    """The smallest change of joints that reduces the error to `_CLOSED` of it, by strong singular
    directions only."""
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

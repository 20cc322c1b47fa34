"""Whole turns of joints: positions a turn apart give the same pose, and some arms can take both.

The closed forms give angles in (-pi, pi]. A joint that goes beyond has a part of its range, or all, twice.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, floor, pi, tau

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Turns:
    """The turns that the joints of one robot can take."""

    def __init__(self, low: Sequence[float], high: Sequence[float], rounding: float) -> None:
        """From the joint limits (rad), beyond which a position may be by this rounding."""
        self._joints = [
            (joint, lowest - rounding, highest + rounding)
            for joint, (lowest, highest) in enumerate(zip(low, high, strict=True))
            if lowest < -pi or highest > pi
        ]

    def nearest(self, joints: Sequence[float], present: Sequence[float]) -> Sequence[float]:
        """Joint positions (rad), each turned to where it is nearest to the present one within its limits.

        One that is outside whichever way it is turned stays as it is.
        """
        if not self._joints:
            return joints
        turned = list(joints)
        for joint, low, high in self._joints:
            position = turned[joint]
            fewest, most = ceil((low - position) / tau), floor((high - position) / tau)
            if fewest <= most:
                wanted = round((present[joint] - position) / tau)
                turned[joint] = position + tau * min(max(wanted, fewest), most)
        return turned

    def nearest_rows(self, joints: Array, present: Sequence[float]) -> Array:
        """The same for rows of joint positions (N, n), NaN where there are none."""
        if not self._joints:
            return joints
        turned = joints.copy()
        for joint, low, high in self._joints:
            position = joints[:, joint]
            fewest, most = np.ceil((low - position) / tau), np.floor((high - position) / tau)
            wanted = np.round((present[joint] - position) / tau)
            turns = np.minimum(np.maximum(wanted, fewest), most)
            turned[:, joint] += np.where(fewest <= most, turns, 0.0) * tau
        return turned


def continued(joints: Sequence[float], before: Sequence[float]) -> tuple[float, ...]:
    """Joint positions (rad), each turned to where it is nearest to the one before, whatever its limits."""
    return tuple([q + tau * round((p - q) / tau) for q, p in zip(joints, before, strict=True)])


def continued_rows(joints: Array, before: Array) -> Array:
    """The same for rows of joint positions (N, n)."""
    turned: Array = joints + tau * np.round((before - joints) / tau)
    return turned

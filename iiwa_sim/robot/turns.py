"""Whole turns of joints: positions a turn apart give the same pose, and some joints can reach several.

The closed forms give angles in (-pi, pi]. A joint with a larger range reaches a part of it, or all, twice.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, floor, pi, tau

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Turns:
    """The turns that the joints of one robot can reach."""

    def __init__(self, low: Sequence[float], high: Sequence[float], rounding: float) -> None:
        """Joint limits (rad), which a position may exceed by `rounding`."""
        self._joints = [
            (joint, lowest - rounding, highest + rounding)
            for joint, (lowest, highest) in enumerate(zip(low, high, strict=True))
            if lowest < -pi or highest > pi
        ]

    def nearest(self, joints: Sequence[float], present: Sequence[float]) -> Sequence[float]:
        """Joint positions (rad), each moved by whole turns to the one within its limits that is nearest to
        the present one.

        A position that is outside for any number of turns is unchanged.
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
        """`nearest` for rows of joint positions (N, n), with NaN for rows without a solution."""
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
    """Joint positions (rad), each moved by whole turns to be nearest to the one before, regardless of
    limits."""
    return tuple([q + tau * round((p - q) / tau) for q, p in zip(joints, before, strict=True)])


def continued_rows(joints: Array, before: Array) -> Array:
    """`continued` for rows of joint positions (N, n)."""
    turned: Array = joints + tau * np.round((before - joints) / tau)
    return turned

"""Noise on the readings of forces and torques."""

from typing import NamedTuple

import numpy as np

from iiwa_sim.contact.wrench import NO_WRENCH, Wrench

AHEAD = 256
"""Ticks for which it is drawn at once: that costs a tenth of what one by one does."""


class NoiseLevels(NamedTuple):
    """Standard deviations of what is added to the readings, normally distributed, and the seed of it."""

    seed: int
    """From 0 on."""
    force_n: float
    """Of each component of the force at the TCP."""
    torque_nm: float
    """Of each component of the torque at the TCP."""
    joint_torque_nm: float
    """Of the torque on each joint. It is drawn for itself, not that of the force by way of the arm."""


class Noise:
    """What is added to the readings in a tick. The same seed gives the same in every run."""

    def __init__(self, levels: NoiseLevels, joint_count: int) -> None:
        self.wrench: Wrench = NO_WRENCH
        self.joint_torques: tuple[float, ...] = (0.0,) * joint_count
        self._levels = np.repeat(
            [levels.force_n, levels.torque_nm, levels.joint_torque_nm], [3, 3, joint_count]
        )
        self.seed(levels.seed)

    def seed(self, seed: int) -> None:
        """Begin anew, with this seed (0 to 2**32 - 1)."""
        # The stream of RandomState is frozen: it stays the same with every numpy.
        self._random = np.random.RandomState(np.random.MT19937(np.random.SeedSequence(seed)))
        self._ahead: list[list[float]] = []
        self.next()

    def next(self) -> None:
        """Draw for a tick."""
        if not self._ahead:
            drawn = self._random.standard_normal((AHEAD, len(self._levels)))
            self._ahead = (drawn * self._levels)[::-1].tolist()
        fx, fy, fz, tx, ty, tz, *joint_torques = self._ahead.pop()
        self.wrench = (fx, fy, fz, tx, ty, tz)
        self.joint_torques = tuple(joint_torques)

"""Noise on the readings of forces and torques."""

from typing import NamedTuple

import numpy as np

from iiwa_sim.contact.wrench import NO_WRENCH, Wrench

AHEAD = 256
"""Ticks for which noise is drawn at once, at a tenth of the cost of single draws."""


class NoiseLevels(NamedTuple):
    """Standard deviations of the normally distributed noise on the readings, and its seed."""

    seed: int
    """0 or more."""
    force_n: float
    """Noise of each component of the force at the TCP."""
    torque_nm: float
    """Noise of each component of the torque at the TCP."""
    joint_torque_nm: float
    """Noise of the torque on each joint, drawn independently of that of the force."""


class Noise:
    """The noise on the readings in a tick. The same seed gives the same noise in every run."""

    def __init__(self, levels: NoiseLevels, joint_count: int) -> None:
        self.wrench: Wrench = NO_WRENCH
        self.joint_torques: tuple[float, ...] = (0.0,) * joint_count
        self._levels = np.repeat(
            [levels.force_n, levels.torque_nm, levels.joint_torque_nm], [3, 3, joint_count]
        )
        self.seed(levels.seed)

    def seed(self, seed: int) -> None:
        """Restart with this seed (0 to 2**32 - 1)."""
        # The stream of RandomState is frozen: it is the same with every numpy.
        self._random = np.random.RandomState(np.random.MT19937(np.random.SeedSequence(seed)))
        self._ahead: list[list[float]] = []
        self.next()

    def next(self) -> None:
        """Draw the noise for a tick."""
        if not self._ahead:
            drawn = self._random.standard_normal((AHEAD, len(self._levels)))
            self._ahead = (drawn * self._levels)[::-1].tolist()
        fx, fy, fz, tx, ty, tz, *joint_torques = self._ahead.pop()
        self.wrench = (fx, fy, fz, tx, ty, tz)
        self.joint_torques = tuple(joint_torques)

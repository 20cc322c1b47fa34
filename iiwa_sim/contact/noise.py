"""Noise on the readings of forces and torques."""

import numpy as np

from iiwa_sim.wrench import Wrench

AHEAD = 256
"""Ticks for which noise is drawn at once, at a tenth of the cost of single draws."""


class Noise:
    """Noise on the readings in a tick: it depends only on the seed and on the number of ticks since then.

    A robot at rest can skip ticks: the generator, Philox, gives any part of its stream by a counter.
    """

    def __init__(
        self, seed: int, force_n: float, torque_nm: float, joint_torque_nm: float, joint_count: int
    ) -> None:
        """Take standard deviations: of each component of force and torque at the TCP, and of each joint."""
        self._levels = np.repeat([force_n, torque_nm, joint_torque_nm], [3, 3, joint_count])
        self.seed(seed)

    def seed(self, seed: int) -> None:
        """Restart with this seed (0 to 2**32 - 1)."""
        self._seed, self._tick, self._block = seed, 0, -1
        self._rows: list[list[float]] = []  # of the present block of ticks

    def next(self, ticks: int = 1) -> None:
        """Advance by this number of ticks."""
        self._tick += ticks

    @property
    def wrench(self) -> Wrench:
        """Noise of the wrench at the TCP (N, Nm)."""
        fx, fy, fz, tx, ty, tz = self._row()[:6]
        return (fx, fy, fz, tx, ty, tz)

    @property
    def joint_torques(self) -> tuple[float, ...]:
        """Noise of the torque on each joint (Nm)."""
        return tuple(self._row()[6:])

    def _row(self) -> list[float]:
        block, place = divmod(self._tick, AHEAD)
        if block != self._block:
            # RandomState is frozen: the same with every numpy. A block has 64 bits of the counter.
            random = np.random.RandomState(np.random.Philox(key=self._seed, counter=block << 64))
            drawn = random.standard_normal((AHEAD, len(self._levels))) * self._levels
            self._block, self._rows = block, drawn.tolist()
        return self._rows[place]

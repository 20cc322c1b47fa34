"""How far the arm is from all that it may meet: nothing is computed while it stays away from things at
rest."""

from __future__ import annotations

from typing import Any

import mujoco as mj
import numpy as np
from numpy.typing import NDArray

ROOM_M = 1e-3
"""Contacts are computed where the arm is closer than this to something."""
FARTHEST_M = 1.0


class Distances:
    """Lower bounds of the distances of geoms that are imposed from all others.

    Each bound is how far apart a pair was when it was measured, less what its first geom has moved since.
    Only the pairs whose bound is the least are measured again.
    """

    def __init__(self, model: Any, data: Any, movers: list[int]) -> None:
        """`movers` are the imposed geoms; all others stand still until a new object is made."""
        self._movers = np.array(movers, np.intp)
        radius = model.geom_rbound.copy()
        radius[radius == 0.0] = 1e3  # of planes
        self._radius = radius[self._movers]
        bit, takes = model.geom_contype, model.geom_conaffinity
        one, two = np.meshgrid(self._movers, np.arange(model.ngeom), indexing="ij")
        is_mover = np.zeros(model.ngeom, bool)
        is_mover[self._movers] = True
        meets = ((bit[one] & takes[two]) | (bit[two] & takes[one])) != 0
        meets &= ~is_mover[two]
        self._of = np.nonzero(meets)[0]
        self._one, self._two = one[meets], two[meets]
        apart = data.geom_xpos[self._one] - data.geom_xpos[self._two]
        self._bounds = np.sqrt((apart * apart).sum(1)) - self._radius[self._of] - radius[self._two]
        self._look(data)

    def least(self, model: Any, data: Any) -> float:
        """Return how far (m) the movers, where they are in the data, are at least from all that they may
        meet."""
        moved = data.geom_xpos[self._movers] - self._places
        turned = data.geom_xmat[self._movers] - self._turns
        far = np.sqrt((moved * moved).sum(1)) + self._radius * np.sqrt(0.5 * (turned * turned).sum(1))
        self._bounds = bounds = self._bounds - far[self._of]  # a copy of this goes on with its own
        least = FARTHEST_M
        self._look(data)
        while len(bounds):
            k = int(bounds.argmin())
            if bounds[k] >= min(least, max(0.7 * least, ROOM_M)):
                return float(min(bounds[k], FARTHEST_M))
            bounds[k] = apart = mj.mj_geomDistance(
                model, data, int(self._one[k]), int(self._two[k]), FARTHEST_M, None
            )
            least = min(least, apart)
        return FARTHEST_M

    def _look(self, data: Any) -> None:
        self._places: NDArray[np.float64] = data.geom_xpos[self._movers]
        self._turns: NDArray[np.float64] = data.geom_xmat[self._movers]

"""How far the arm is from all that it may meet: while it is away from what rests, nothing is computed."""

from __future__ import annotations

from typing import Any

import mujoco as mj
import numpy as np

from iiwa_sim.world.tick_kernel import lower

ROOM_M = 1e-3
"""Contacts are computed where the arm is closer than this to something."""
FARTHEST_M = 1.0


class Distances:
    """Lower bounds of the distances of geoms that are imposed from all others.

    Each bound is how far apart a pair was when it was measured, less what its first geom has moved since.
    Only the pairs whose bound is the least are measured again.
    """

    def __init__(self, model: Any, data: Any, movers: list[int], gripper: int) -> None:
        """`movers` are the imposed geoms: of links, then of the body `gripper` and what moves with it.

        All others stand still until a new object is made.
        """
        self._movers = np.array(movers, np.intp)
        links = int((model.geom_bodyid[self._movers] < gripper).sum())
        radius = model.geom_rbound.copy()
        radius[radius == 0.0] = 1e3  # of planes
        self._radius = radius[self._movers]
        bit, takes = model.geom_contype, model.geom_conaffinity
        one, two = np.meshgrid(self._movers, np.arange(model.ngeom), indexing="ij")
        is_mover = np.zeros(model.ngeom, bool)
        is_mover[self._movers] = True
        meets = (((bit[one] & takes[two]) | (bit[two] & takes[one])) != 0) & ~is_mover[two]
        of = np.nonzero(meets)[0]
        self._pairs = np.ascontiguousarray(np.stack([of, one[meets], two[meets]], axis=1))
        self._reaches = self._radius[of] + radius[two[meets]]
        split = int(np.searchsorted(of, links))
        self._parts = slice(0, split), slice(split, len(of))
        off = np.linalg.norm(data.geom_xpos[self._movers[links:]] - data.xpos[gripper], axis=1)
        self.reach_m = float((off + self._radius[links:]).max(initial=0.0))
        """No point of what moves with the gripper is farther from it."""
        self._bounds = np.full(len(of), -1e9)
        self._was = np.hstack([data.geom_xpos[self._movers], data.geom_xmat[self._movers]])
        self._moved = np.zeros(len(movers))

    def least(self, model: Any, data: Any, of_tool: bool) -> float:
        """Return how far (m) the links, or what moves with the gripper, are from all that they may meet."""
        # Copies, since a copy of this goes on with what it has.
        self._bounds, self._was = bounds, was = self._bounds.copy(), self._was.copy()
        rest = self._movers, self._radius, was, data.geom_xpos, data.geom_xmat, self._moved
        lower(bounds, self._pairs, self._reaches, *rest)
        least, part = FARTHEST_M, self._parts[of_tool]
        bounds = bounds[part]
        while len(bounds):
            k = int(bounds.argmin())
            if bounds[k] >= min(least, max(0.7 * least, ROOM_M)):
                return float(min(bounds[k], FARTHEST_M))
            _, one, two = self._pairs[part.start + k].tolist()
            bounds[k] = apart = mj.mj_geomDistance(model, data, one, two, FARTHEST_M, None)
            least = min(least, apart)
        return FARTHEST_M

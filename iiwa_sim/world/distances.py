"""How far arms are from all that they may meet: while they are away from what rests, nothing is computed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco as mj
import numpy as np

from iiwa_sim.world.tick_kernel import ROOM_M, lower

FARTHEST_M = 1.0


class Distances:
    """Lower bounds of the distances of geoms that are imposed from all others.

    Each bound is how far apart a pair was when it was measured, less what its geoms have moved since. Only
    the pairs whose bound is the least are measured again. Pairs are in groups: for each arm those of its
    links, and those of what moves with its gripper; the last one has the pairs of different arms.
    """

    def __init__(self, model: Any, data: Any, arms: Sequence[tuple[list[int], list[int], int]]) -> None:
        """`arms` are geoms of links, geoms that move with the gripper, and the gripper's body, of each arm.

        All other geoms stand still until a new object is made.
        """
        groups = [geoms for links, tool, _ in arms for geoms in (links, tool)]
        self._movers = movers = np.array([geom for geoms in groups for geom in geoms], np.intp)
        radius = model.geom_rbound.copy()
        radius[radius == 0.0] = 1e3  # of planes
        self._radius = radius[movers]
        bit, takes, count = model.geom_contype, model.geom_conaffinity, len(movers)
        number, group = np.full(model.ngeom, count), np.repeat(range(len(groups)), [*map(len, groups)])
        number[movers] = range(count)
        one, two = np.meshgrid(movers, np.arange(model.ngeom), indexing="ij")
        meets = ((bit[one] & takes[two]) | (bit[two] & takes[one])) != 0
        arm = np.append(group // 2, -1)
        meets &= (number[two] == count) | ((one < two) & (arm[number[one]] != arm[number[two]]))
        first, second = number[one[meets]], number[two[meets]]
        of = np.where(second == count, group[first], len(groups))
        order = np.argsort(of, kind="stable")
        pairs = np.stack([one[meets], two[meets], first, second], axis=1)
        self._pairs = np.ascontiguousarray(pairs[order])
        self._reaches = radius[self._pairs[:, 0]] + radius[self._pairs[:, 1]]
        self._splits = np.searchsorted(of[order], range(len(groups) + 2)).tolist()
        self.reach_m = []
        """No point of what moves with each gripper is farther from it."""
        for _, tool, body in arms:
            off = np.linalg.norm(data.geom_xpos[tool] - data.xpos[body], axis=1)
            self.reach_m.append(float((off + radius[tool]).max(initial=0.0)))
        self._moved = np.zeros(count + 1)
        self._bounds = np.full(len(self._pairs), -1e9)
        self._was = np.hstack([data.geom_xpos[self._movers], data.geom_xmat[self._movers]])

    def least(self, model: Any, data: Any, group: int) -> float:
        """Return how far (m) a group is from all that it may meet."""
        # Copies, since a copy of this goes on with what it has.
        self._bounds, self._was = bounds, was = self._bounds.copy(), self._was.copy()
        rest = self._movers, self._radius, was, data.geom_xpos, data.geom_xmat, self._moved
        lower(bounds, self._pairs, self._reaches, *rest)
        least, start = FARTHEST_M, self._splits[group]
        bounds = bounds[start : self._splits[group + 1]]
        while len(bounds):
            k = int(bounds.argmin())
            if bounds[k] >= min(least, max(0.7 * least, ROOM_M)):
                return float(min(bounds[k], FARTHEST_M))
            one, two, *_ = self._pairs[start + k].tolist()
            bounds[k] = apart = mj.mj_geomDistance(model, data, one, two, FARTHEST_M, None)
            least = min(least, apart)
        return FARTHEST_M

"""How far arms are from all that they may meet: while they are away from what rests, nothing is computed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco as mj
import numpy as np

FARTHEST_M = 1.0


class Distances:
    """Distances of geoms that are imposed from all others.

    Only pairs are measured whose bounding spheres are nearer than the least distance so far. Pairs are in
    groups: for each arm those of its links, and those of what moves with its gripper; the last one has the
    pairs of different arms.
    """

    def __init__(self, model: Any, data: Any, arms: Sequence[tuple[list[int], list[int], int]]) -> None:
        """`arms` are geoms of links, those that move with the gripper, and its body, of each arm."""
        groups = [geoms for links, tool, _ in arms for geoms in (links, tool)]
        movers = np.array([geom for geoms in groups for geom in geoms], np.intp)
        radius = model.geom_rbound.copy()
        radius[radius == 0.0] = 1e3  # of planes
        bit, takes, none = model.geom_contype, model.geom_conaffinity, len(groups)
        group = np.full(model.ngeom, none)
        group[movers] = np.repeat(range(none), [*map(len, groups)])
        one, two = np.meshgrid(movers, np.arange(model.ngeom), indexing="ij")
        meets = ((bit[one] & takes[two]) | (bit[two] & takes[one])) != 0
        meets &= (group[two] == none) | ((one < two) & (group[one] // 2 != group[two] // 2))
        one, two = one[meets], two[meets]
        of = np.where(group[two] == none, group[one], none)
        self._pairs = [(one[of == k], two[of == k]) for k in range(none + 1)]
        self._reaches = [radius[first] + radius[second] for first, second in self._pairs]
        self.reach_m = []
        """No point of what moves with each gripper is farther from it."""
        for _, tool, body in arms:
            off = np.linalg.norm(data.geom_xpos[tool] - data.xpos[body], axis=1)
            self.reach_m.append(float((off + radius[tool]).max(initial=0.0)))

    def least(self, model: Any, data: Any, group: int) -> float:
        """Return how far (m) a group is from all that it may meet."""
        (one, two), least = self._pairs[group], FARTHEST_M
        apart = np.linalg.norm(data.geom_xpos[one] - data.geom_xpos[two], axis=1) - self._reaches[group]
        for k in apart.argsort(kind="stable").tolist():
            if apart[k] >= least:
                break
            least = min(least, mj.mj_geomDistance(model, data, int(one[k]), int(two[k]), least, None))
        return least

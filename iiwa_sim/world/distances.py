"""How far arms are from all that they may meet: while they are away from what rests, nothing is computed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco as mj
import numpy as np

from iiwa_sim.world.tick_kernel import nearest


class Distances:
    """Distances of geoms that are imposed from all others.

    Only pairs are measured whose bounding spheres are near. Geoms are in groups: for each arm its links, and
    what moves with its gripper; the last group has the pairs of different arms.
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
        meets = ((bit[movers, None] & takes) | (bit & takes[movers, None])) != 0
        others = meets & (group[movers, None] // 2 != group // 2) & (group != none)
        meets &= group == none
        self._groups = []
        for found in [*(meets & (group[movers, None] == k) for k in range(none)), others]:
            one, two = found.any(axis=1).nonzero()[0], found.any(axis=0).nonzero()[0]
            reach = np.where(found[np.ix_(one, two)], radius[movers[one], None] + radius[two], -np.inf)
            self._groups.append((movers[one], two, reach))
        self.reach_m = []
        """Greatest distance of bodies at each gripper from it."""
        for _, tool, body in arms:
            off = np.linalg.norm(data.geom_xpos[tool] - data.xpos[body], axis=1)
            self.reach_m.append(float((off + radius[tool]).max(initial=0.0)))

    def least(self, model: Any, data: Any, group: int) -> float:
        """Return how far (m) a group is from all that it may meet, at least."""
        least, near = nearest(data.geom_xpos, *self._groups[group])
        for one, two in near:
            least = min(least, mj.mj_geomDistance(model, data, one, two, least, None))
        return float(least)

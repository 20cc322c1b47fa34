"""A plane to press on, with what tests want to know of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Vector = tuple[float, float, float]


class Plane:
    """Half a space: stiffness k (N/m) and, as b k d d', damping b (s/m), without friction. It never pulls."""

    def __init__(
        self, stiffness: float, point: Vector, normal: Vector = (0.0, 0.0, 1.0), damping: float = 0.0
    ) -> None:
        self.stiffness = stiffness
        self.damping = damping
        self._point = np.array(point)
        self._normal: NDArray[np.float64] = np.array(normal) / np.linalg.norm(normal)
        self.deepest_m = 0.0

    def depth(self, position: Vector) -> float:
        return max(float((self._point - np.array(position)) @ self._normal), 0.0)

    def feel(self, position: Vector, velocity: Vector, dt_s: float) -> tuple[Vector, Vector]:
        depth = self.depth(position)
        if depth == 0.0:
            return ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        if dt_s > 0.0:
            self.deepest_m = max(self.deepest_m, depth)
        damped = max(1.0 - self.damping * float(np.array(velocity) @ self._normal), 0.0)
        x, y, z = (self.stiffness * depth * damped * self._normal).tolist()
        return ((x, y, z), (0.0, 0.0, 0.0))

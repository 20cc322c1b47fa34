"""Gauss's principle of least constraint: of all ways the joints may go, the one that deviates least."""

from collections.abc import Sequence

import numpy as np

from iiwa_sim.motion.limits import Array


def least_deviation(
    jacobian: Array, wanted: Array, inertia: float, least: Sequence[float], greatest: Sequence[float]
) -> list[float]:
    """The way (n,) of the joints between `least` and `greatest` (n,).

    It makes |jacobian way - wanted|^2 + inertia |way|^2 small, where the rows of the `jacobian` (m, n) and
    of what is `wanted` (m,) are weighted with the roots of masses. Joints that would pass a bound are put on
    it one after the other, the one that passes it farthest first, and the others make up for it as far as
    they can.
    """
    matrix = jacobian.T @ jacobian
    matrix.flat[:: len(matrix) + 1] += inertia
    target = jacobian.T @ wanted
    way: list[float] = np.linalg.solve(matrix, target).tolist()
    free = np.ones(len(way), dtype=bool)
    fixed = np.zeros(len(way))
    while (farthest := _farthest_out(way, least, greatest)) is not None:
        free[farthest] = False
        fixed[farthest] = min(max(way[farthest], least[farthest]), greatest[farthest])
        found = fixed.copy()
        if free.any():
            rest = target[free] - matrix[np.ix_(free, ~free)] @ fixed[~free]
            found[free] = np.linalg.solve(matrix[np.ix_(free, free)], rest)
        way = found.tolist()
    return way


def _farthest_out(way: Sequence[float], least: Sequence[float], greatest: Sequence[float]) -> int | None:
    worst, joint = 0.0, None
    for k, (w, a, b) in enumerate(zip(way, least, greatest, strict=True)):
        out = max(a - w, w - b)
        if out > worst:
            worst, joint = out, k
    return joint

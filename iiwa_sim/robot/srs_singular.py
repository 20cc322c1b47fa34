"""Poses of an S-R-S arm where branches meet: the straight arm, and where both solutions for A2 coincide.

There the joint positions near the seed are found by iteration: see `iiwa_sim.robot.follow`.
"""

from __future__ import annotations

from collections.abc import Sequence

from iiwa_sim.frames import Transform
from iiwa_sim.robot.follow import Side, follow_seed
from iiwa_sim.robot.inverse_kernel import Inverse

_SIDES = [(Side(3, 0.0, bool(status & 2)), Side(5, 0.0, bool(status & 4))) for status in range(8)]


def follow_on_branch(
    inverse: Inverse,
    flange: Transform,
    redundancy: float,
    status: int,
    seed: Sequence[float],
) -> tuple[float, ...] | None:
    """`follow_seed` with the given redundancy and branch."""
    start = [*seed[:2], redundancy, *seed[3:]]
    q = follow_seed(inverse.model, flange, start, _SIDES[status], held=2)
    if q is None:
        return None
    x = inverse.distances(q)[0]
    if abs(x) > 1e-9 and (x < 0.0) != bool(status & 1):
        return None
    return q

"""The closed form of an arm for an array of poses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.frames import IDENTITY, Transform
from iiwa_sim.robot.inverse_kernel import NEAR, OUT_OF_REACH, solve_rows


class _Arm(Protocol):
    """The parts of `iiwa_sim.robot.inverse.Inverse` that are needed here."""

    kind: int
    numbers: NDArray[np.float64]

    def followed(
        self, flange: Transform, redundancy: float, status: int, seed: Sequence[float]
    ) -> tuple[float, ...] | None: ...


def solved_rows(
    arm: _Arm,
    rotations: NDArray[np.float64],
    translations: NDArray[np.float64],
    redundancies: NDArray[np.float64],
    status: int | NDArray[np.int64],
    seed: Sequence[float],
    aligned: float,
) -> NDArray[np.float64]:
    """Joint positions (rad, (N, n)) for rotations (N, 3, 3), translations (N, 3) in m and redundancies (N,).

    The status is one for all or (N,). Rows out of reach are NaN.

    Rows near singular poses are solved one by one, following the seed. With the axes of two joints parallel
    to `aligned` (rad) one of these is free, and keeps its position in the seed.
    """
    count = len(redundancies)
    poses = np.empty((count, 12))
    poses[:, :9] = np.reshape(rotations, (count, 9))
    poses[:, 9:] = translations
    places = np.array(redundancies, dtype=np.float64)
    statuses = np.array(np.broadcast_to(status, count), dtype=np.int64)
    joints = np.empty((count, len(seed)))
    results = np.empty(count, dtype=np.int8)
    seeds = np.array(seed, dtype=np.float64)
    solve_rows(arm.kind, arm.numbers, poses, places, statuses, seeds, aligned, joints, results)
    joints[results == OUT_OF_REACH] = np.nan
    near = (results == NEAR).nonzero()[0]
    asked = zip(poses[near].tolist(), places[near].tolist(), statuses[near].tolist(), strict=True)
    flange = IDENTITY
    before: list[float] = []
    for row, (pose, place, branch) in zip(near.tolist(), asked, strict=True):
        if pose != before:
            r0, r1, r2, r3, r4, r5, r6, r7, r8, x, y, z = before = pose
            flange = Transform((r0, r1, r2, r3, r4, r5, r6, r7, r8), (x, y, z))
        found = arm.followed(flange, place, branch, seed)
        if found is not None:
            joints[row] = found
    return joints

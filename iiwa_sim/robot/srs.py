"""Inverse kinematics of a seven-joint S-R-S arm (spherical shoulder and wrist) in closed form, A3 given.

With the wrist point w seen from the shoulder, its distance gives A4. In the frame that A1 and A2 turn, the
wrist point is v = (-d5 sinA4 cosA3, -d5 sinA4 sinA3, d3 + d5 cosA4); turned by A2 its height must be that of
w, turned by A1 its direction. What is left of the orientation is a Z-Y-Z wrist. A4, A2 and A6 have two
solutions each, told apart by the status: bit 0 is set where the wrist point has a negative x in the frame
that A1 turns, bit 1 where A4 is negative, bit 2 where A6 is zero or negative.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.frames import Transform
from iiwa_sim.robot.inverse_kernel import NEAR, OUT_OF_REACH, SRS, solve_one
from iiwa_sim.robot.inverse_rows import solved_rows
from iiwa_sim.robot.model import Model
from iiwa_sim.robot.srs_geometry import lengths_of
from iiwa_sim.robot.srs_singular import follow_on_branch

ALIGNED_RAD = 4e-10
"""With less than this between the axes of A5 and A7, A6 is zero and A5 is free."""

# Wider than the neighbourhood in which the seed is followed: lines keep out of it.
_STRETCHED_RAD = 1e-3
_SIDEWAYS_M = 1e-4


class Srs:
    """Closed form with A3 as the redundancy; see `iiwa_sim.robot.inverse.Inverse` for the interface."""

    def __init__(self, model: Model) -> None:
        """Raises `RobotFault` where the model is no S-R-S arm."""
        self.model = model
        self.lengths = lengths_of(model)
        _, self._d3, self._d5, _ = self.lengths
        self.kind = SRS
        self.numbers = np.array(self.lengths)
        self._room = np.empty((3, 12))
        self.statuses = range(8)
        self.redundancy_range = (model.description.position_min[2], model.description.position_max[2])

    def joints(
        self, flange: Transform, redundancy: float, status: int, seed: Sequence[float]
    ) -> tuple[float, ...] | None:
        result, joints = solve_one(
            SRS, self.numbers, *flange, redundancy, status, seed, ALIGNED_RAD, self._room
        )
        if result == OUT_OF_REACH:
            return None
        solved: tuple[float, ...] = joints
        return (self.followed(flange, redundancy, status, seed) if result == NEAR else None) or solved

    def followed(
        self, flange: Transform, redundancy: float, status: int, seed: Sequence[float]
    ) -> tuple[float, ...] | None:
        """The joint positions on that branch next to the seed, if it is next to the pose."""
        return follow_on_branch(self.model, self._status_x, flange, redundancy, status, seed)

    def beyond_reach(self, flange: Transform) -> float:
        base_shoulder, upper, fore, hand = self.lengths
        (_, _, r02, _, _, r12, _, _, r22), (x, y, z) = flange
        away = sqrt((x - hand * r02) ** 2 + (y - hand * r12) ** 2 + (z - hand * r22 - base_shoulder) ** 2)
        return max(away - upper - fore, 0.0) + min(away - abs(upper - fore), 0.0)

    def branches(
        self, flange: Transform, redundancy: float, seed: Sequence[float]
    ) -> list[tuple[int, tuple[float, ...]]]:
        found = ((status, self.joints(flange, redundancy, status, seed)) for status in self.statuses)
        return [(status, joints) for status, joints in found if joints is not None]

    def joints_batch(
        self,
        rotations: NDArray[np.float64],
        translations: NDArray[np.float64],
        redundancies: NDArray[np.float64],
        status: int | NDArray[np.int64],
        seed: Sequence[float],
    ) -> NDArray[np.float64]:
        return solved_rows(self, rotations, translations, redundancies, status, seed, ALIGNED_RAD)

    def status(self, q: Sequence[float]) -> int:
        return (self._status_x(q) < 0.0) | (q[3] < 0.0) << 1 | (q[5] <= 0.0) << 2

    def merging_statuses(self, q: Sequence[float], near: float = 1e-6) -> Sequence[int]:
        statuses = [self.status(q)]
        for bit, distance in ((1, self._status_x(q)), (2, q[3]), (4, q[5])):
            if abs(distance) < near:
                statuses += [status ^ bit for status in statuses]
        return statuses

    def turning_point(self, q: Sequence[float]) -> str | None:
        if abs(q[3]) < _STRETCHED_RAD:
            return "the arm is stretched"
        if abs(self._status_x(q)) < _SIDEWAYS_M:
            return "the wrist is on the axis of A1, or beside it as far as A3 allows"
        return None

    def turn(self, q: Sequence[float]) -> int:
        return sum((position < 0.0) << bit for bit, position in enumerate(q))

    def redundancy(self, q: Sequence[float]) -> float:
        return q[2]

    def _status_x(self, q: Sequence[float]) -> float:
        """x (m) of the wrist point in the frame that A1 turns."""
        _, q2, q3, q4, _, _, _ = q
        return sin(q2) * (self._d3 + self._d5 * cos(q4)) - cos(q2) * self._d5 * sin(q4) * cos(q3)

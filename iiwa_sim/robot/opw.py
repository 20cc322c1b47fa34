"""Inverse kinematics of a six-joint arm with ortho-parallel base and spherical wrist in closed form.

A1 turns the plane of the arm to the wrist point, or away from it; in that plane upper arm and forearm make a
triangle, which has two solutions; what is left of the orientation is an X-Y-X wrist, which has two. Status
and turn are those of KUKA for PTP. Status: bit 0 is set where the wrist point has a negative x in the frame
that A1 turns (the overhead area), bit 1 where A3 is not less than where the arm is stretched, bit 2 where A5
is above zero. Turn: bit i is set where A(i + 1) is negative.

The form is that of Brandstoetter, Angerer and Hofbaur (2014), without lateral offset. py-opw-kinematics has
it, too. We do without: it loses branches where they meet (of 500 poses with A5 = 0, up to a fifth), has no
say in which joint keeps its position there, takes 1.7 ms for 200 poses of a line where this takes 0.05, and
brings SciPy.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, remainder, sin, sqrt, tau

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.frames import Transform, multiply
from iiwa_sim.robot.follow import Side, follow_seed
from iiwa_sim.robot.inverse_kernel import NEAR, OPW, OUT_OF_REACH, solve_one
from iiwa_sim.robot.inverse_rows import solved_rows
from iiwa_sim.robot.model import Model
from iiwa_sim.robot.opw_geometry import geometry_of
from iiwa_sim.robot.trigonometry_kernel import cosine, sine

ALIGNED_RAD = 4e-10
"""With less than this between the axes of A4 and A6, A5 is zero and A4 is free."""

# Wider than the neighbourhood in which the seed is followed: lines keep out of it.
_STRETCHED_RAD = 1e-3
_SIDEWAYS_M = 1e-4


class Opw:
    """The closed form; see `iiwa_sim.robot.inverse.Inverse` for the interface. There is no redundancy."""

    def __init__(self, model: Model) -> None:
        """Raises `RobotFault` where the model is no such arm."""
        self.model = model
        self.geometry = geometry_of(model)
        upper, fore = self.geometry.lengths
        self._stretched = self.geometry.stretched
        self.kind = OPW
        (sx, sz), (ux, uz), _, hand, signs, unturned = self.geometry
        lengths = (fore / upper, (upper + fore) ** 2, 0.25 / (upper * fore))
        turned = (sine(self._stretched), cosine(self._stretched))
        self.numbers = np.array((sx, sz, ux, uz, hand, *lengths, *turned, *signs, *unturned))
        self._room = np.empty((3, 12))
        self.statuses = range(8)
        self.redundancy_range = None

    def joints(
        self,
        flange: Transform,
        redundancy: float,
        status: int,
        seed: Sequence[float],
    ) -> tuple[float, ...] | None:
        result, joints = solve_one(
            OPW, self.numbers, *flange, redundancy, status, seed, ALIGNED_RAD, self._room
        )
        if result == OUT_OF_REACH:
            return None
        solved: tuple[float, ...] = joints
        return (self.followed(flange, redundancy, status, seed) if result == NEAR else None) or solved

    def beyond_reach(self, flange: Transform) -> float:
        upper, fore = self.geometry.lengths
        shoulder_x, shoulder_z = self.geometry.shoulder
        hand, along = self.geometry.hand, multiply(flange.rotation, self.geometry.unturned)[::3]
        x, y, z = (at - hand * axis for at, axis in zip(flange.translation, along, strict=True))
        out = sqrt(x * x + y * y)
        ways = []
        for side in (out, -out):  # before the shoulder, or in the overhead area behind it
            away = sqrt((side - shoulder_x) ** 2 + (z - shoulder_z) ** 2)
            ways.append(max(away - upper - fore, 0.0) + min(away - abs(upper - fore), 0.0))
        return min(ways, key=abs)

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
        return (self._wrist_x(q) < 0.0) | (self._bend(q) >= 0.0) << 1 | (q[4] > 0.0) << 2

    def merging_statuses(self, q: Sequence[float], near: float = 1e-6) -> Sequence[int]:
        statuses = [self.status(q)]
        for bit, distance in ((1, self._wrist_x(q)), (2, self._bend(q)), (4, q[4])):
            if abs(distance) < near:
                statuses += [status ^ bit for status in statuses]
        return statuses

    def turning_point(self, q: Sequence[float]) -> str | None:
        if abs(self._bend(q)) < _STRETCHED_RAD:
            return "the arm is stretched"
        if abs(self._wrist_x(q)) < _SIDEWAYS_M:
            return "the wrist is on the axis of A1"
        return None

    def turn(self, q: Sequence[float]) -> int:
        return sum((position < 0.0) << bit for bit, position in enumerate(q))

    def redundancy(self, q: Sequence[float]) -> float:  # noqa: ARG002  the interface has it
        return 0.0

    def _bend(self, q: Sequence[float]) -> float:
        """How far A3 is from where the arm is stretched (rad)."""
        return remainder(q[2] - self.geometry.signs[2] * self._stretched, tau)

    def _wrist_x(self, q: Sequence[float]) -> float:
        """x (m) of the wrist point in the frame that A1 turns."""
        (sx, _), (ux, uz), (fx, fz), _, signs, _ = self.geometry
        q2 = signs[1] * q[1]
        q23 = q2 + signs[2] * q[2]
        return sx + ux * cos(q2) + uz * sin(q2) + fx * cos(q23) + fz * sin(q23)

    def followed(
        self,
        flange: Transform,
        redundancy: float,  # noqa: ARG002  the interface has it
        status: int,
        seed: Sequence[float],
    ) -> tuple[float, ...] | None:
        """The joint positions on that branch next to the seed, if it is next to the pose."""
        stretched = self.geometry.signs[2] * self._stretched
        sides = (Side(2, stretched, not status & 2), Side(4, 0.0, not status & 4))
        q = follow_seed(self.model, flange, seed, sides)
        if q is None:
            return None
        x = self._wrist_x(q)
        if abs(x) > 1e-9 and (x < 0.0) != bool(status & 1):
            return None
        return q

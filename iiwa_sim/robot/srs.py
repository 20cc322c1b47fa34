"""Inverse kinematics of a seven-joint S-R-S arm (spherical shoulder and wrist) in closed form, A3 given.

With the wrist point w seen from the shoulder, its distance gives A4. In the frame that A1 and A2 turn, the
wrist point is v = (-d5 sinA4 cosA3, -d5 sinA4 sinA3, d3 + d5 cosA4); turned by A2 its height must be that of
w, turned by A1 its direction. What is left of the orientation is a Z-Y-Z wrist. A4, A2 and A6 have two
solutions each, told apart by the status: bit 0 is set where the wrist point has a negative x in the frame
that A1 turns, bit 1 where A4 is negative, bit 2 where A6 is zero or negative.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, pi, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.frames import Transform
from iiwa_sim.robot.inverse_kernel import SRS
from iiwa_sim.robot.model import Model
from iiwa_sim.robot.srs_batch import joints_of_regular_poses
from iiwa_sim.robot.srs_geometry import lengths_of
from iiwa_sim.robot.srs_singular import follow_on_branch, settle

ON_AXIS_M2 = 4e-20
"""Square of the wrist point's distance from the axis of A1 where it is on it, and A1 is free."""
ALIGNED_RAD = 4e-10
"""With less than this between the axes of A5 and A7, A6 is zero and A5 is free."""
NEARLY_ALIGNED_RAD = 2e-8
"""With less than this rounding shows in A5 by more than 1e-8 rad."""
NEAR_STRAIGHT = 2.5e-10
"""Square of the sine of half of A4 where the arm counts as nearly straight (A4 of 3e-5 rad)."""
NEAR_FOLD_M2 = 1e-10
"""Square of the wrist point's x in the frame of A1 where the two solutions for A2 nearly meet."""

# Wider than the neighbourhood in which the seed is followed: lines keep out of it.
_STRETCHED_RAD = 1e-3
_SIDEWAYS_M = 1e-4


class Srs:
    """Closed form with A3 as the redundancy; see `iiwa_sim.robot.inverse.Inverse` for the interface."""

    def __init__(self, model: Model) -> None:
        """Raises `RobotFault` where the model is no S-R-S arm."""
        self._model = model
        self.lengths = lengths_of(model)
        self._d1, self._d3, self._d5, self._d7 = self.lengths
        self._reach2 = (self._d3 + self._d5) ** 2
        self._quarter = 0.25 / (self._d3 * self._d5)
        self.kind = SRS
        self.numbers = np.array(self.lengths)
        self.statuses = range(8)
        self.redundancy_range = (model.description.position_min[2], model.description.position_max[2])

    def joints(
        self, flange: Transform, redundancy: float, status: int, seed: Sequence[float]
    ) -> tuple[float, ...] | None:
        (r00, r01, r02, r10, r11, r12, r20, r21, r22), (px, py, pz) = flange
        d3, d5, d7 = self._d3, self._d5, self._d7
        wx = px - d7 * r02
        wy = py - d7 * r12
        wz = pz - d7 * r22 - self._d1
        h2 = wx * wx + wy * wy

        # A4 from the half angle, which keeps its digits near the straight arm
        half2 = (self._reach2 - h2 - wz * wz) * self._quarter
        if half2 > 1.0:
            return None
        s4 = 2.0 * sqrt(half2 * (1.0 - half2)) if half2 > 0.0 else 0.0
        s3 = sin(redundancy)
        c3 = cos(redundancy)
        vy = d5 * s4 * s3
        x2 = h2 - vy * vy
        if half2 < NEAR_STRAIGHT or x2 < NEAR_FOLD_M2:
            settled = settle(half2, h2, d5 * s3)
            if settled is None:
                return None
            followed = follow_on_branch(self._model, self._status_x, flange, redundancy, status, seed)
            if followed is not None:
                return followed
            half2, x2 = settled
            s4 = 2.0 * sqrt(half2 * (1.0 - half2))
        c4 = 1.0 - 2.0 * half2
        if status & 2:
            s4 = -s4
        vx = -d5 * s4 * c3
        vy = -d5 * s4 * s3
        vz = d3 + d5 * c4
        x1 = -sqrt(x2) if status & 1 else sqrt(x2)

        # A2 turns (vx, vz) to (x1, wz), A1 turns (x1, vy) to (wx, wy)
        c2 = x1 * vx + wz * vz
        s2 = x1 * vz - wz * vx
        n = sqrt(c2 * c2 + s2 * s2)
        if n > 1e-20:
            c2 /= n
            s2 /= n
            q2 = atan2(s2, c2)
        else:  # forearm along y
            q2 = seed[1]
            c2 = cos(q2)
            s2 = sin(q2)
        if h2 > ON_AXIS_M2:
            c1 = wx * x1 + wy * vy
            s1 = wy * x1 - wx * vy
            n = sqrt(c1 * c1 + s1 * s1)
            c1 /= n
            s1 /= n
            q1 = atan2(s1, c1)
        else:
            q1 = seed[0]
            c1 = cos(q1)
            s1 = sin(q1)

        # direction of A7 in the frame that A1 to A4 turn, by turning it back joint by joint
        y = c1 * r12 - s1 * r02
        z = c1 * r02 + s1 * r12
        x = c2 * z - s2 * r22
        z = c2 * r22 + s2 * z
        t1 = c3 * y - s3 * x
        x = c3 * x + s3 * y
        t0 = c4 * x + s4 * z
        t2 = c4 * z - s4 * x
        s6 = sqrt(t0 * t0 + t1 * t1)
        if s6 > ALIGNED_RAD:
            if s6 < NEARLY_ALIGNED_RAD:
                followed = follow_on_branch(self._model, self._status_x, flange, redundancy, status, seed)
                if followed is not None:
                    return followed
            if status & 4:
                s6 = -s6
            c5 = t0 / s6
            s5 = t1 / s6
            q5 = atan2(s5, c5)
        else:
            q5 = seed[4]
            c5 = cos(q5)
            s5 = sin(q5)
            s6 = c5 * t0 + s5 * t1
            s6 = min(s6, 0.0) if status & 4 else max(s6, 0.0)
        # axis of A6 in the base, joint by joint: seen from there A7 has turned the flange's x and y
        x = -s5 * c4
        z = -s5 * s4
        y = s3 * x + c3 * c5
        x = c3 * x - s3 * c5
        z, x = c2 * z - s2 * x, c2 * x + s2 * z
        x, y = c1 * x - s1 * y, s1 * x + c1 * y
        q7 = atan2(x * r00 + y * r10 + z * r20, x * r01 + y * r11 + z * r21)
        q6 = atan2(s6, t2)
        # atan2 gives -pi for a negative zero
        return (
            q1 if q1 != -pi else pi,
            q2 if q2 != -pi else pi,
            redundancy,
            atan2(s4, c4),
            q5 if q5 != -pi else pi,
            q6 if q6 != -pi else pi,
            q7 if q7 != -pi else pi,
        )

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
        joints, near = joints_of_regular_poses(
            self.lengths,
            rotations,
            translations,
            redundancies,
            status,
            (NEAR_STRAIGHT, NEAR_FOLD_M2, NEARLY_ALIGNED_RAD),
        )
        statuses = np.broadcast_to(status, len(joints))
        for row in near.nonzero()[0]:
            r0, r1, r2, r3, r4, r5, r6, r7, r8 = rotations[row].ravel().tolist()
            x, y, z = translations[row].tolist()
            flange = Transform((r0, r1, r2, r3, r4, r5, r6, r7, r8), (x, y, z))
            found = self.joints(flange, float(redundancies[row]), int(statuses[row]), seed)
            joints[row] = np.nan if found is None else found
        return joints

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

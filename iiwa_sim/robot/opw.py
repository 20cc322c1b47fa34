"""Inverse kinematics of a six-joint arm with ortho-parallel base and spherical wrist in closed form.

A1 turns the plane of the arm to the wrist point, or away from it; in that plane upper arm and forearm make a
triangle, which has two solutions; what is left of the orientation is an X-Y-X wrist, which has two. Status
and turn are those of KUKA for PTP. Status: bit 0 is set where the wrist point has a negative x in the frame
that A1 turns (the overhead area), bit 1 where A3 is not less than where the arm is stretched, bit 2 where A5
is above zero. Turn: bit i is set where A(i + 1) is negative.

The form is that of Brandstoetter, Angerer and Hofbaur (2014), without lateral offset. py-opw-kinematics has
it, too. We do without: it loses branches where they meet (of 500 poses with A5 = 0, up to a fifth), has no
say in which joint keeps its position there, takes 1.7 ms for 200 poses of a line where this takes 0.2, and
brings SciPy.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, pi, remainder, sin, sqrt, tau

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.frames import Transform, multiply
from iiwa_sim.robot.follow import Side, follow_seed
from iiwa_sim.robot.inverse_kernel import OPW
from iiwa_sim.robot.model import Model
from iiwa_sim.robot.opw_batch import joints_of_regular_poses
from iiwa_sim.robot.opw_geometry import geometry_of

ON_AXIS_M2 = 4e-20
"""Square of the wrist point's distance from the axis of A1 where it is on it, and A1 is free."""
NEAR_AXIS_M2 = 1e-10
"""With less than this rounding shows in A1, and the seed is followed."""
ALIGNED_RAD = 4e-10
"""With less than this between the axes of A4 and A6, A5 is zero and A4 is free."""
NEARLY_ALIGNED_RAD = 2e-8
"""With less than this rounding shows in A4 by more than 1e-8 rad."""
NEAR_STRAIGHT = 2.5e-10
"""Square of the sine of half the bend of the elbow where the arm counts as nearly straight (3e-5 rad)."""
REACH = 1e-10
"""Farther than this out of reach, in that square, is out of reach; closer is rounding."""

# Wider than the neighbourhood in which the seed is followed: lines keep out of it.
_STRETCHED_RAD = 1e-3
_SIDEWAYS_M = 1e-4


class Opw:
    """The closed form; see `iiwa_sim.robot.inverse.Inverse` for the interface. There is no redundancy."""

    def __init__(self, model: Model) -> None:
        """Raises `RobotFault` where the model is no such arm."""
        self._model = model
        self.geometry = geometry_of(model)
        upper, fore = self.geometry.lengths
        self._ratio = fore / upper
        self._reach2 = (upper + fore) ** 2
        self._quarter = 0.25 / (upper * fore)
        self._stretched = self.geometry.stretched
        self._sp, self._cp = sin(self._stretched), cos(self._stretched)
        self.kind = OPW
        (sx, sz), (ux, uz), _, hand, signs, unturned = self.geometry
        lengths = (self._ratio, self._reach2, self._quarter)
        self.numbers = np.array((sx, sz, ux, uz, hand, *lengths, self._sp, self._cp, *signs, *unturned))
        self.statuses = range(8)
        self.redundancy_range = None

    def joints(
        self,
        flange: Transform,
        redundancy: float,  # noqa: ARG002  the interface has it
        status: int,
        seed: Sequence[float],
    ) -> tuple[float, ...] | None:
        (sx, sz), (ux, uz), _, hand, signs, unturned = self.geometry
        sign1, sign2, sign3, sign4, sign5, sign6 = signs
        px, py, pz = flange.translation
        r00, r01, r02, r10, r11, r12, r20, r21, r22 = multiply(flange.rotation, unturned)
        wx = px - hand * r00
        wy = py - hand * r10
        tz = pz - hand * r20 - sz
        h2 = wx * wx + wy * wy
        x1 = -sqrt(h2) if status & 1 else sqrt(h2)
        tx = x1 - sx

        # bend of the elbow from the half angle, which keeps its digits near the straight arm
        half2 = (self._reach2 - tx * tx - tz * tz) * self._quarter
        if half2 > 1.0 or half2 < -REACH:
            return None
        if half2 < NEAR_STRAIGHT or h2 < NEAR_AXIS_M2:
            followed = self._follow(flange, status, seed)
            if followed is not None:
                return followed
            half2 = max(half2, 0.0)
        sd = 2.0 * sqrt(half2 * (1.0 - half2))
        cd = 1.0 - 2.0 * half2
        if (sign3 < 0.0) == bool(status & 2):
            sd = -sd

        if h2 > ON_AXIS_M2:
            c1 = wx / x1
            s1 = wy / x1
            q1 = atan2(s1, c1)
        else:
            q1 = sign1 * seed[0]
            c1 = cos(q1)
            s1 = sin(q1)
        # A2 turns (vx, vz), from shoulder to wrist, to (tx, tz)
        k = self._ratio
        vx = ux + k * (ux * cd + uz * sd)
        vz = uz + k * (uz * cd - ux * sd)
        c2 = tx * vx + tz * vz
        s2 = tx * vz - tz * vx
        n = sqrt(c2 * c2 + s2 * s2)
        if n > 1e-20:
            c2 /= n
            s2 /= n
            q2 = atan2(s2, c2)
        else:  # wrist point in the shoulder
            q2 = sign2 * seed[1]
            c2 = cos(q2)
            s2 = sin(q2)
        sp, cp = self._sp, self._cp
        s3 = sd * cp + cd * sp
        c3 = cd * cp - sd * sp
        q3 = atan2(s3, c3)
        s23 = s2 * c3 + c2 * s3
        c23 = c2 * c3 - s2 * s3

        # direction of A6 in the frame that A1 to A3 turn
        x = c1 * r00 + s1 * r10
        y = c1 * r10 - s1 * r00
        t0 = x * c23 - r20 * s23
        z = x * s23 + r20 * c23
        s5 = sqrt(y * y + z * z)
        above = bool(status & 4) == (sign5 > 0.0)
        if s5 > ALIGNED_RAD:
            if s5 < NEARLY_ALIGNED_RAD:
                followed = self._follow(flange, status, seed)
                if followed is not None:
                    return followed
            if not above:
                s5 = -s5
            s4 = y / s5
            c4 = -z / s5
            q4 = atan2(s4, c4)
        else:
            q4 = sign4 * seed[3]
            s4 = sin(q4)
            c4 = cos(q4)
            s5 = s4 * y - c4 * z
            s5 = max(s5, 0.0) if above else min(s5, 0.0)
        # axis of A5 in the base: seen from there A6 has turned the flange's y and z
        x = s4 * s23
        z = s4 * c23
        x, y = c1 * x - s1 * c4, s1 * x + c1 * c4
        q6 = atan2(-(x * r02 + y * r12 + z * r22), x * r01 + y * r11 + z * r21)
        return (
            _half_open(sign1 * q1),
            _half_open(sign2 * q2),
            _half_open(sign3 * q3),
            _half_open(sign4 * q4),
            _half_open(sign5 * atan2(s5, t0)),
            _half_open(sign6 * q6),
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
            self.geometry,
            rotations,
            translations,
            status,
            (NEAR_STRAIGHT, NEAR_AXIS_M2, NEARLY_ALIGNED_RAD),
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

    def _follow(self, flange: Transform, status: int, seed: Sequence[float]) -> tuple[float, ...] | None:
        """The joint positions on that branch next to the seed, if it is next to the pose."""
        stretched = self.geometry.signs[2] * self._stretched
        sides = (Side(2, stretched, not status & 2), Side(4, 0.0, not status & 4))
        q = follow_seed(self._model, flange, seed, sides)
        if q is None:
            return None
        x = self._wrist_x(q)
        if abs(x) > 1e-9 and (x < 0.0) != bool(status & 1):
            return None
        return q


def _half_open(angle: float) -> float:
    """The angle (rad) in (-pi, pi]."""
    if -pi < angle <= pi:
        return angle
    turned = remainder(angle, tau)
    return turned if turned != -pi else pi

"""The kinematics of the TCP, forward and inverse, with the redundancy as a coordinate of its own."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import Any

import cython
import numpy as np
from numpy.typing import NDArray

from iiwa_sim.frames import Transform, inverse
from iiwa_sim.robot.inverse_kernel import Inverse
from iiwa_sim.robot.model import Model
from iiwa_sim.robot.turns_kernel import continued

if cython.compiled:
    from cython.cimports.iiwa_sim.robot.inverse_kernel import solve
else:
    from iiwa_sim.robot.inverse_kernel import solve

_REGULAR = cython.declare(cython.int, 0)
_OUT_OF_REACH = cython.declare(cython.int, 2)


@cython.cclass
class Kinematics:
    """The kinematics of one robot with one tool. Joint positions and redundancy are rad; poses are in the
    base, in m."""

    def __init__(self, model: Model, inverse_kinematics: Inverse, tool_in_flange: Transform) -> None:
        self.arm = model.tcp(tool_in_flange)
        self.joint_count = count = model.joint_count
        self._inverse: Any = inverse_kinematics
        self._kind, self._numbers = inverse_kinematics.kind, inverse_kinematics.numbers
        rotation, place = inverse(tool_in_flange)
        self._to_flange = np.array((*rotation, *place))
        d = model.description
        self._beyond_half_turn = min(d.position_min) < -pi or max(d.position_max) > pi
        # The redundancy is linear in the joints, with this gradient.
        none = inverse_kinematics.redundancy([0.0] * count)
        row = [inverse_kinematics.redundancy(unit) - none for unit in np.eye(count).tolist()]
        self._redundancy_row: Any = np.array([row])
        self._share = np.array(row)
        self.coordinates = 6 if inverse_kinematics.redundancy_range is None else 7
        self._room = np.zeros((3, 12))
        self._turned = np.zeros(9)
        self._last: Any = None
        self._status = 0

    def tcp(self, q: Sequence[float]) -> Transform:
        """Pose of the TCP."""
        pose: Transform = self.arm.pose(q)
        return pose

    def redundancy(self, q: Sequence[float]) -> float:
        """The redundancy of joint positions."""
        return float(self._inverse.redundancy(q))

    def joints(self, tcp: Transform, redundancy: float, present: Sequence[float]) -> tuple[float, ...] | None:
        """Joint positions for a pose of the TCP on the present branch; None if that does not reach it.

        Joints with more than one turn take the one nearest to the present position.
        """
        turned = self._turned
        for k in range(9):
            turned[k] = tcp[0][k]
        x, y, z = tcp[1]
        joints: tuple[float, ...] | None = self.joints_for(turned, x, y, z, redundancy, present)
        return joints

    @cython.cfunc
    @cython.exceptval(check=False)
    def redundancy_where_it_is(self) -> cython.double:
        """The redundancy of the joint positions for which the pose was found last."""
        redundancy: cython.double = 0.0
        for k in range(self.joint_count):
            redundancy += self._share[k] * self.arm._q[k]
        return redundancy

    @cython.cfunc
    def joints_for(
        self,
        turned: cython.double[::1],
        x: cython.double,
        y: cython.double,
        z: cython.double,
        redundancy: cython.double,
        present: Any,
    ) -> Any:
        """`joints` for a rotation of the TCP, row by row, and its position."""
        room, r, t = self._room, turned, self._to_flange
        for k in range(3):
            room[0, k] = r[0] * t[k] + r[1] * t[3 + k] + r[2] * t[6 + k]
            room[0, 3 + k] = r[3] * t[k] + r[4] * t[3 + k] + r[5] * t[6 + k]
            room[0, 6 + k] = r[6] * t[k] + r[7] * t[3 + k] + r[8] * t[6 + k]
        room[0, 9] = r[0] * t[9] + r[1] * t[10] + r[2] * t[11] + x
        room[0, 10] = r[3] * t[9] + r[4] * t[10] + r[5] * t[11] + y
        room[0, 11] = r[6] * t[9] + r[7] * t[10] + r[8] * t[11] + z
        for k in range(self.joint_count):
            q = present[k]
            room[1, k] = q
        if present is not self._last:
            self._status = self._inverse.status(present)
        result: cython.int = solve(
            self._kind, self._numbers, room, 0, redundancy, self._status, room[1], 0.0, room[2:]
        )
        if result == _OUT_OF_REACH:
            return None
        found: Any
        if result == _REGULAR:
            found = tuple([room[2, k] for k in range(self.joint_count)])
        else:
            self._last = None
            r0, r1, r2, r3, r4, r5, r6, r7, r8, px, py, pz = [room[0, k] for k in range(12)]
            flange = Transform((r0, r1, r2, r3, r4, r5, r6, r7, r8), (px, py, pz))
            found = self._inverse.joints(flange, redundancy, self._status, present)
            if found is None:
                return None
        if self._beyond_half_turn:
            found = continued(found, present)
        if result == _REGULAR:
            self._last = found  # this position is on the branch as well
        return found

    def tcp_and_jacobian(self, q: Sequence[float]) -> tuple[Transform, NDArray[np.float64]]:
        """Pose of the TCP, and its Jacobian: velocity (m/s) and angular velocity (rad/s) in base axes, and
        the rate of the redundancy (rad/s).

        Its transpose gives joint torques (Nm) from a force (N), a torque (Nm), and a torque on the
        redundancy.
        """
        jacobian = self.arm.jacobian(q)
        if self.coordinates == 7:
            jacobian = np.concatenate([jacobian, self._redundancy_row])
        return self.arm.pose(q), jacobian

"""The kinematics of the TCP, forward and inverse, with the redundancy as a coordinate of its own."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import Any

import cython
import numpy as np
from numpy.typing import NDArray

from iiwa_sim.frames import Transform, compose, inverse
from iiwa_sim.robot.inverse import Inverse
from iiwa_sim.robot.model import Model
from iiwa_sim.robot.turns import continued

if cython.compiled:
    from cython.cimports.iiwa_sim.robot.inverse_kernel import solve
else:
    from iiwa_sim.robot.inverse_kernel import solve

_REGULAR = cython.declare(cython.int, 0)
_OUT_OF_REACH = cython.declare(cython.int, 2)


@cython.cclass
class Kinematics:
    """Of one robot with one tool. Joint positions and redundancy are rad; poses are in the base, in m."""

    def __init__(self, model: Model, inverse_kinematics: Inverse, tool_in_flange: Transform) -> None:
        self.arm = model.tcp(tool_in_flange)
        self.joint_count = count = model.joint_count
        self._inverse: Any = inverse_kinematics
        self._kind, self._numbers = inverse_kinematics.kind, inverse_kinematics.numbers
        self._flange_in_tool: Any = inverse(tool_in_flange)
        rotation, place = self._flange_in_tool
        self._to_flange = np.array((*rotation, *place))
        d = model.description
        self._beyond_half_turn = min(d.position_min) < -pi or max(d.position_max) > pi
        # The redundancy is linear in the joints: where it is a joint's position, this is that joint's unit.
        none = inverse_kinematics.redundancy([0.0] * count)
        row = [inverse_kinematics.redundancy(unit) - none for unit in np.eye(count).tolist()]
        self._redundancy_row: Any = np.array([row])
        self.coordinates = 6 if inverse_kinematics.redundancy_range is None else 7
        self._room = np.zeros((3, 12))
        self._last: Any = None
        self._status = 0

    def tcp(self, q: Sequence[float]) -> Transform:
        """Where the TCP is."""
        pose: Transform = self.arm.pose(q)
        return pose

    def redundancy(self, q: Sequence[float]) -> float:
        """The redundancy of joint positions."""
        return float(self._inverse.redundancy(q))

    def joints(self, tcp: Transform, redundancy: float, present: Sequence[float]) -> tuple[float, ...] | None:
        """Joint positions for a pose of the TCP on the present branch, or None where that does not reach it.

        Joints that can turn beyond half a turn are where that is nearest to the present position.
        """
        room, t = self._room, self._to_flange
        r0: cython.double
        r1: cython.double
        r2: cython.double
        r3: cython.double
        r4: cython.double
        r5: cython.double
        r6: cython.double
        r7: cython.double
        r8: cython.double
        x: cython.double
        y: cython.double
        z: cython.double
        r0, r1, r2, r3, r4, r5, r6, r7, r8 = tcp[0]
        x, y, z = tcp[1]
        k: cython.Py_ssize_t
        for k in range(3):
            room[0, k] = r0 * t[k] + r1 * t[3 + k] + r2 * t[6 + k]
            room[0, 3 + k] = r3 * t[k] + r4 * t[3 + k] + r5 * t[6 + k]
            room[0, 6 + k] = r6 * t[k] + r7 * t[3 + k] + r8 * t[6 + k]
        room[0, 9] = r0 * t[9] + r1 * t[10] + r2 * t[11] + x
        room[0, 10] = r3 * t[9] + r4 * t[10] + r5 * t[11] + y
        room[0, 11] = r6 * t[9] + r7 * t[10] + r8 * t[11] + z
        for k in range(self.joint_count):
            room[1, k] = present[k]
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
            flange = compose(tcp, self._flange_in_tool)
            found = self._inverse.joints(flange, redundancy, self._status, present)
            if found is None:
                return None
        if self._beyond_half_turn:
            found = continued(found, present)
        if result == _REGULAR:
            self._last = found  # which is on this branch, too
        joints: tuple[float, ...] = found
        return joints

    def tcp_and_jacobian(self, q: Sequence[float]) -> tuple[Transform, NDArray[np.float64]]:
        """Where the TCP is, and its Jacobian: velocity (m/s), angular velocity (rad/s), both in base axes,
        and the redundancy's (rad/s).

        Transposed it makes joint torques (Nm) of a force (N), a torque (Nm), and one on the redundancy.
        """
        jacobian = self.arm.jacobian(q)
        if self.coordinates == 7:
            jacobian = np.concatenate([jacobian, self._redundancy_row])
        return self.arm.pose(q), jacobian

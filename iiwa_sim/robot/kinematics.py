"""The kinematics of the TCP, forward and inverse, with the redundancy as a coordinate of its own."""

from collections.abc import Sequence
from math import pi

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.frames import Transform, compose, inverse
from iiwa_sim.robot.inverse import Inverse
from iiwa_sim.robot.model import Model
from iiwa_sim.robot.turns import continued


class Kinematics:
    """Of one robot with one tool. Joint positions and redundancy are rad; poses are in the base, in m."""

    def __init__(self, model: Model, inverse_kinematics: Inverse, tool_in_flange: Transform) -> None:
        self._tcp = model.tcp(tool_in_flange)
        self._inverse = inverse_kinematics
        self._flange_in_tool = inverse(tool_in_flange)
        d = model.description
        self._beyond_half_turn = min(d.position_min) < -pi or max(d.position_max) > pi
        # The redundancy is linear in the joints: where it is a joint's position, this is that joint's unit.
        count = model.joint_count
        none = inverse_kinematics.redundancy([0.0] * count)
        row = [inverse_kinematics.redundancy(unit) - none for unit in np.eye(count).tolist()]
        self._redundancy_row = None if inverse_kinematics.redundancy_range is None else np.array([row])

    @property
    def coordinates(self) -> int:
        """Six of the TCP, and one more where there is redundancy."""
        return 6 if self._redundancy_row is None else 7

    def tcp(self, q: Sequence[float]) -> Transform:
        """Where the TCP is."""
        return self._tcp.pose(q)

    def redundancy(self, q: Sequence[float]) -> float:
        """The redundancy of joint positions."""
        return self._inverse.redundancy(q)

    def joints(self, tcp: Transform, redundancy: float, present: Sequence[float]) -> tuple[float, ...] | None:
        """Joint positions for a pose of the TCP on the present branch, or None where that does not reach it.

        Joints that can turn beyond half a turn are where that is nearest to the present position.
        """
        flange = compose(tcp, self._flange_in_tool)
        found = self._inverse.joints(flange, redundancy, self._inverse.status(present), present)
        return continued(found, present) if found is not None and self._beyond_half_turn else found

    def tcp_and_jacobian(self, q: Sequence[float]) -> tuple[Transform, NDArray[np.float64]]:
        """Where the TCP is, and its Jacobian: velocity (m/s), angular velocity (rad/s), both in base axes,
        and the redundancy's (rad/s).

        Transposed it makes joint torques (Nm) of a force (N), a torque (Nm), and one on the redundancy.
        """
        jacobian = self._tcp.jacobian(q)
        if self._redundancy_row is not None:
            jacobian = np.concatenate([jacobian, self._redundancy_row])
        return self._tcp.pose(q), jacobian

    def tcp_and_its_jacobian(self, q: Sequence[float]) -> tuple[Transform, NDArray[np.float64]]:
        """The same without the redundancy's row; the Jacobian (6, n) is not to be changed."""
        jacobian = self._tcp.jacobian(q)
        return self._tcp.pose(q), jacobian

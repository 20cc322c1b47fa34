"""The kinematics of the TCP, forward and inverse, with the redundancy as a coordinate of its own."""

from collections.abc import Sequence
from math import pi

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.frames import Transform, compose, inverse, rotate
from iiwa_sim.robot.inverse import Inverse
from iiwa_sim.robot.model import Model
from iiwa_sim.robot.turns import continued


class Kinematics:
    """Of one robot with one tool. Joint positions and redundancy are rad; poses are in the base, in m."""

    def __init__(self, model: Model, inverse_kinematics: Inverse, tool_in_flange: Transform) -> None:
        self._model = model
        self._inverse = inverse_kinematics
        self._tool_in_flange = tool_in_flange
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
        return compose(self._model.flange(q), self._tool_in_flange)

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
        flange = self._model.flange(q)
        jacobian = self._model.jacobian(q)
        x, y, z = rotate(flange.rotation, self._tool_in_flange.translation)
        # v + w x p: the TCP is beside the flange's origin by p.
        jacobian[:3] += np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]) @ jacobian[3:]
        if self._redundancy_row is not None:
            jacobian = np.concatenate([jacobian, self._redundancy_row])
        return compose(flange, self._tool_in_flange), jacobian

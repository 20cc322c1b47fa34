"""The external load on the arm, and what its joints feel of it."""

from collections.abc import Sequence

import numpy as np

from iiwa_sim.frames import Transform, compose, rotate
from iiwa_sim.robot.model import Model

Wrench = tuple[float, float, float, float, float, float]
"""Force (N) and torque (Nm) at the TCP, along its axes, acting on the robot."""


class ExternalLoad:
    """A wrench at the TCP and a torque on each joint, as pushed from outside; none in free space."""

    def __init__(self, joint_count: int) -> None:
        self.wrench: Wrench = (0.0,) * 6
        self.joint_push: tuple[float, ...] = (0.0,) * joint_count

    def joint_torques(
        self, model: Model, joints: Sequence[float], tool_in_flange: Transform
    ) -> tuple[float, ...]:
        """External torque (Nm) on each joint: pushes, and the wrench by the TCP's transposed Jacobian."""
        if not any(self.wrench):
            return self.joint_push
        flange = model.flange(joints)
        tcp = compose(flange, tool_in_flange)
        fx, fy, fz = rotate(tcp.rotation, self.wrench[:3])
        tx, ty, tz = rotate(tcp.rotation, self.wrench[3:])
        # Moved from the TCP to the flange's origin, of which we have the Jacobian, the force adds a torque.
        px, py, pz = (a - b for a, b in zip(tcp.translation, flange.translation, strict=True))
        at_flange = (fx, fy, fz, tx + py * fz - pz * fy, ty + pz * fx - px * fz, tz + px * fy - py * fx)
        torques = model.jacobian(joints).T @ np.array(at_flange)
        return tuple((torques + np.array(self.joint_push)).tolist())

"""The forward kinematics of a robot."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.frames import IDENTITY, Transform, Vector, compose
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.found_poses import poses_checksum
from iiwa_sim.robot.tcp_kernel import Tcp


class Model:
    """The robot of a description. Joint positions are rad, base first; poses are in the base, in m.

    Non-finite joint positions are not refused: they give non-finite results.
    """

    def __init__(self, description: RobotDescription) -> None:
        """Raises `RobotFault` if the URDF is unreadable or does not match the description."""
        self.description = description
        self.joint_count = len(description.joints)
        self.fixed_poses = _fixed_poses(description)
        """The constant poses between joints, in the form of `Tcp`."""
        self.tcp_of_flange = Tcp(self.fixed_poses, IDENTITY)
        """The flange in the form of a TCP."""
        self._tcp: Tcp | None = None

    def flange(self, q: Sequence[float]) -> Transform:
        """Pose of the flange."""
        return self.tcp_of_flange.pose(q)

    def tcp(self, tool_in_flange: Transform) -> Tcp:
        """The TCP of a tool; consecutive calls with the same tool return the same object."""
        if self._tcp is None or self._tcp.tool_in_flange != tool_in_flange:
            self._tcp = Tcp(self.fixed_poses, tool_in_flange)
        return self._tcp

    def jacobian(self, q: Sequence[float]) -> NDArray[np.float64]:
        """Jacobian (6, n) of the flange: velocity of its origin (m/s), then angular (rad/s), in base axes."""
        return self.tcp_of_flange.jacobian(q)

    def axes_at_zero(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Directions (n, 3) of the joint axes, and points (n, 3) on them (m), in the base at zero pose."""
        axes: list[Vector] = []
        points: list[Vector] = []
        frame = IDENTITY
        for step in self.fixed_poses[:-1]:
            frame = compose(frame, step)
            axes.append((frame.rotation[2], frame.rotation[5], frame.rotation[8]))
            points.append(frame.translation)
        return np.array(axes), np.array(points)


@lru_cache(maxsize=8)
def _fixed_poses(description: RobotDescription) -> tuple[Transform, ...]:
    """The constant poses in the form of `Tcp`; robots with equal descriptions, such as those of a fleet,
    share them."""
    found = description.found_poses
    if found is not None and len(found.poses) == len(description.joints) + 1:
        of = poses_checksum(description.urdf, description.joints, description.flange, found.poses)
        if found.of == of:
            return found.poses
    from iiwa_sim.robot.fixed_poses import read_fixed_poses  # Pinocchio takes a tenth of a second to load

    return read_fixed_poses(description)

"""Forward kinematics of a robot, by Pinocchio from its URDF."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from iiwa_sim.frames import Transform
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.fault import RobotFault
from iiwa_sim.robot.tcp import Tcp
from iiwa_sim.robot.urdf import check_urdf


class Model:
    """The robot of a description. Joint positions are rad, base first; poses are in the base, in m.

    Non-finite joint positions are not refused: they give non-finite results.
    """

    def __init__(self, description: RobotDescription) -> None:
        """Raises `RobotFault` where the URDF is unreadable or does not match the description."""
        self.description = description
        self.joint_count = len(description.joints)
        self._model = _read_urdf(description)
        self._check_joints()
        self._flange = self._frame(description.flange)
        self._data = self._model.createData()
        self._q = np.zeros(self.joint_count)
        # Views into the data, which every computation overwrites; fetching them anew costs more than it.
        self._flange_pose = self._data.oMf[self._flange]
        self._flange_rotation = self._flange_pose.rotation
        self._flange_translation = self._flange_pose.translation
        self._tcp: Tcp | None = None

    def flange(self, q: Sequence[float]) -> Transform:
        """Pose of the flange."""
        self._q[:] = q
        pin.framesForwardKinematics(self._model, self._data, self._q)
        (r0, r1, r2), (r3, r4, r5), (r6, r7, r8) = self._flange_rotation.tolist()
        x, y, z = self._flange_translation.tolist()
        return Transform((r0, r1, r2, r3, r4, r5, r6, r7, r8), (x, y, z))

    def tcp(self, tool_in_flange: Transform) -> Tcp:
        """The TCP of a tool: for all who ask for that of the same tool, one after the other, the same one."""
        if self._tcp is None or self._tcp.tool_in_flange != tool_in_flange:
            self._tcp = Tcp(self._model, self._flange, tool_in_flange)
        return self._tcp

    def jacobian(self, q: Sequence[float]) -> NDArray[np.float64]:
        """Jacobian (6, n) of the flange: velocity of its origin (m/s), then angular (rad/s), in base axes."""
        self._q[:] = q
        aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        jacobian: NDArray[np.float64] = pin.computeFrameJacobian(
            self._model, self._data, self._q, self._flange, aligned
        )
        return jacobian  # Pinocchio makes a new one every time

    def axes_at_zero(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Directions (n, 3) of the joint axes, and points (n, 3) on them (m), in the base at zero pose."""
        zero = np.zeros(self.joint_count)
        pin.computeJointJacobians(self._model, self._data, zero)
        places = [self._data.oMi[joint] for joint in range(1, self.joint_count + 1)]
        local = pin.ReferenceFrame.LOCAL
        axes = [
            place.rotation @ pin.getJointJacobian(self._model, self._data, joint, local)[3:, joint - 1]
            for joint, place in enumerate(places, start=1)
        ]
        return np.array(axes), np.array([place.translation for place in places])

    def _frame(self, link: str) -> int:
        """Index of the frame of a link, which Pinocchio gives for an unknown name too (one past the end)."""
        model, description = self._model, self.description
        index: int = model.getFrameId(link, pin.FrameType.BODY)
        if index >= model.nframes:
            raise RobotFault(
                description.settings_path, "flange", repr(link), f"a link of {description.urdf_path}"
            )
        if model.frames[index].parentJoint != self.joint_count:
            last = description.joints[-1]
            raise RobotFault(
                description.settings_path, "flange", repr(link), f"a link fixed to the last joint, {last}"
            )
        return index

    def _check_joints(self) -> None:
        model, description = self._model, self.description
        found = list(model.names)[1:]
        if found != list(description.joints):
            movable = f"the movable joints of {description.urdf_path} from the base on, {found}"
            raise RobotFault(description.settings_path, "joints", list(description.joints), movable)
        for index, name in enumerate(found, start=1):
            kind = model.joints[index].shortname()
            if model.joints[index].nq != 1 or not kind.startswith("JointModelR"):
                raise RobotFault(
                    description.urdf_path, f"joint {name}: type", kind, "a revolute joint with limits"
                )


def _read_urdf(description: RobotDescription) -> pin.Model:
    path = description.urdf_path
    check_urdf(path, description.urdf)
    try:
        with _silent_stderr():
            return pin.buildModelFromXML(description.urdf)
    except (ValueError, RuntimeError) as fault:
        raise RobotFault(path, "", "", f"a URDF that Pinocchio can read ({fault})") from None


@contextmanager
def _silent_stderr() -> Iterator[None]:
    """Keeps what C++ code prints on file descriptor 2 from the terminal."""
    kept = os.dup(2)
    with Path(os.devnull).open("wb") as nowhere:
        os.dup2(nowhere.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)

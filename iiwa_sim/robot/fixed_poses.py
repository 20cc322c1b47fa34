"""The robot of a URDF, as Pinocchio reads it. Loading that takes its time: import this where it is needed."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from math import hypot
from pathlib import Path

import numpy as np
import pinocchio as pin

from iiwa_sim.frames import IDENTITY, Rotation, Transform, Vector, compose, transpose
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.fault import RobotFault
from iiwa_sim.robot.urdf import check_urdf


def read_fixed_poses(description: RobotDescription) -> tuple[Transform, ...]:
    """What lies between the joints of a robot, as `Tcp` takes it.

    Raises `RobotFault` where the URDF is unreadable or does not match the description.
    """
    reading = _Reading(description)
    return tuple(reading.fixed_poses(reading.frame(description.flange)))


class _Reading:
    """Pinocchio's model of a URDF, checked against the description."""

    def __init__(self, description: RobotDescription) -> None:
        self.description = description
        self._joint_count = len(description.joints)
        self._model = read_urdf(description)
        self._check_joints()

    def fixed_poses(self, flange: int) -> list[Transform]:
        """The constant poses between joints, in the form of `Tcp`, up to the flange with this index."""
        model, data = self._model, self._model.createData()
        pin.computeJointJacobians(model, data, np.zeros(self._joint_count))
        poses: list[Transform] = []
        before = IDENTITY.rotation
        for joint in range(1, self._joint_count + 1):
            axis = pin.getJointJacobian(model, data, joint, pin.ReferenceFrame.LOCAL)[3:, joint - 1]
            turned = _with_z_along(axis.tolist())
            placement = _transform(model.jointPlacements[joint])
            poses.append(_within(transpose(before), placement, turned))
            before = turned
        on_last = _transform(model.frames[flange].placement)
        return [*poses, _within(transpose(before), on_last, IDENTITY.rotation)]

    def frame(self, link: str) -> int:
        """Index of the frame of a link; for an unknown name Pinocchio returns one past the end."""
        model, description = self._model, self.description
        index: int = model.getFrameId(link, pin.FrameType.BODY)
        if index >= model.nframes:
            raise RobotFault(
                description.settings_path, "flange", repr(link), f"a link of {description.urdf_path}"
            )
        if model.frames[index].parentJoint != self._joint_count:
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
            if model.parents[index] != index - 1:
                moved_by = model.names[model.parents[index]] if model.parents[index] else "the base"
                before = found[index - 2] if index > 1 else "the base"
                wanted = f"a link that {before} moves, each joint on the one before it"
                key = f"joint {name}: parent"
                raise RobotFault(description.urdf_path, key, f"moved by {moved_by}", wanted)
            kind = model.joints[index].shortname()
            if model.joints[index].nq != 1 or not kind.startswith("JointModelR"):
                raise RobotFault(
                    description.urdf_path, f"joint {name}: type", kind, "a revolute joint with limits"
                )


def _transform(pose: pin.SE3) -> Transform:
    (r0, r1, r2), (r3, r4, r5), (r6, r7, r8) = pose.rotation.tolist()
    x, y, z = pose.translation.tolist()
    return Transform((r0, r1, r2, r3, r4, r5, r6, r7, r8), (x, y, z))


def _with_z_along(axis: Vector) -> Rotation:
    """A rotation that takes z to an axis."""
    x, y, z = axis
    if abs(x) <= abs(y) and abs(x) <= abs(z):
        second = (0.0, z, -y)
    elif abs(y) <= abs(z):
        second = (-z, 0.0, x)
    else:
        second = (y, -x, 0.0)
    length = hypot(*second)
    a, b, c = second[0] / length, second[1] / length, second[2] / length
    return (b * z - c * y, a, x, c * x - a * z, b, y, a * y - b * x, c, z)


def _within(before: Rotation, pose: Transform, after: Rotation) -> Transform:
    """A pose between two rotated frames: `before` rotates the outer one, `after` the inner one."""
    origin = (0.0, 0.0, 0.0)
    return compose(Transform(before, origin), compose(pose, Transform(after, origin)))


def read_urdf(description: RobotDescription) -> pin.Model:
    """Raises RobotFault, in one line, where the URDF cannot be read."""
    path = description.urdf_path
    check_urdf(path, description.urdf)
    try:
        with _silent_stderr():
            return pin.buildModelFromXML(description.urdf)
    except (ValueError, RuntimeError) as fault:
        raise RobotFault(path, "", "", f"a URDF that Pinocchio can read ({fault})") from None


@contextmanager
def _silent_stderr() -> Iterator[None]:
    """Discards what C++ code prints on file descriptor 2."""
    kept = os.dup(2)
    with Path(os.devnull).open("wb") as nowhere:
        os.dup2(nowhere.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)

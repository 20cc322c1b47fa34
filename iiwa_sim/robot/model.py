"""The model of the arm: Pinocchio reads the URDF and gives its links, its shapes and its constant poses."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from functools import cached_property, lru_cache
from math import cos, sin
from typing import NamedTuple

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from iiwa_sim.frames import (
    IDENTITY,
    Rotation,
    Transform,
    Vector,
    compose,
    multiply,
    rotation_from_quaternion,
    transpose,
    with_z_along,
)
from iiwa_sim.robot.arm_kernel import Tcp
from iiwa_sim.robot.description import RobotDescription, RobotFault
from iiwa_sim.robot.urdf_check import checked_urdf

GREY = (0.8, 0.8, 0.8, 1.0)
"""Colour of a shape without a colour of its own."""
_ORIGIN = (0.0, 0.0, 0.0)


class Shape(NamedTuple):
    """A box, a sphere or a cylinder along z, in the frame of its link."""

    kind: str
    """box, sphere, cylinder"""
    size_m: tuple[float, ...]
    """The edges of a box, the radius of a sphere, radius and length of a cylinder."""
    pose: Transform
    colour: tuple[float, ...]
    """Red, green, blue, opacity: 0 to 1."""


class Link(NamedTuple):
    """A link and the joint between it and its parent."""

    name: str
    parent: int | None
    """Index of the parent among the links of the arm; None for the base."""
    pose: Transform
    """Pose in the parent with all joints at zero."""
    axis: Vector
    """Axis of the joint in the frame of the link: a unit vector."""
    joint: int | None
    """Index of the joint; None for a link that is fixed to its parent."""
    moved_by: int
    """Number of joints between the base and this link."""
    visual: tuple[Shape, ...]
    collision: tuple[Shape, ...]

    def pose_at(self, joints: Sequence[float]) -> Transform:
        """Return the pose in the parent at joint positions (rad)."""
        if self.joint is None:
            return self.pose
        half, (x, y, z) = 0.5 * joints[self.joint], self.axis
        turn = rotation_from_quaternion((sin(half) * x, sin(half) * y, sin(half) * z, cos(half)))
        return Transform(multiply(self.pose.rotation, turn), self.pose.translation)


class Model:
    """Pinocchio's model of a URDF, checked: a chain of revolute joints with a flange on the last one.

    Joint positions are rad, base first; poses are in the base, in m. Non-finite joint positions give
    non-finite results. Equal robots share a model, see `arm_model`.
    """

    def __init__(self, description: RobotDescription) -> None:
        """Raises `RobotFault` if the URDF is unreadable or does not match the description."""
        self.description = d = description
        try:
            self._text = _without_meshes(checked_urdf(d.urdf_path, d.urdf))
            self.pin_model = pin.buildModelFromXML(self._text)
        except (ValueError, RuntimeError, RecursionError) as fault:
            raise RobotFault(d.urdf_path, "", "", f"a URDF that Pinocchio can read ({fault})") from None
        self._check_joints()
        self.flange_index = self._find_flange()
        """Index of the flange among the frames of the model."""
        for link, _ in d.capsules_mm:
            if not self.pin_model.existBodyName(link):
                raise RobotFault(d.settings_path, "capsules_mm", repr(link), f"a link of {d.urdf_path}")
        self.joint_count = len(d.joints)
        self.data = data = self.pin_model.createData()
        """Results of Pinocchio, shared by equal robots: each reads them before the next call."""
        pin.computeJointJacobians(self.pin_model, data, np.zeros(self.joint_count))
        numbers = range(1, self.joint_count + 1)
        world, local = pin.ReferenceFrame.WORLD, pin.ReferenceFrame.LOCAL
        self.axes = np.array([self._axis(data, number, world) for number in numbers])
        """Directions (n, 3) of the joint axes in the base with all joints at zero."""
        self.points = np.array([data.oMi[number].translation for number in numbers])
        """Points (n, 3) on these axes (m)."""
        self.local_axes = [self._axis(data, number, local) for number in numbers]
        """Directions of the joint axes in the frames of the joints."""
        self.fixed_poses = self._fixed_poses()
        """The constant poses between joints, in the form of `Tcp`."""
        self.tcp_of_flange = self.tcp(IDENTITY)
        """The flange in the form of a TCP."""

    def flange(self, q: Sequence[float]) -> Transform:
        """Return the pose of the flange."""
        return self.tcp_of_flange.pose(q)

    def tcp(self, tool_in_flange: Transform) -> Tcp:
        """Return the TCP of a tool; equal tools share one."""
        return _tcp(self, tool_in_flange)

    def _axis(self, data: pin.Data, number: int, frame: pin.ReferenceFrame) -> Vector:
        """Direction of the axis of a joint, counted from 1."""
        jacobian = pin.getJointJacobian(self.pin_model, data, number, frame)
        return _vector(jacobian.reshape(6, -1)[3:, number - 1])  # pin returns (6,) for an arm of one joint

    def _fixed_poses(self) -> tuple[Transform, ...]:
        """Return the poses between frames that have the axis of their joint as z."""
        model, poses, before = self.pin_model, [], IDENTITY.rotation
        for number, axis in enumerate(self.local_axes, start=1):
            turned = with_z_along(axis)
            poses.append(_between(before, _transform(model.jointPlacements[number]), turned))
            before = turned
        flange = _transform(model.frames[self.flange_index].placement)
        return (*poses, _between(before, flange, IDENTITY.rotation))

    def _check_joints(self) -> None:
        d, model = self.description, self.pin_model
        found = tuple(model.names)[1:]
        if found != d.joints:
            movable = f"the movable joints of {d.urdf_path} from the base on, {list(found)}"
            raise RobotFault(d.settings_path, "joints", list(d.joints), movable)
        for number, name in enumerate(found, start=1):
            parent = model.parents[number]
            if parent != number - 1:
                moved, wanted = (f"a link that {model.names[each]} moves" for each in (parent, number - 1))
                raise RobotFault(d.urdf_path, f"joint {name}: parent", moved, wanted)

    def _find_flange(self) -> int:
        d, model = self.description, self.pin_model
        if not model.existBodyName(d.flange):  # getFrameId returns an index past the end for an unknown name
            raise RobotFault(d.settings_path, "flange", repr(d.flange), f"a link of {d.urdf_path}")
        index: int = model.getFrameId(d.flange, pin.FrameType.BODY)
        if model.frames[index].parentJoint != model.njoints - 1:
            last = f"a link fixed to the last joint, {d.joints[-1]}"
            raise RobotFault(d.settings_path, "flange", repr(d.flange), last)
        return index

    @cached_property
    def links(self) -> tuple[Link, ...]:
        """Return the links, each after its parent."""
        model = self.pin_model
        frames = list(model.frames)
        bodies = [index for index, frame in enumerate(frames) if frame.type == pin.FrameType.BODY]
        places = {index: place for place, index in enumerate(bodies)}
        visual, collision = self._shapes(pin.VISUAL), self._shapes(pin.COLLISION)
        links = []
        for index in bodies:
            frame = frames[index]
            above = frame.parentFrame
            while above not in places and above:
                above = frames[above].parentFrame
            moved_by = frame.parentJoint
            pose, joint = frame.placement, None
            if frames[above].parentJoint != moved_by:
                joint = moved_by - 1
                pose = model.jointPlacements[moved_by] * pose
            pose = frames[above].placement.actInv(pose)
            axis = self.local_axes[moved_by - 1] if moved_by else (0.0, 0.0, 1.0)
            links.append(
                Link(
                    frame.name,
                    places.get(above),
                    _transform(pose),
                    axis,
                    joint,
                    moved_by,
                    tuple(visual.get(index, ())),
                    tuple(collision.get(index, ())),
                )
            )
        return tuple(links)

    def _shapes(self, kind: pin.GeometryType) -> dict[int, list[Shape]]:
        """Return the shapes of all links, by the index of the link's frame; meshes are left out."""
        found: dict[int, list[Shape]] = {}
        for each in pin.buildGeomFromUrdfString(self.pin_model, self._text, kind).geometryObjects:
            frame = self.pin_model.frames[each.parentFrame]
            name, size = _measured(each.geometry)
            colour = tuple(round(part, 6) for part in each.meshColor.tolist())
            pose = _transform(frame.placement.actInv(each.placement))
            shape = Shape(name, size, pose, colour if each.overrideMaterial else GREY)
            found.setdefault(each.parentFrame, []).append(shape)
        return found


@lru_cache(maxsize=8)
def arm_model(description: RobotDescription) -> Model:
    """Return the model of a description; equal robots share it. Raises `RobotFault`."""
    return Model(description)


@lru_cache(maxsize=64)
def _tcp(model: Model, tool_in_flange: Transform) -> Tcp:
    return Tcp(model.fixed_poses, tool_in_flange)


def _without_meshes(robot: ET.Element) -> str:
    """Return the text for Pinocchio, which would open the files of meshes."""
    for link in robot.findall("link"):
        for body in [*link.findall("collision"), *link.findall("visual")]:
            if body.find("geometry/mesh") is not None:
                link.remove(body)
    return ET.tostring(robot, encoding="unicode")


def _measured(geometry: object) -> tuple[str, tuple[float, ...]]:
    """Kind and sizes of a shape."""
    if isinstance(geometry, coal.Box):
        return "box", tuple((2.0 * geometry.halfSide).tolist())
    if isinstance(geometry, coal.Sphere):
        return "sphere", (geometry.radius,)
    assert isinstance(geometry, coal.Cylinder)
    return "cylinder", (geometry.radius, 2.0 * geometry.halfLength)


def _vector(values: NDArray[np.float64]) -> Vector:
    x, y, z = values.tolist()
    return (x, y, z)


def _transform(pose: pin.SE3) -> Transform:
    (a, b, c), (d, e, f), (g, h, i) = pose.rotation.tolist()
    return Transform((a, b, c, d, e, f, g, h, i), _vector(pose.translation))


def _between(before: Rotation, pose: Transform, after: Rotation) -> Transform:
    """Return a pose between two rotated frames: `before` rotates the outer one, `after` the inner one."""
    return compose(Transform(transpose(before), _ORIGIN), compose(pose, Transform(after, _ORIGIN)))

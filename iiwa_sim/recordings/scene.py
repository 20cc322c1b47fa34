"""What a viewer needs to show the arm and its cell: frames and shapes, in Foxglove's messages."""

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from math import cos, sin

from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.carrying import Tool
from iiwa_sim.controller.handling import PartState
from iiwa_sim.frames import IDENTITY, Frame, Quaternion, Transform, Vector, compose
from iiwa_sim.recordings.foxglove import (
    DELETES_ALL,
    Message,
    add_shape,
    entity,
    rounded_quaternion,
    stamp,
    transform,
)
from iiwa_sim.recordings.urdf_links import GREY, colour_of, joint_of, shape_of
from iiwa_sim.robot.capsules import TOOL, Capsule
from iiwa_sim.robot.urdf_joints import joints_in, origin_of
from iiwa_sim.world.part import Part

TCP = "tcp"
GOAL = "goal"
JAWS = {"jaw_1": 1.0, "jaw_2": -1.0}
"""Frames of the jaws of a gripper, and to which side of the TCP they open."""

_PLANE_M = (3.0, 3.0, 0.002)  # of the slab that a plane, which has no end, is drawn as
_SURFACE = (0.35, 0.55, 0.75, 0.55)
_TIP = (0.9, 0.3, 0.1, 0.8)
_PART = (0.85, 0.6, 0.25, 1.0)
_JAW = (0.28, 0.28, 0.3, 1.0)
_TOOL = (0.45, 0.46, 0.48, 1.0)


class Arm:
    """The links of a URDF, which has been checked (`iiwa_sim.robot.urdf`)."""

    def __init__(self, urdf: str, joints: Sequence[str], flange: str = "", tool: Tool | None = None) -> None:
        """`joints` are the names of the robot's joints, base first; `tool` is fixed to the link `flange`."""
        robot = ET.fromstring(urdf)
        self._joints = [joint_of(joint, joints) for joint in joints_in(robot)]
        children = {joint.child for joint in self._joints}
        self._colors = {
            material.get("name", ""): colour_of(material) for material in robot.findall("material")
        }
        self._links = robot.findall("link")
        self._flange, self._tool = flange, () if tool is None else tool.capsules
        self.base = next(name for link in self._links if (name := link.get("name", "")) not in children)
        """The frame of the base, in which the robot's own frames are told."""

    def frames(
        self,
        ns: int,
        q: Sequence[float],
        tcp: Frame,
        goal: Frame,
        opening_mm: float | None = None,
        parts: Iterable[PartState] = (),
    ) -> Message:
        """A foxglove.FrameTransforms: all links at joint positions (rad), TCP, goal and parts in the base,
        and the jaws of a gripper, if there is one, along y of the TCP."""
        time = stamp(ns)
        transforms = []
        for joint in self._joints:
            turned = (
                joint.rotation if joint.place is None else _turned(joint.rotation, joint.axis, q[joint.place])
            )
            transforms.append(
                {
                    "timestamp": time,
                    "parent_frame_id": joint.parent,
                    "child_frame_id": joint.child,
                    "translation": joint.translation,
                    "rotation": rounded_quaternion(turned),
                }
            )
        bodies = [(part_frame(part.name), part.frame) for part in parts]
        for name, frame in ((TCP, tcp), (GOAL, goal), *bodies):
            transforms.append(transform(time, self.base, name, frame.to_transform()))
        if opening_mm is not None:
            for name, side in JAWS.items():
                away = Transform(IDENTITY.rotation, (0.0, side * 5e-4 * opening_mm, 0.0))
                transforms.append(transform(time, TCP, name, away))
        return {"transforms": transforms}

    def scene(
        self,
        ns: int,
        surfaces: Iterable[Surface],
        contact_radius_m: float,
        jaw_m: Sequence[float] = (),
        parts: Iterable[Part] = (),
    ) -> Message:
        """A foxglove.SceneUpdate in place of all before it: arm, tool, cell, sphere at the TCP, jaws, parts.

        `jaw_m` is the size of each jaw along x y z of the TCP; empty without a gripper.
        """
        entities = [self._link(ns, link) for link in self._links if link.find("visual") is not None]
        if self._tool:
            entities.append(_tool(ns, self._flange, self._tool))
        entities += [_surface(ns, self.base, surface) for surface in surfaces]
        if contact_radius_m > 0.0:
            tip = entity(ns, TCP, TCP)
            add_shape(tip, Sphere(contact_radius_m), IDENTITY, _TIP)
            entities.append(tip)
        for name, side in JAWS.items() if jaw_m else ():
            x, y, z = jaw_m
            jaw = entity(ns, name, name)
            place = Transform(IDENTITY.rotation, (0.0, side * 0.5 * y, -0.5 * z))
            add_shape(jaw, Box(0.5 * x, 0.5 * y, 0.5 * z), place, _JAW)
            entities.append(jaw)
        for part in parts:
            frame = part_frame(part.name)
            body = entity(ns, frame, frame)
            add_shape(body, part.shape, IDENTITY, _PART)
            entities.append(body)
        return {"deletions": [{"timestamp": stamp(ns), "type": DELETES_ALL, "id": ""}], "entities": entities}

    def _link(self, ns: int, link: ET.Element) -> Message:
        """What is a box, a cylinder or a sphere of a link; meshes are left out."""
        name = link.get("name", "")
        body = entity(ns, name, name)
        for visual in link.findall("visual"):
            shape = shape_of(visual.find("geometry"))
            if shape is not None:
                add_shape(body, shape, origin_of(visual), self._color_of(visual))
        return body

    def _color_of(self, visual: ET.Element) -> tuple[float, ...]:
        material = visual.find("material")
        if material is None:
            return GREY
        return (
            colour_of(material)
            if material.find("color") is not None
            else self._colors.get(material.get("name", ""), GREY)
        )


def part_frame(name: str) -> str:
    """The frame in the middle of a part."""
    return f"part {name}"


def _tool(ns: int, flange: str, capsules: Sequence[Capsule]) -> Message:
    body = entity(ns, flange, TOOL)
    for each in capsules:
        if each.length_m > 0.0:
            add_shape(body, Cylinder(each.radius_m, 0.5 * each.length_m), each.pose, _TOOL)
        for end in dict.fromkeys((each.start, each.end)):
            add_shape(body, Sphere(each.radius_m), Transform(IDENTITY.rotation, end), _TOOL)
    return body


def _surface(ns: int, base: str, surface: Surface) -> Message:
    body = entity(ns, base, f"surface {surface.name}")
    shape, pose = surface.shape, surface.pose
    if isinstance(shape, Plane):
        x, y, z = _PLANE_M
        shape = Box(0.5 * x, 0.5 * y, 0.5 * z)
        pose = compose(pose, Transform(IDENTITY.rotation, (0.0, 0.0, -0.5 * z)))
    add_shape(body, shape, pose, _SURFACE)
    return body


def _turned(quaternion: Quaternion, axis: Vector, angle: float) -> Quaternion:
    """A rotation, and then a turn about an axis in its inner frame, with w >= 0."""
    x, y, z, w = quaternion
    sine, c = sin(0.5 * angle), cos(0.5 * angle)
    a, b, d = sine * axis[0], sine * axis[1], sine * axis[2]
    found = (
        w * a + x * c + y * d - z * b,
        w * b - x * d + y * c + z * a,
        w * d + x * b - y * a + z * c,
        w * c - x * a - y * b - z * d,
    )
    return found if found[3] >= 0.0 else (-found[0], -found[1], -found[2], -found[3])

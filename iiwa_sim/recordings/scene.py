"""What a viewer needs to show the arm and its cell: frames and shapes, in Foxglove's messages."""

from collections.abc import Iterable, Mapping, Sequence

from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.carrying import Tool
from iiwa_sim.controller.handling import PartState
from iiwa_sim.frames import IDENTITY, Frame, Transform, compose
from iiwa_sim.recordings.foxglove import (
    DELETES_ALL,
    Message,
    add_model,
    add_shape,
    entity,
    stamp,
    transform,
)
from iiwa_sim.robot.capsules import TOOL, Capsule
from iiwa_sim.robot.meshes import LinkMesh
from iiwa_sim.robot.model import Link, Shape
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
    """The links of a robot, and its tool."""

    def __init__(self, links: Sequence[Link], flange: str = "", tool: Tool | None = None) -> None:
        """`links` are those of the robot's model; `tool` is fixed to the link `flange`."""
        self._links = links
        self._joints = [(links[link.parent].name, link) for link in links if link.parent is not None]
        self._flange, self._tool = flange, () if tool is None else tool.capsules
        self.base = links[0].name
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
        transforms = [transform(time, parent, link.name, link.pose_at(q)) for parent, link in self._joints]
        bodies = [(part_frame(part.name), part.frame) for part in parts]
        for name, frame in ((TCP, tcp), (GOAL, goal), *bodies):
            transforms.append(transform(time, self.base, name, frame.to_transform()))
        if opening_mm is not None:
            for name, side in JAWS.items():
                away = Transform(IDENTITY.rotation, (0.0, side * 5e-4 * opening_mm, 0.0))
                transforms.append(transform(time, TCP, name, away))
        return {"transforms": transforms}

    def model(self, ns: int, meshes: Mapping[str, Sequence[LinkMesh]]) -> Message:
        """Return a foxglove.SceneUpdate of the links: `meshes` by the names of links, else simple shapes."""
        entities = [_link(ns, link, meshes.get(link.name, ())) for link in self._links]
        return {"deletions": [], "entities": entities}

    def scene(
        self,
        ns: int,
        surfaces: Iterable[Surface],
        contact_radius_m: float,
        jaw_m: Sequence[float] = (),
        parts: Iterable[Part] = (),
    ) -> Message:
        """A foxglove.SceneUpdate in place of all before it: tool, cell, sphere at the TCP, jaws, parts.

        `jaw_m` is the size of each jaw along x y z of the TCP; empty without a gripper.
        """
        entities = [_tool(ns, self._flange, self._tool)] if self._tool else []
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


def part_frame(name: str) -> str:
    """The frame in the middle of a part."""
    return f"part {name}"


def _link(ns: int, link: Link, meshes: Sequence[LinkMesh]) -> Message:
    body = entity(ns, link.name, link.name)
    for mesh in meshes:
        add_model(body, mesh)
    for shape in () if meshes else link.visual:
        add_shape(body, _solid(shape), shape.pose, shape.colour)
    return body


def _solid(shape: Shape) -> Box | Cylinder | Sphere:
    match shape.kind:
        case "box":
            x, y, z = shape.size_m
            return Box(0.5 * x, 0.5 * y, 0.5 * z)
        case "sphere":
            return Sphere(shape.size_m[0])
    radius, length = shape.size_m
    return Cylinder(radius, 0.5 * length)


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

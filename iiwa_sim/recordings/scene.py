"""What a viewer needs to show the arm and its cell: frames and shapes, in Foxglove's messages."""

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from math import cos, floor, sin
from typing import Any, NamedTuple

from iiwa_sim.backdoor.described import DescribedMove
from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.handling import PartState
from iiwa_sim.frames import (
    IDENTITY,
    Frame,
    Quaternion,
    Transform,
    Vector,
    compose,
    quaternion_from_rotation,
    transform_from_euler,
)
from iiwa_sim.handling.gripper import JAW_M
from iiwa_sim.handling.part import Part

STEPS = 1e7
"""Per unit of lengths (m) and quaternions: of 0.1 um. More would only make files larger."""
TCP = "tcp"
GOAL = "goal"
JAWS = {"jaw_1": 1.0, "jaw_2": -1.0}
"""Frames of the jaws of a gripper, and to which side of the TCP they open."""
DELETES_ALL = 1
"""The type of a foxglove.SceneEntityDeletion."""

_PLANE_M = (3.0, 3.0, 0.002)  # of the slab that a plane, which has no end, is drawn as
_GREY = (0.8, 0.8, 0.8, 1.0)
_SURFACE = (0.35, 0.55, 0.75, 0.55)
_TIP = (0.9, 0.3, 0.1, 0.8)
_PART = (0.85, 0.6, 0.25, 1.0)
_JAW = (0.28, 0.28, 0.3, 1.0)
_TARGET = (0.3, 0.5, 0.9, 0.9)
_BLENDING = (0.3, 0.5, 0.9, 0.2)
_TARGET_M = 0.008

Message = dict[str, Any]


class _Joint(NamedTuple):
    parent: str
    child: str
    translation: Message
    """From the parent (m)."""
    rotation: Quaternion
    """In the parent, with the joint at zero."""
    axis: Vector
    place: int | None
    """Among the robot's joints; None for a fixed one."""


def stamp(ns: int) -> Message:
    """A time of Foxglove's, from nanoseconds."""
    sec, nsec = divmod(ns, 1_000_000_000)
    return {"sec": sec, "nsec": nsec}


class Arm:
    """The links of a URDF, which has been checked (`iiwa_sim.robot.urdf`)."""

    def __init__(self, urdf: str, joints: Sequence[str]) -> None:
        """`joints` are the names of the robot's joints, base first."""
        robot = ET.fromstring(urdf)
        self._joints = [_joint(joint, joints) for joint in robot.findall("joint")]
        children = {joint.child for joint in self._joints}
        self._colors = {material.get("name", ""): _color(material) for material in robot.findall("material")}
        self._links = robot.findall("link")
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
                    "rotation": _rounded_quaternion(turned),
                }
            )
        bodies = [(part_frame(part.name), part.frame) for part in parts]
        for name, frame in ((TCP, tcp), (GOAL, goal), *bodies):
            transforms.append(_transform(time, self.base, name, frame.to_transform()))
        if opening_mm is not None:
            for name, side in JAWS.items():
                away = Transform(IDENTITY.rotation, (0.0, side * 5e-4 * opening_mm, 0.0))
                transforms.append(_transform(time, TCP, name, away))
        return {"transforms": transforms}

    def scene(
        self,
        ns: int,
        surfaces: Iterable[Surface],
        contact_radius_m: float,
        jaws: bool = False,
        parts: Iterable[Part] = (),
    ) -> Message:
        """A foxglove.SceneUpdate in place of all before it: arm, cell, sphere round the TCP, jaws, parts."""
        entities = [self._link(ns, link) for link in self._links if link.find("visual") is not None]
        entities += [_surface(ns, self.base, surface) for surface in surfaces]
        if contact_radius_m > 0.0:
            tip = _entity(ns, TCP, TCP)
            _add(tip, Sphere(contact_radius_m), IDENTITY, _TIP)
            entities.append(tip)
        for name, side in JAWS.items() if jaws else ():
            x, y, z = JAW_M
            jaw = _entity(ns, name, name)
            place = Transform(IDENTITY.rotation, (0.0, side * 0.5 * y, -0.5 * z))
            _add(jaw, Box(0.5 * x, 0.5 * y, 0.5 * z), place, _JAW)
            entities.append(jaw)
        for part in parts:
            frame = part_frame(part.name)
            body = _entity(ns, frame, frame)
            _add(body, part.shape, IDENTITY, _PART)
            entities.append(body)
        return {"deletions": [{"timestamp": stamp(ns), "type": DELETES_ALL, "id": ""}], "entities": entities}

    def targets(self, ns: int, moves: Iterable[DescribedMove]) -> Message:
        """A foxglove.SceneUpdate in place of all before it on its topic: where moves end, and the spheres in
        which they may be left."""
        entities = []
        for move in moves:
            entity, pose = _entity(ns, self.base, f"move {move.number}"), move.goal_frame.to_transform()
            _add(entity, Sphere(_TARGET_M), pose, _TARGET)
            if move.blending_mm > 0.0:
                _add(entity, Sphere(1e-3 * move.blending_mm), pose, _BLENDING)
            entities.append(entity)
        return {"deletions": [{"timestamp": stamp(ns), "type": DELETES_ALL, "id": ""}], "entities": entities}

    def _link(self, ns: int, link: ET.Element) -> Message:
        """What is a box, a cylinder or a sphere of a link; meshes are left out."""
        name = link.get("name", "")
        entity = _entity(ns, name, name)
        for visual in link.findall("visual"):
            shape = _shape(visual.find("geometry"))
            if shape is not None:
                _add(entity, shape, _origin(visual), self._color_of(visual))
        return entity

    def _color_of(self, visual: ET.Element) -> tuple[float, ...]:
        material = visual.find("material")
        if material is None:
            return _GREY
        return (
            _color(material)
            if material.find("color") is not None
            else self._colors.get(material.get("name", ""), _GREY)
        )


def part_frame(name: str) -> str:
    """The frame in the middle of a part."""
    return f"part {name}"


def _joint(joint: ET.Element, names: Sequence[str]) -> _Joint:
    def link(which: str) -> str:
        found = joint.find(which)
        return "" if found is None else found.get("link", "")

    axis = joint.find("axis")
    x, y, z = _numbers("1 0 0" if axis is None else axis.get("xyz", "1 0 0"))  # as URDF has it
    length = (x * x + y * y + z * z) ** 0.5
    name = joint.get("name", "")
    place = names.index(name) if name in names else None
    origin = _origin(joint)
    return _Joint(
        link("parent"),
        link("child"),
        _rounded_vector(origin),
        quaternion_from_rotation(origin.rotation),
        (x / length, y / length, z / length),
        place,
    )


def _origin(parent: ET.Element) -> Transform:
    origin = parent.find("origin")
    if origin is None:
        return IDENTITY
    x, y, z = _numbers(origin.get("xyz", "0 0 0"))
    roll, pitch, yaw = _numbers(origin.get("rpy", "0 0 0"))
    return transform_from_euler(x, y, z, yaw, pitch, roll)  # fixed x-y-z is intrinsic z-y-x


def _numbers(text: str) -> list[float]:
    return [float(word) for word in text.split()]


def _color(material: ET.Element) -> tuple[float, ...]:
    color = material.find("color")
    found = [] if color is None else _numbers(color.get("rgba", ""))
    return tuple(found) if len(found) == len(_GREY) else _GREY


def _shape(geometry: ET.Element | None) -> Box | Cylinder | Sphere | None:
    for shape in [] if geometry is None else geometry:
        match shape.tag:
            case "box":
                x, y, z = _numbers(shape.get("size", "0 0 0"))
                return Box(0.5 * x, 0.5 * y, 0.5 * z)
            case "cylinder":
                return Cylinder(float(shape.get("radius", "0")), 0.5 * float(shape.get("length", "0")))
            case "sphere":
                return Sphere(float(shape.get("radius", "0")))
    return None


def _surface(ns: int, base: str, surface: Surface) -> Message:
    entity = _entity(ns, base, f"surface {surface.name}")
    shape, pose = surface.shape, surface.pose
    if isinstance(shape, Plane):
        x, y, z = _PLANE_M
        shape = Box(0.5 * x, 0.5 * y, 0.5 * z)
        pose = compose(pose, Transform(IDENTITY.rotation, (0.0, 0.0, -0.5 * z)))
    _add(entity, shape, pose, _SURFACE)
    return entity


def _entity(ns: int, frame: str, name: str) -> Message:
    empty: dict[str, list[Message]] = {
        kind: []
        for kind in (
            "metadata", "arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models"
        )
    }  # fmt: skip
    return {
        "timestamp": stamp(ns),
        "frame_id": frame,
        "id": name,
        "lifetime": {"sec": 0, "nsec": 0},  # for ever
        "frame_locked": True,  # it goes where its frame goes
        **empty,
    }


def _add(entity: Message, shape: Box | Cylinder | Sphere, pose: Transform, color: Sequence[float]) -> None:
    common = {"pose": _pose(pose), "color": dict(zip("rgba", color, strict=True))}
    match shape:
        case Box(x, y, z):
            entity["cubes"].append({**common, "size": _vector((2.0 * x, 2.0 * y, 2.0 * z))})
        case Sphere(r):
            entity["spheres"].append({**common, "size": _vector((2.0 * r, 2.0 * r, 2.0 * r))})
        case Cylinder(r, z):
            size = _vector((2.0 * r, 2.0 * r, 2.0 * z))
            entity["cylinders"].append({**common, "size": size, "bottom_scale": 1.0, "top_scale": 1.0})


def _transform(time: Message, parent: str, child: str, pose: Transform) -> Message:
    return {
        "timestamp": time,
        "parent_frame_id": parent,
        "child_frame_id": child,
        "translation": _rounded_vector(pose),
        "rotation": _quaternion(pose),
    }


def _pose(pose: Transform) -> Message:
    return {"position": _vector(pose.translation), "orientation": _quaternion(pose)}


def _vector(values: Sequence[float]) -> Message:
    return dict(zip("xyz", values, strict=True))


def _rounded_vector(pose: Transform) -> Message:
    return _vector([floor(value * STEPS + 0.5) / STEPS for value in pose.translation])


def _quaternion(pose: Transform) -> Message:
    return _rounded_quaternion(quaternion_from_rotation(pose.rotation))


def _rounded_quaternion(quaternion: Quaternion) -> Message:
    x, y, z, w = [floor(value * STEPS + 0.5) / STEPS for value in quaternion]  # a third of what `round` takes
    return {"x": x, "y": y, "z": z, "w": w}


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

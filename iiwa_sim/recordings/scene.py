"""The arm and its cell in Foxglove's messages: frames, shapes and models."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import floor
from typing import TYPE_CHECKING, Any

from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.carrying import Tool
from iiwa_sim.controller.handling import BodyState, PartState
from iiwa_sim.frames import IDENTITY, Frame, Transform, compose, quaternion_from_rotation
from iiwa_sim.robot.capsules import TOOL, Capsule
from iiwa_sim.robot.meshes import LinkMesh
from iiwa_sim.robot.model import Link, Shape
from iiwa_sim.world.part import Mesh, Part

if TYPE_CHECKING:
    from iiwa_sim.world.scene import SceneBody

TCP = "tcp"
GOAL = "goal"
WORLD = "world"
"""The frame in which the bases of several robots are."""
JAWS = {"jaw_1": 1.0, "jaw_2": -1.0}
"""Frames of the jaws of a gripper, and to which side of the TCP they open."""

_PLANE_M = (3.0, 3.0, 0.002)  # of the slab that a plane, which has no end, is drawn as
_SURFACE = (0.35, 0.55, 0.75, 0.55)
_TIP = (0.9, 0.3, 0.1, 0.8)
_PART = (0.85, 0.6, 0.25, 1.0)
_JAW = (0.28, 0.28, 0.3, 1.0)
_TOOL = (0.45, 0.46, 0.48, 1.0)
STEPS = 1e7
"""Per unit of lengths (m) and quaternions: of 0.1 um. More would only make files larger."""
DELETES_ALL = 1
"""The type of a foxglove.SceneEntityDeletion."""

Message = dict[str, Any]
Placed = tuple[Box | Cylinder | Plane | Sphere | Mesh, Transform, Sequence[float]]
"""A shape, its pose in a frame (m), and its colour."""

_MODELS = {
    ".glb": "model/gltf-binary",
    ".stl": "model/stl",
    ".obj": "model/obj",
    ".dae": "model/vnd.collada+xml",
}


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
        scene: Iterable[BodyState] = (),
    ) -> Message:
        """A foxglove.FrameTransforms: all links at joint positions (rad), TCP, goal, parts and bodies of the
        scene in the base, and the jaws of a gripper, if there is one, along y of the TCP."""
        time = stamp(ns)
        transforms = [transform(time, parent, link.name, link.pose_at(q)) for parent, link in self._joints]
        bodies = [(part_frame(part.name), part.frame) for part in parts]
        bodies += [(body_frame(body.name), body.frame) for body in scene]
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
        bodies: Iterable[SceneBody] = (),
    ) -> Message:
        """A foxglove.SceneUpdate in place of all before it: tool, cell, TCP's sphere, jaws, parts, bodies.

        `jaw_m` is the size of each jaw along x y z of the TCP; empty without a gripper.
        """
        entities = [entity(ns, self._flange, TOOL, _tool(self._tool))] if self._tool else []
        entities += [entity(ns, self.base, f"surface {each.name}", [_surface(each)]) for each in surfaces]
        if contact_radius_m > 0.0:
            entities.append(entity(ns, TCP, TCP, [(Sphere(contact_radius_m), IDENTITY, _TIP)]))
        for name, side in JAWS.items() if jaw_m else ():
            x, y, z = jaw_m
            place = Transform(IDENTITY.rotation, (0.0, side * 0.5 * y, -0.5 * z))
            entities.append(entity(ns, name, name, [(Box(0.5 * x, 0.5 * y, 0.5 * z), place, _JAW)]))
        own = [(part_frame(part.name), [(part.shape, IDENTITY, _PART)]) for part in parts]
        own += [(body_frame(body.name), list(body.shapes)) for body in bodies]
        entities += [entity(ns, frame, frame, shapes) for frame, shapes in own]
        return {"deletions": [{"timestamp": stamp(ns), "type": DELETES_ALL, "id": ""}], "entities": entities}


def in_namespace(name: str, message: Message) -> Message:
    """Put the frames of a message, and its entities, in the namespace of one of several robots."""
    keys = ("frame_id", "parent_frame_id", "child_frame_id", "id")
    for each in (message, *message.get("transforms", ()), *message.get("entities", ())):
        each.update({key: f"{name}/{each[key]}" for key in keys if each.get(key, WORLD) != WORLD})
    return message


def part_frame(name: str) -> str:
    """The frame in the middle of a part."""
    return f"part {name}"


def body_frame(name: str) -> str:
    """The frame of a body of the scene."""
    return f"body {name}"


def _link(ns: int, link: Link, meshes: Sequence[LinkMesh]) -> Message:
    shapes = () if meshes else [(_solid(each), each.pose, each.colour) for each in link.visual]
    body = entity(ns, link.name, link.name, shapes)
    for mesh in meshes:
        add_model(body, mesh)
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


def _tool(capsules: Sequence[Capsule]) -> Iterator[Placed]:
    for each in capsules:
        if each.length_m > 0.0:
            yield Cylinder(each.radius_m, 0.5 * each.length_m), each.pose, _TOOL
        for end in dict.fromkeys((each.start, each.end)):
            yield Sphere(each.radius_m), Transform(IDENTITY.rotation, end), _TOOL


def _surface(surface: Surface) -> Placed:
    if not isinstance(surface.shape, Plane):
        return surface.shape, surface.pose, _SURFACE
    x, y, z = (0.5 * each for each in _PLANE_M)
    return Box(x, y, z), compose(surface.pose, Transform(IDENTITY.rotation, (0.0, 0.0, -z))), _SURFACE


def stamp(ns: int) -> Message:
    """A time of Foxglove's, from nanoseconds."""
    sec, nsec = divmod(ns, 1_000_000_000)
    return {"sec": sec, "nsec": nsec}


def entity(ns: int, frame: str, name: str, shapes: Iterable[Placed] = ()) -> Message:
    """A foxglove.SceneEntity, which goes where its frame goes."""
    kinds = ("metadata", "arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models")
    body: Message = {
        "timestamp": stamp(ns),
        "frame_id": frame,
        "id": name,
        "lifetime": {"sec": 0, "nsec": 0},  # for ever
        "frame_locked": True,
        **{kind: [] for kind in kinds},
    }
    for shape, pose, color in shapes:
        common = {"pose": _pose(pose), "color": dict(zip("rgba", color, strict=True))}
        match shape:
            case Box(x, y, z):
                body["cubes"].append({**common, "size": _vector((2.0 * x, 2.0 * y, 2.0 * z))})
            case Sphere(r):
                body["spheres"].append({**common, "size": _vector((2.0 * r, 2.0 * r, 2.0 * r))})
            case Cylinder(r, z):
                size = _vector((2.0 * r, 2.0 * r, 2.0 * z))
                body["cylinders"].append({**common, "size": size, "bottom_scale": 1.0, "top_scale": 1.0})
            case Mesh(corners):
                points = [_vector(corner) for corner in corners]
                body["triangles"].append({**common, "points": points, "colors": [], "indices": []})
    return body


def add_model(into: Message, mesh: LinkMesh) -> None:
    """Put the file of a mesh into an entity, if its kind is one that Foxglove shows."""
    if (kind := _MODELS.get(mesh.path.suffix.lower())) is not None:
        model = {
            "pose": _pose(mesh.pose),
            "scale": _vector(mesh.scale),
            "color": dict(zip("rgba", mesh.colour or (1.0, 1.0, 1.0, 1.0), strict=True)),
            "override_color": mesh.colour is not None,
            "url": "",
            "media_type": kind,
            "data": b64encode(mesh.path.read_bytes()).decode(),
        }
        into["models"].append(model)


def transform(time: Message, parent: str, child: str, pose: Transform) -> Message:
    """A foxglove.FrameTransform: the frame `child` in the frame `parent`."""
    return {
        "timestamp": time,
        "parent_frame_id": parent,
        "child_frame_id": child,
        "translation": _vector([floor(value * STEPS + 0.5) / STEPS for value in pose.translation]),
        "rotation": _quaternion(pose),
    }


def _pose(pose: Transform) -> Message:
    return {"position": _vector(pose.translation), "orientation": _quaternion(pose)}


def _vector(values: Sequence[float]) -> Message:
    return dict(zip("xyz", values, strict=True))


def _quaternion(pose: Transform) -> Message:
    # floor takes a third of the time of round
    x, y, z, w = [floor(value * STEPS + 0.5) / STEPS for value in quaternion_from_rotation(pose.rotation)]
    return {"x": x, "y": y, "z": z, "w": w}

"""The arm and its cell in Foxglove's messages: frames, shapes and models."""

from base64 import b64encode
from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import floor
from typing import Any

from iiwa_sim.controller.state import Snapshot
from iiwa_sim.frames import IDENTITY, Frame, Transform, compose, quaternion_from_rotation
from iiwa_sim.robot.capsules import TOOL, Capsule
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.meshes import LinkMesh, link_meshes
from iiwa_sim.robot.model import Link, Shape, arm_model

TCP = "tcp"
GOAL = "goal"
WORLD = "world"
"""The frame in which the bases of several robots are."""
JAWS = {"jaw_1": 1.0, "jaw_2": -1.0}
"""Frames of the jaws of a gripper, and to which side of the TCP they open."""
STEPS = 1e7
"""Per unit of lengths (m) and quaternions: of 0.1 um. More would only make files larger."""
DELETES_ALL = 1
"""The type of a foxglove.SceneEntityDeletion."""
_PLANE_MM = (3000.0, 3000.0, 2.0)  # of the slab that a plane, which has no end, is drawn as
_SURFACE, _TIP, _PART = (0.35, 0.55, 0.75, 0.55), (0.9, 0.3, 0.1, 0.8), (0.85, 0.6, 0.25, 1.0)
_JAW, _TOOL = (0.28, 0.28, 0.3, 1.0), (0.45, 0.46, 0.48, 1.0)
_MODELS = {
    ".glb": "model/gltf-binary",
    ".stl": "model/stl",
    ".obj": "model/obj",
    ".dae": "model/vnd.collada+xml",
}
_KINDS = ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models", "metadata")

Message = dict[str, Any]
Body = Mapping[str, Any]
"""A body by keys of a cell.toml: `shape`, its lengths (mm), and perhaps its pose and `colour`."""


class Arm:
    """The links of a robot, and what is fixed to them."""

    def __init__(self, description: RobotDescription) -> None:
        self._description = description
        self._links = links = arm_model(description).links
        self._joints = [(links[link.parent].name, link) for link in links if link.parent is not None]
        self.base = links[0].name
        """The frame of the base, in which the robot's own frames are told."""

    def frames(self, ns: int, state: Snapshot, shows_cell: bool) -> Message:
        """Return a foxglove.FrameTransforms: links, TCP, goal, jaws, parts and bodies of the scene."""
        time, q = stamp(ns), state.joint_position
        transforms = [transform(time, parent, link.name, link.pose_at(q)) for parent, link in self._joints]
        bodies = [(TCP, state.tool_frame), (GOAL, state.goal_frame)]
        if shows_cell:
            bodies += [(f"part {part.name}", part.frame) for part in state.parts]
            bodies += [(f"body {body.name}", body.frame) for body in state.bodies]
        transforms += [transform(time, self.base, name, frame.to_transform()) for name, frame in bodies]
        if state.gripper is not None:
            for name, side in JAWS.items():
                away = Transform(IDENTITY.rotation, (0.0, side * 5e-4 * state.gripper.opening_mm, 0.0))
                transforms.append(transform(time, TCP, name, away))
        return {"transforms": transforms}

    def model(self, ns: int) -> Message:
        """Return a foxglove.SceneUpdate of the links: their meshes, else simple shapes."""
        meshes = link_meshes(self._description.urdf, self._description.urdf_path)
        entities = [_link(ns, link, meshes.get(link.name, ())) for link in self._links]
        return {"deletions": [], "entities": entities}

    def scene(self, ns: int, cell: Mapping[str, Any], shows_cell: bool) -> Message:
        """Return a foxglove.SceneUpdate in place of all before it: tool, jaws, TCP's sphere and the cell."""
        entities = []
        if cell["tool_capsules"]:
            capsules = [
                Capsule.of_mm((*each["start_mm"], *each["end_mm"], each["radius_mm"]))
                for each in cell["tool_capsules"]
            ]
            entities.append(entity(ns, self._description.flange, TOOL, _capsules(capsules)))
        for name, side in JAWS.items() if cell["jaw_mm"] else ():
            middle = Frame(0.0, side * 0.5 * cell["jaw_mm"][1], -0.5 * cell["jaw_mm"][2], 0.0, 0.0, 0.0)
            jaw = {"shape": "box", "size_mm": cell["jaw_mm"], **middle._asdict(), "colour": _JAW}
            entities.append(entity(ns, name, name, [jaw]))
        if not shows_cell:
            cell = {**cell, "surfaces": (), "parts": (), "bodies": ()}
        entities += [
            entity(ns, self.base, f"surface {each['name']}", [each | {"colour": _SURFACE}])
            for each in cell["surfaces"]
        ]
        if cell["surfaces"] and cell["contact_radius_mm"] > 0.0:
            tip = {"shape": "sphere", "radius_mm": cell["contact_radius_mm"], "colour": _TIP}
            entities.append(entity(ns, TCP, TCP, [tip]))
        own: list[tuple[str, Any]] = [
            (f"part {each['name']}", [each | {"colour": _PART}]) for each in cell["parts"]
        ]
        own += [(f"body {each['name']}", each["shapes"]) for each in cell["bodies"]]
        entities += [entity(ns, frame, frame, shapes) for frame, shapes in own]
        return {"deletions": [{"timestamp": stamp(ns), "type": DELETES_ALL, "id": ""}], "entities": entities}


def in_namespace(name: str, message: Message) -> Message:
    """Put the frames of a message, and its entities, in the namespace of one of several robots."""
    keys = ("frame_id", "parent_frame_id", "child_frame_id", "id")
    for each in (message, *message.get("transforms", ()), *message.get("entities", ())):
        each.update({key: f"{name}/{each[key]}" for key in keys if each.get(key, WORLD) != WORLD})
    return message


def stamp(ns: int) -> Message:
    """Return a time of Foxglove's, from nanoseconds."""
    sec, nsec = divmod(ns, 1_000_000_000)
    return {"sec": sec, "nsec": nsec}


def entity(ns: int, frame: str, name: str, shapes: Iterable[Body] = ()) -> Message:
    """Return a foxglove.SceneEntity, which goes where its frame goes."""
    body: Message = {
        "timestamp": stamp(ns),
        "frame_id": frame,
        "id": name,
        "lifetime": {"sec": 0, "nsec": 0},  # for ever
        "frame_locked": True,
        **{kind: [] for kind in _KINDS},
    }
    for each in shapes:
        pose = Frame(*(each[key] for key in Frame._fields)).to_transform() if "x_mm" in each else IDENTITY
        common = {"pose": _pose(pose), "color": dict(zip("rgba", each["colour"], strict=True))}
        match each["shape"]:
            case "plane":
                below = compose(pose, Frame(0.0, 0.0, -0.5 * _PLANE_MM[2], 0.0, 0.0, 0.0).to_transform())
                body["cubes"].append({**common, "pose": _pose(below), "size": _metres(_PLANE_MM)})
            case "box":
                body["cubes"].append({**common, "size": _metres(each["size_mm"])})
            case "sphere":
                body["spheres"].append({**common, "size": _metres([2.0 * each["radius_mm"]] * 3)})
            case "cylinder":
                size = _metres((2.0 * each["radius_mm"], 2.0 * each["radius_mm"], each["length_mm"]))
                body["cylinders"].append({**common, "size": size, "bottom_scale": 1.0, "top_scale": 1.0})
            case "mesh":
                points = list(map(_metres, each["corners_mm"]))
                body["triangles"].append({**common, "points": points, "colors": [], "indices": []})
    return body


def transform(time: Message, parent: str, child: str, pose: Transform) -> Message:
    """Return a foxglove.FrameTransform: the frame `child` in the frame `parent`."""
    return {
        "timestamp": time,
        "parent_frame_id": parent,
        "child_frame_id": child,
        "translation": _vector([floor(value * STEPS + 0.5) / STEPS for value in pose.translation]),
        "rotation": _quaternion(pose),
    }


def _link(ns: int, link: Link, meshes: Sequence[LinkMesh]) -> Message:
    body = entity(ns, link.name, link.name, () if meshes else map(_solid, link.visual))
    for mesh in meshes:
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
            body["models"].append(model)
    return body


def _solid(shape: Shape) -> Body:
    size = [1e3 * each for each in shape.size_m]
    lengths = {"size_mm": size} if shape.kind == "box" else {"radius_mm": size[0], "length_mm": size[-1]}
    return {"shape": shape.kind, "colour": shape.colour, **lengths, **_frame(shape.pose)}


def _capsules(capsules: Iterable[Capsule]) -> Iterator[Body]:
    for each in capsules:
        common = {"colour": _TOOL, "radius_mm": 1e3 * each.radius_m}
        if each.length_m > 0.0:
            yield {**common, **_frame(each.pose), "shape": "cylinder", "length_mm": 1e3 * each.length_m}
        for end in dict.fromkeys((each.start, each.end)):
            yield {**common, **_frame(Transform(IDENTITY.rotation, end)), "shape": "sphere"}


def _frame(pose: Transform) -> Message:
    return Frame.from_transform(pose)._asdict()


def _pose(pose: Transform) -> Message:
    return {"position": _vector(pose.translation), "orientation": _quaternion(pose)}


def _metres(lengths_mm: Iterable[float]) -> Message:
    return _vector([1e-3 * each for each in lengths_mm])


def _vector(values: Sequence[float]) -> Message:
    return dict(zip("xyz", values, strict=True))


def _quaternion(pose: Transform) -> Message:
    # floor takes a third of the time of round
    x, y, z, w = [floor(value * STEPS + 0.5) / STEPS for value in quaternion_from_rotation(pose.rotation)]
    return {"x": x, "y": y, "z": z, "w": w}

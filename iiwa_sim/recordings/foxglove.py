"""Arm and cell in Foxglove's messages: frames, shapes and models."""

from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from iiwa_sim.controller.state import Snapshot
from iiwa_sim.frames import Transform, quaternion_from_rotation
from iiwa_sim.recordings.scene import BASE, FLANGE, JAWS, TCP, Arm, Shape, bodies_of, moving_bodies, pose_of
from iiwa_sim.recordings.schemas import FAULT, Event
from iiwa_sim.robot.meshes import LinkMesh
from iiwa_sim.robot.model import Link

GOAL = "goal"
WORLD = "world"
"""The frame in which the bases of several robots are."""
INFO, WARNING, ERROR = 2, 3, 4
"""Levels of a foxglove.Log."""
_MODELS = {".glb": "model/gltf-binary", ".stl": "model/stl", ".obj": "model/obj"}
_KINDS = ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models", "metadata")

Message = dict[str, Any]


def frames(ns: int, arm: Arm, state: Snapshot, shows_cell: bool, base: Transform | None = None) -> Message:
    """Return a foxglove.FrameTransforms: links, TCP, goal, jaws, parts, bodies, and the base in the world."""
    rows = [] if base is None else [(WORLD, arm.base, base)]
    rows += [
        (arm.links[link.parent].name, link.name, link.pose_at(state.joint_position))
        for link in arm.links
        if link.parent is not None
    ]
    for name, frame in ((TCP, state.tool_frame), (GOAL, state.goal_frame)):
        rows.append((arm.base, name, frame.to_transform()))
    for name, pose, _ in moving_bodies(state):
        if name in JAWS or shows_cell:
            rows.append((TCP if name in JAWS else arm.base, name, pose))
    return {"transforms": [_transform(ns, *row) for row in rows]}


def _transform(ns: int, parent: str, child: str, pose: Transform) -> Message:
    frames = {"timestamp": stamp(ns), "parent_frame_id": parent, "child_frame_id": child}
    return {**frames, "translation": _vector(pose.translation), "rotation": _quaternion(pose)}


def model(ns: int, arm: Arm) -> Message:
    """Return a foxglove.SceneUpdate of the links: their meshes, else simple shapes."""
    return {"deletions": [], "entities": [_link(ns, arm, link) for link in arm.links]}


def scene(ns: int, arm: Arm, cell: Mapping[str, Any], shows_cell: bool) -> Message:
    """Return a foxglove.SceneUpdate in place of all before it."""
    links = {BASE: arm.base, FLANGE: arm.flange}
    entities = [
        entity(ns, links.get(body.frame, body.frame), body.name, body.shapes)
        for body in bodies_of(cell, shows_cell)
    ]
    all_before = {"timestamp": stamp(ns), "type": 1, "id": ""}
    return {"deletions": [all_before], "entities": entities}


def log(ns: int, event: Event) -> Message:
    """Return a foxglove.Log of an event."""
    level = ERROR if event.kind == FAULT else WARNING if event.code else INFO
    text = {"message": str(event), "name": "iiwa-sim", "file": "", "line": 0}
    return {"timestamp": stamp(ns), "level": level, **text}


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


def entity(ns: int, frame: str, name: str, shapes: Iterable[Shape]) -> Message:
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
        common = {"pose": _pose(pose_of(each)), "color": dict(zip("rgba", each["colour"], strict=True))}
        match each["shape"]:
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


def _vector(values: Sequence[float]) -> Message:
    """Return a foxglove.Vector3."""
    return dict(zip("xyz", values, strict=True))


def _link(ns: int, arm: Arm, link: Link) -> Message:
    meshes = arm.meshes.get(link.name, ())
    body = entity(ns, link.name, link.name, () if meshes else arm.shapes(link))
    body["models"] = [_model(mesh) for mesh in meshes if mesh.path.suffix.lower() in _MODELS]
    return body


def _model(mesh: LinkMesh) -> Message:
    """Return a foxglove.ModelPrimitive with the file of a mesh."""
    return {
        "pose": _pose(mesh.pose),
        "scale": _vector(mesh.scale),
        "color": dict(zip("rgba", mesh.colour or (1.0, 1.0, 1.0, 1.0), strict=True)),
        "override_color": mesh.colour is not None,
        "url": "",
        "media_type": _MODELS[mesh.path.suffix.lower()],
        "data": b64encode(mesh.path.read_bytes()).decode(),
    }


def _pose(pose: Transform) -> Message:
    return {"position": _vector(pose.translation), "orientation": _quaternion(pose)}


def _metres(lengths_mm: Iterable[float]) -> Message:
    return _vector([1e-3 * each for each in lengths_mm])


def _quaternion(pose: Transform) -> Message:
    return dict(zip("xyzw", quaternion_from_rotation(pose.rotation), strict=True))

"""Poses, shapes and times in the messages of Foxglove."""

from base64 import b64encode
from collections.abc import Sequence
from math import floor
from typing import Any

from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.frames import Transform, quaternion_from_rotation
from iiwa_sim.robot.meshes import LinkMesh
from iiwa_sim.world.part import Mesh

STEPS = 1e7
"""Per unit of lengths (m) and quaternions: of 0.1 um. More would only make files larger."""
DELETES_ALL = 1
"""The type of a foxglove.SceneEntityDeletion."""

Message = dict[str, Any]

_MODELS = {
    ".glb": "model/gltf-binary",
    ".stl": "model/stl",
    ".obj": "model/obj",
    ".dae": "model/vnd.collada+xml",
}


def stamp(ns: int) -> Message:
    """A time of Foxglove's, from nanoseconds."""
    sec, nsec = divmod(ns, 1_000_000_000)
    return {"sec": sec, "nsec": nsec}


def entity(ns: int, frame: str, name: str) -> Message:
    """A foxglove.SceneEntity without shapes, which goes where its frame goes."""
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


def add_shape(
    into: Message, shape: Box | Cylinder | Sphere | Mesh, pose: Transform, color: Sequence[float]
) -> None:
    """Put a shape into an entity, at a pose in its frame (m)."""
    common = {"pose": _pose(pose), "color": dict(zip("rgba", color, strict=True))}
    match shape:
        case Box(x, y, z):
            into["cubes"].append({**common, "size": _vector((2.0 * x, 2.0 * y, 2.0 * z))})
        case Sphere(r):
            into["spheres"].append({**common, "size": _vector((2.0 * r, 2.0 * r, 2.0 * r))})
        case Cylinder(r, z):
            size = _vector((2.0 * r, 2.0 * r, 2.0 * z))
            into["cylinders"].append({**common, "size": size, "bottom_scale": 1.0, "top_scale": 1.0})
        case Mesh(corners):
            points = [_vector(corner) for corner in corners]
            into["triangles"].append({**common, "points": points, "colors": [], "indices": []})


def add_model(into: Message, mesh: LinkMesh) -> None:
    """Put the file of a mesh into an entity, if its kind is one that Foxglove shows."""
    if (kind := _MODELS.get(mesh.path.suffix.lower())) is not None:
        model = {
            "pose": _pose(mesh.pose),
            "scale": _vector(mesh.scale),
            "color": dict.fromkeys("rgba", 1.0),
            "override_color": False,
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

"""The channels of a recording and their JSON schemas.

Schemas with the prefix `foxglove.` have the names, properties and types that Foxglove publishes (package
@foxglove/schemas of npm, MIT licence), which a test compares; texts are not taken over. All schemas are
written for the strictest reader known, Lichtblick: each property has one `type`, and nothing is a `$ref`.
"""

import json
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

Schema = dict[str, Any]

STATE = "/state"
DIALOGUE = "/dialogue"
EVENTS = "/events"
LOG = "/log"
FRAMES = "/tf"
SCENE = "/scene"
ARM = "/arm"
CELL = "/cell"
JOINTS = "/joint_states"
WRENCH = "/wrench"

_NULL = "null"
BASE_TYPES = ("object", "array", "string", "number", "integer", "boolean")


class Channel(NamedTuple):
    """A topic of a recording."""

    topic: str
    schema_name: str
    schema: Schema


def _object(title: str = "", optional: tuple[str, ...] = (), /, **properties: Schema) -> Schema:
    required = [name for name in properties if name not in optional]
    head = {"title": title} if title else {}
    return {**head, "type": "object", "properties": properties, "required": required}


def _list(items: Schema) -> Schema:
    return {"type": "array", "items": items}


def _said(kind: str, description: str) -> Schema:
    return {"type": kind, "description": description}


_TEXT: Schema = {"type": "string"}
_NUMBER: Schema = {"type": "number"}
_COUNT: Schema = {"type": "integer", "minimum": 0}
_NANOSECONDS: Schema = {"type": "integer", "minimum": 0, "maximum": 999_999_999}
_TIME: Schema = {
    "title": "time",
    "type": "object",
    "properties": {"sec": _COUNT, "nsec": _NANOSECONDS},
}
_DURATION: Schema = {
    "title": "duration",
    "type": "object",
    "properties": {"sec": {"type": "integer"}, "nsec": _NANOSECONDS},
}
_VECTOR = _object("foxglove.Vector3", x=_NUMBER, y=_NUMBER, z=_NUMBER)
_QUATERNION = _object("foxglove.Quaternion", x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_POSE = _object("foxglove.Pose", position=_VECTOR, orientation=_QUATERNION)
_COLOR = _object("foxglove.Color", r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)

_TRANSFORM = _object(
    "foxglove.FrameTransform",
    timestamp=_TIME,
    parent_frame_id=_TEXT,
    child_frame_id=_TEXT,
    translation=_VECTOR,
    rotation=_QUATERNION,
)
_JOINT = _object(
    "foxglove.JointState",
    ("position", "velocity", "effort"),
    name=_TEXT,
    position=_NUMBER,
    velocity=_NUMBER,
    effort=_NUMBER,
)
_LEVELS = {
    "title": "foxglove.LogLevel",
    "oneOf": [
        {"title": name, "const": level}
        for level, name in enumerate(("UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"))
    ],
}
_DELETION = _object(
    "foxglove.SceneEntityDeletion",
    timestamp=_TIME,
    type={
        "title": "foxglove.SceneEntityDeletionType",
        "oneOf": [{"title": "MATCHING_ID", "const": 0}, {"title": "ALL", "const": 1}],
    },
    id=_TEXT,
)
_UNUSED: Schema = _list({"type": "object"})  # of a scene: recordings have none of these
_ENTITY = _object(
    "foxglove.SceneEntity",
    timestamp=_TIME,
    frame_id=_TEXT,
    id=_TEXT,
    lifetime=_DURATION,
    frame_locked={"type": "boolean"},
    metadata=_list(_object("foxglove.KeyValuePair", key=_TEXT, value=_TEXT)),
    arrows=_UNUSED,
    cubes=_list(_object("foxglove.CubePrimitive", pose=_POSE, size=_VECTOR, color=_COLOR)),
    spheres=_list(_object("foxglove.SpherePrimitive", pose=_POSE, size=_VECTOR, color=_COLOR)),
    cylinders=_list(
        _object(
            "foxglove.CylinderPrimitive",
            pose=_POSE,
            size=_VECTOR,
            bottom_scale=_NUMBER,
            top_scale=_NUMBER,
            color=_COLOR,
        )
    ),
    lines=_UNUSED,
    triangles=_UNUSED,
    texts=_UNUSED,
    models=_list(
        _object(
            "foxglove.ModelPrimitive",
            pose=_POSE,
            scale=_VECTOR,
            color=_COLOR,
            override_color={"type": "boolean"},
            url=_TEXT,
            media_type=_TEXT,
            data={"type": "string", "contentEncoding": "base64"},
        )
    ),
)
_SCENE_UPDATE = _object("foxglove.SceneUpdate", deletions=_list(_DELETION), entities=_list(_ENTITY))

_WHEN = {
    "time_s": _said("number", "simulated time since the start of the simulator, s"),
    "tick": _said("integer", "ticks since the start of the simulator"),
    "real_s": _said("number", "real time since the recording began, s"),
}
_DIALOGUE = _object(
    **_WHEN,
    session=_said("string", "HOST:PORT of the client, or what else speaks or is met with"),
    direction=_said("string", "> a client's line, < its reply, ~ what goes over the wire instead, # event"),
    text=_said("string", "without its line end; what is not printable ASCII is escaped"),
    reason=_said("string", "why a line was refused, with the reply to it; else empty"),
    protocol=_said("string", "of a client that has just connected: iiwa or krc4; else empty"),
)
_EVENT = _object(
    **_WHEN,
    kind=_said("string", "what happens: see docs/recordings.md"),
    move=_said("integer", "number of the move it is about, from 1; 0 for none"),
    code=_said("integer", "of robot_movement_interface; 0 for none"),
    text=_said("string", "more about it, for people"),
    goal_frame={
        **_list(_NUMBER),
        "description": "where a move that begins ends: the TCP in the base, as in /state",
    },
)
_SURFACE = _object(
    "",
    ("size_mm", "radius_mm", "length_mm"),
    shape=_said("string", "plane, box, sphere or cylinder"),
    name=_TEXT,
    x_mm=_NUMBER,
    y_mm=_NUMBER,
    z_mm=_NUMBER,
    alpha=_said("number", "rad, as beta and gamma"),
    beta=_NUMBER,
    gamma=_NUMBER,
    stiffness_n_per_m=_NUMBER,
    damping_s_per_m=_NUMBER,
    friction=_NUMBER,
    size_mm={**_list(_NUMBER), "description": "of a box"},
    radius_mm=_said("number", "of a sphere or a cylinder"),
    length_mm=_said("number", "of a cylinder"),
)
_PART = _object(
    "",
    ("size_mm", "radius_mm", "length_mm"),
    name=_TEXT,
    shape=_said("string", "box, sphere or cylinder"),
    size_mm={**_list(_NUMBER), "description": "of a box"},
    radius_mm=_said("number", "of a sphere or a cylinder"),
    length_mm=_said("number", "of a cylinder"),
)
_CAPSULE = _object(
    start_mm={**_list(_NUMBER), "description": "an end of its line, in the flange"},
    end_mm={**_list(_NUMBER), "description": "the other end"},
    radius_mm=_NUMBER,
)
_CELL = _object(
    contact_radius_mm=_said("number", "of the sphere round the TCP that touches surfaces"),
    inputs={**_list(_TEXT), "description": "names, from number 1 on"},
    outputs={**_list(_TEXT), "description": "names, from number 1 on"},
    surfaces=_list(_SURFACE),
    parts=_list(_PART),
    jaw_mm={**_list(_NUMBER), "description": "of each jaw along x y z of the TCP; none without a gripper"},
    tool_capsules=_list(_CAPSULE),
)
_WRENCH = _object(
    timestamp=_TIME,
    frame_id=_TEXT,
    force={**_VECTOR, "title": "", "description": "acting on the robot, along the axes of the TCP, N"},
    torque={**_VECTOR, "title": "", "description": "about the TCP, along its axes, Nm"},
)


@cache
def state_schema() -> Schema:
    """`protocol/status.schema.json` without `$ref`, with one `type` throughout. What may be null there may
    be left out here."""
    text = files("iiwa_sim.protocol").joinpath("status.schema.json").read_text("utf-8")
    schema: Schema = json.loads(text)
    shared = schema.pop("$defs")
    nullable = {name for name, found in schema["properties"].items() if _NULL in found.get("type", ())}
    schema["required"] = [name for name in schema["required"] if name not in nullable]
    return _plain(schema, shared)


def _plain(schema: Schema, shared: Schema) -> Schema:
    """A schema, and all within it, with one type; `shared` are those that a `$ref` may mean."""
    found = dict(schema)
    reference = found.pop("$ref", None)
    if reference is not None:
        target = shared[reference.removeprefix("#/$defs/")]
        words = [found["description"], target["description"]]
        found = {**target, "description": "; ".join(words)}
    if "enum" in found:
        found["type"] = "string"
    if isinstance(found.get("type"), list):
        (found["type"],) = (each for each in found["type"] if each != _NULL)
    if "items" in found:
        found["items"] = _plain(found["items"], shared)
    if "properties" in found:
        found["properties"] = {name: _plain(each, shared) for name, each in found["properties"].items()}
    return found


def channels() -> list[Channel]:
    """Return the channels in the order of their registration."""
    return [
        Channel(STATE, "iiwa_sim.State", state_schema()),
        Channel(DIALOGUE, "iiwa_sim.Dialogue", _DIALOGUE),
        Channel(EVENTS, "iiwa_sim.Event", _EVENT),
        Channel(
            LOG,
            "foxglove.Log",
            _object(
                "foxglove.Log",
                timestamp=_TIME,
                level=_LEVELS,
                message=_TEXT,
                name=_TEXT,
                file=_TEXT,
                line=_COUNT,
            ),
        ),
        Channel(
            FRAMES,
            "foxglove.FrameTransforms",
            _object("foxglove.FrameTransforms", transforms=_list(_TRANSFORM)),
        ),
        Channel(SCENE, "foxglove.SceneUpdate", _SCENE_UPDATE),
        Channel(ARM, "foxglove.SceneUpdate", _SCENE_UPDATE),
        Channel(
            JOINTS,
            "foxglove.JointStates",
            _object("foxglove.JointStates", timestamp=_TIME, joints=_list(_JOINT)),
        ),
        Channel(WRENCH, "iiwa_sim.Wrench", _WRENCH),
        Channel(CELL, "iiwa_sim.Cell", _CELL),
    ]

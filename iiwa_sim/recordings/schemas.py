"""The channels of a recording: their contents, and their JSON schemas in protocol/recording.schemas.json.

Schemas with the prefix `foxglove.` have the names, properties and types that Foxglove publishes. All are for
the strictest reader known, Lichtblick: each property has one `type`, and nothing is a `$ref`.
"""

from importlib.resources import files
from typing import Any

import msgspec

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
CHANNELS = {
    STATE: "iiwa_sim.State",
    DIALOGUE: "iiwa_sim.Dialogue",
    EVENTS: "iiwa_sim.Event",
    LOG: "foxglove.Log",
    FRAMES: "foxglove.FrameTransforms",
    SCENE: "foxglove.SceneUpdate",
    ARM: "foxglove.SceneUpdate",
    JOINTS: "foxglove.JointStates",
    WRENCH: "iiwa_sim.Wrench",
    CELL: "iiwa_sim.Cell",
}
"""Names of schemas by topics."""
METADATA = "iiwa_sim"
"""Name of the metadata record by which a recording of ours is known."""
_NULL = "null"


class Spoken(msgspec.Struct):
    """A line of the dialogue, as `iiwa_sim.dialogue` tells it."""

    time_s: float
    tick: int
    real_s: float
    session: str
    direction: str
    """One of those of `iiwa_sim.dialogue.Direction`."""
    text: str
    reason: str
    protocol: str


class Event(msgspec.Struct):
    """Something that has happened to the robot by a tick."""

    time_s: float
    tick: int
    real_s: float
    kind: str
    """One of those of docs/recordings.md."""
    move: int
    """Number of the move it is about; 0 for none."""
    code: int
    """Error code of robot_movement_interface; 0 for none."""
    text: str
    goal_frame: tuple[float, ...]
    """Goal of a move that begins: the TCP in the base, x y z (mm) alpha beta gamma (rad)."""


def schemas() -> dict[str, Schema]:
    """Return the schemas by their names."""
    found: dict[str, Schema] = _read("recording.schemas.json")
    return {**found, "iiwa_sim.State": _state_schema()}


def _read(name: str) -> Any:
    return msgspec.json.decode(files("iiwa_sim.protocol").joinpath(name).read_bytes())


def _state_schema() -> Schema:
    """Return the schema of the status port; a recording leaves out what may be null there."""
    schema: Schema = _read("status.schema.json")
    shared = schema.pop("$defs")
    nullable = {name for name, found in schema["properties"].items() if _NULL in found.get("type", ())}
    schema["required"] = [name for name in schema["required"] if name not in nullable]
    return _plain(schema, shared)


def _plain(schema: Schema, shared: Schema) -> Schema:
    """Return a schema in which each schema has one type; `shared` are those that a `$ref` may mean."""
    found = dict(schema)
    if "$ref" in found:
        target = shared[found.pop("$ref").removeprefix("#/$defs/")]
        found = {**target, "description": f"{found['description']}; {target['description']}"}
    if "enum" in found:
        found["type"] = "string"
    if isinstance(found.get("type"), list):
        (found["type"],) = (each for each in found["type"] if each != _NULL)
    if "items" in found:
        found["items"] = _plain(found["items"], shared)
    if "properties" in found:
        found["properties"] = {name: _plain(each, shared) for name, each in found["properties"].items()}
    return found

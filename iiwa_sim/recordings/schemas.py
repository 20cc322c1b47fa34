"""The channels of a recording: their contents, and their JSON schemas in protocol/recording.schemas.json.

Schemas with the prefix `foxglove.` have the names, properties and types that Foxglove publishes. All are for
the strictest reader known, Lichtblick: each property has one `type`, and nothing is a `$ref`.
"""

from importlib import resources
from typing import Any

import msgspec

STATE = "/state"
DIALOGUE = "/dialogue"
EVENTS = "/events"
LOG = "/log"
FRAMES = "/tf"
SCENE = "/scene"
ARM = "/arm"
CELL = "/cell"
CHANNELS = {
    STATE: "iiwa_sim.State",
    DIALOGUE: "iiwa_sim.Dialogue",
    EVENTS: "iiwa_sim.Event",
    LOG: "foxglove.Log",
    FRAMES: "foxglove.FrameTransforms",
    SCENE: "foxglove.SceneUpdate",
    ARM: "foxglove.SceneUpdate",
    CELL: "iiwa_sim.Cell",
}
"""Names of schemas by topics."""
METADATA = "iiwa_sim"
"""Name of the metadata record by which a recording of ours is known."""
ACCEPTED, BEGINS, ENDS, FAULT = "move accepted", "move begins", "move ends", "fault"
"""Kinds of events."""


class Line(msgspec.Struct):
    """A line of the dialogue, from `iiwa_sim.dialogue`."""

    time_s: float
    tick: int
    session: str
    mark: str = msgspec.field(name="direction")
    """One of those of `iiwa_sim.dialogue.Direction`."""
    text: str
    reason: str
    protocol: str


class Event(msgspec.Struct):
    """Something that has happened to the robot by a tick."""

    time_s: float
    tick: int
    kind: str
    """One of those of docs/recordings.md."""
    move: int
    """Number of the move it is about; 0 for none."""
    code: int
    """Error code of robot_movement_interface; 0 for none."""
    text: str
    goal_frame: tuple[float, ...]
    """Goal of a move that begins: the TCP in the base, x y z (mm) alpha beta gamma (rad)."""

    def __str__(self) -> str:
        words = [self.kind, str(self.move or ""), f"({self.code})" if self.code else ""]
        return f"{' '.join(filter(None, words))}: {self.text}"


def schemas() -> dict[str, dict[str, Any]]:
    """Return the schemas by their names; that of the state is the one of the status port."""
    names = "recording.schemas.json", "status.schema.json"
    files = (resources.files("iiwa_sim.protocol").joinpath(name).read_bytes() for name in names)
    found, state = map(msgspec.json.decode, files)
    state["properties"]["gripper"]["type"] = "object"  # a recording leaves out nulls
    state["required"].remove("gripper")
    return {**found, "iiwa_sim.State": state}

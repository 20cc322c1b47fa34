"""Recorded robots, and their files read by the library's own reader."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

from mcap.reader import make_reader

from iiwa_sim.cell.cell import Cell, robot_alone
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.requests import Kind, MoveRequest
from iiwa_sim.controller.state import Snapshot
from iiwa_sim.dialogue import Dialogue
from iiwa_sim.recordings import RecordingFault
from iiwa_sim.recordings.read import Recording
from iiwa_sim.recordings.recorder import Source, recorders_into
from iiwa_sim.robot_events import RobotEvents

RATE_HZ = 500
FAR = (1, 1, 1, -1.5, 1, 1, 1)


class Message(NamedTuple):
    topic: str
    schema_name: str
    schema: bytes
    log_ns: int
    content: dict[str, Any]


def found_in(path: Path, *topics: str) -> list[Message]:
    """Return all messages of a whole file, or those of some topics, in the order of time."""
    with path.open("rb") as file:
        messages = make_reader(file, validate_crcs=True).iter_messages(topics or None)
        return [
            Message(channel.topic, schema.name, schema.data, message.log_time, json.loads(message.data))
            for schema, channel, message in messages
            if schema is not None
        ]


def contents(path: Path, topic: str) -> list[dict[str, Any]]:
    return [found.content for found in found_in(path, topic)]


def states_by_now(path: Path) -> list[Snapshot]:
    """Return states of a file that is being written, which may be empty."""
    try:
        return list(Recording(path).contents("/state"))
    except RecordingFault:
        return []


class Robot:
    """A controller, stepped by hand, and recorded."""

    def __init__(
        self,
        path: Path,
        cell: Cell | None = None,
        rate_hz: int = RATE_HZ,
        controller: Controller | None = None,
    ) -> None:
        self.cell = robot_alone() if cell is None else cell
        self.controller = controller or self.cell.controller(1.0 / RATE_HZ)
        dialogue = Dialogue(lambda: self.controller.tick)
        silent: Any = SimpleNamespace(listeners=[], on_refused=[])
        events = RobotEvents(dialogue)
        source = Source(self.cell, self.controller, dialogue, silent, events)
        clock: Any = SimpleNamespace(rate_hz=RATE_HZ, label="stepped", ignores_real_time=True, paused=False)
        (self.recorder,) = recorders_into(path, [source], clock, rate_hz)
        self.recorder.start()
        self.joints = {self.controller.tick: self.controller.joints}

    def goes_to(self, *joints: float, speed: float = 0.3) -> None:
        self.controller.move(MoveRequest(Kind.PTP, joints, speeds=(speed,) * len(joints)))

    def step(self, ticks: int = 1) -> None:
        for _ in range(ticks):
            self.controller.step()
            self.ticked()

    def ticked(self) -> None:
        self.joints[self.controller.tick] = self.controller.joints
        self.recorder.tick()

    def until_stopped(self) -> None:
        while self.controller.moving:
            self.step()

    def end(self) -> None:
        self.recorder.stop()
        self.recorder.out.close()

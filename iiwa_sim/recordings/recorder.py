"""A robot recorded while it runs: the messages of a recording, and their times."""

import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from importlib import metadata
from math import floor
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from iiwa_sim.backdoor.described import described_cell, parts_of
from iiwa_sim.cell.cell import Cell
from iiwa_sim.clock.clock import Clock
from iiwa_sim.controller.state import Snapshot, snapshot
from iiwa_sim.dialogue import DialogueLine, Direction
from iiwa_sim.recordings import foxglove
from iiwa_sim.recordings.recordings import Source
from iiwa_sim.recordings.scene import Arm
from iiwa_sim.recordings.schemas import (
    ARM,
    CELL,
    DIALOGUE,
    EVENTS,
    FRAMES,
    LOG,
    SCENE,
    STATE,
    Event,
    Spoken,
)
from iiwa_sim.recordings.watch import FAULT, Watch
from iiwa_sim.recordings.writer import Message, Writer

SECOND_NS = 1_000_000_000
VIEW_RATE_HZ = 25
"""Rate of frames, in simulated time."""
BLOCKS_HZ = 20
"""Blocks per simulated second: 25 ticks at 500 Hz."""
_VIEW_PERIOD_NS = SECOND_NS // VIEW_RATE_HZ
_INFO, _WARNING, _ERROR = 2, 3, 4  # levels of foxglove.Log
_LEVELS = {FAULT: _ERROR, "refused": _WARNING, "contact": _WARNING, "part slips": _WARNING}
_STEPS = {
    "joint_velocity": 1e7,
    "cartesian_force": 1e4,
    "joint_torque": 1e4,
    **dict.fromkeys(("flange_frame", "tool_frame", "goal_frame"), 1e7),
}
"""Steps per unit of values that follow from joint positions: in full they are half of a file."""


class Item(NamedTuple):
    """A state, an event, a line or a cell, of which the writing thread makes messages."""

    topic: str
    content: Any
    tick: int
    real_ns: int
    """Real time since 1970."""


def recorders_into(
    path: Path, sources: Sequence[Source], clock: Clock, rate_hz: int | None = None
) -> "list[Recorder]":
    """Open a file, and return a recorder of each robot.

    Raises RecordingFault, and ValueError for a rate outside 1 to that of the ticks.
    """
    several = len(sources) > 1
    recorders = [
        Recorder(each, clock, rate_hz, each.cell.name if several else "", each is sources[0])
        for each in sources
    ]
    head = {"version": metadata.version("iiwa-sim")}
    head |= {"robots": " ".join(each.name for each in recorders)} if several else {}
    attachments: dict[str, tuple[str, bytes]] = {}
    for recorder in recorders:
        prefix = f"{recorder.name}/" if several else ""
        head |= {f"{prefix}{key}": value for key, value in recorder.head().items()}
        files = _attachments(recorder.source.cell)
        attachments |= {f"{prefix}{name}": file for name, file in files.items()}
    out = Writer(path, head, attachments, [each.space for each in recorders])
    for recorder in recorders:
        recorder.out = out
    return recorders


class Recorder:
    """Records one robot: from `start` to `stop`, both called between two ticks.

    Times are simulated, since the start of the simulator; the `publish_time` of each message is real. States
    come once in `tick_rate_hz / rate_hz` ticks, the first and the last one in any case. If nobody waits for
    real time, ticks wait for a file that is too slow; else messages are lost.
    """

    out: Writer
    """The file, which other robots may share."""
    has_commands = False

    def __init__(
        self, source: Source, clock: Clock, rate_hz: int | None, name: str = "", shows_cell: bool = True
    ) -> None:
        """Prepare; nothing of the controller is read before `start`.

        Args:
            source: The robot.
            clock: Its clock.
            rate_hz: States per simulated second; None for one per tick.
            name: Name of the robot, if there are several in the file.
            shows_cell: True for the one of these that shows surfaces, parts and bodies.
        """
        self.source, self.name, self.space = source, name, f"/{name}" if name else ""
        self._clock, self._controller, self._tick_rate_hz = clock, source.controller, clock.rate_hz
        self._rate_hz = self._tick_rate_hz if rate_hz is None else rate_hz
        if not 1 <= self._rate_hz <= self._tick_rate_hz:
            raise ValueError(
                f"record_rate_hz is {rate_hz}, expected 1 to {self._tick_rate_hz}, that of the ticks"
            )
        self._due = 0  # in parts of 1 / tick_rate_hz of a state
        self._began_ns = time.time_ns()
        self._clocks_apart_ns = self._began_ns - time.monotonic_ns()
        self._shown: tuple[object, ...] = ()
        self._watch: Watch | None = None
        self._last_state = -1  # its tick
        self._block: list[Item] = []
        self._block_due = 0  # a tick
        self._arm, self._shows_cell = Arm(source.cell.description), shows_cell
        self._view_due_ns = 0  # of the writing thread
        self._encode = msgspec.json.Encoder().encode

    def head(self) -> dict[str, str]:
        """Return what the metadata of the file tell of this robot."""
        cell = self.source.cell
        return {
            "robot": cell.description.name,
            "joints": " ".join(cell.description.joints),
            "flange": cell.description.flange,
            "clock": self._clock.told,
            "rate_hz": str(self._tick_rate_hz),
            "record_rate_hz": str(self._rate_hz),
            "seed": "none" if cell.noise_levels is None else str(cell.noise_levels.seed),
            "began": datetime.fromtimestamp(self._began_ns / SECOND_NS, UTC).isoformat(),
            "protocols": " ".join(self.source.protocols),
        }

    def start(self) -> None:
        """Record from the present tick on."""
        source = self.source
        self._watch = Watch(self._controller, lambda: self._clock.told, self.event)
        source.dialogue.listeners.append(self._hear)
        source.log.on_refused.append(self._refused)
        source.events.listeners.append(self.event)
        source.backdoor.listeners.append(self._backdoor)
        self._put(ARM, None)
        self._show_cell()
        self._add_state()
        for _, session, protocol in source.wire.peers.values():
            now = self._controller.tick, time.monotonic_ns()
            self._hear(DialogueLine(session, Direction.EVENT, "connected", *now, protocol=protocol))

    def stop(self) -> None:
        """Record no more."""
        assert self._watch is not None
        if self._last_state != self._controller.tick:
            self._add_state()
        self._hand_over()
        self._watch.close()
        self._watch, source = None, self.source
        source.dialogue.listeners.remove(self._hear)
        source.log.on_refused.remove(self._refused)
        source.events.listeners.remove(self.event)
        source.backdoor.listeners.remove(self._backdoor)

    def tick(self) -> None:
        """A tick has been made."""
        watch = self._watch
        if watch is None:
            return
        watch.ticked()
        self._due += self._rate_hz
        if self._due >= self._tick_rate_hz:
            self._due -= self._tick_rate_hz
            self._add_state()
        if self._controller.tick >= self._block_due:
            self._hand_over()
            watch.look()  # the clock may have changed

    def skip(self, ticks: int) -> None:
        """Ticks of a robot at rest have been left out: none of those that are recorded."""

    @property
    def watching(self) -> bool:
        """True if the recorder has to see each tick, also of a robot at rest."""
        return self._watch is not None

    def event(
        self, kind: str, text: str = "", move: int = 0, code: int = 0, goal_frame: tuple[float, ...] = ()
    ) -> None:
        """Record something that has happened, by the fields of `Event`."""
        if kind == FAULT and self._watch is not None:
            self._watch.in_error = bool(self._controller.status().in_error)
        real_ns = time.time_ns()
        when = self._when(self._controller.tick, real_ns)
        self._put(EVENTS, Event(*when, kind, move, code, text, goal_frame), real_ns=real_ns)
        self._hasten()

    def _refused(self, session: str, line: str, code: int, reason: str) -> None:
        self.event("refused", f"{session} '{line}': {reason}", code=code)

    def _backdoor(self, call: str) -> None:
        """A test bench has done something, which may have changed the cell."""
        self.event("backdoor", call)
        if self._watch is not None:
            self._watch.look()
        if self._shown != self._visible():
            self._show_cell()

    def _hear(self, said: DialogueLine) -> None:
        if self._watch is not None:
            self._watch.look()  # the line has been carried out
        real_ns = said.instant_ns + self._clocks_apart_ns
        when = self._when(said.tick, real_ns)
        spoken = Spoken(*when, said.session, said.direction.value, said.text, said.reason, said.protocol)
        self._put(DIALOGUE, spoken, said.tick, real_ns)
        if said.direction is not Direction.FROM_CLIENT:
            self._hasten()

    def _when(self, tick: int, real_ns: int) -> tuple[float, int, float]:
        real_s = round((real_ns - self._began_ns) / SECOND_NS, 6)
        return round(tick / self._tick_rate_hz, 9), tick, real_s

    def _visible(self) -> tuple[object, ...]:
        return list(self._controller.load.world.surfaces.values()), parts_of(self._controller)

    def _show_cell(self) -> None:
        self._shown = self._visible()
        self._put(CELL, described_cell(self._controller))

    def _add_state(self) -> None:
        self._last_state = self._controller.tick
        self._put(STATE, snapshot(self._controller))

    def _put(self, topic: str, content: Any, tick: int | None = None, real_ns: int | None = None) -> None:
        tick = self._controller.tick if tick is None else tick
        self._block.append(Item(topic, content, tick, time.time_ns() if real_ns is None else real_ns))

    @property
    def _in_haste(self) -> bool:
        """True if nobody waits for real time."""
        return self._clock.in_haste or self._clock.paused

    def _hasten(self) -> None:
        """Write the buffered states if ticks do not follow real time: the next tick may never come."""
        if self._in_haste:
            self._hand_over()

    def _hand_over(self) -> None:
        self._block_due = self._controller.tick + max(self._tick_rate_hz // BLOCKS_HZ, 1)
        block, self._block = self._block, []
        if block:
            self.out.put(block, self._messages, can_wait=self._in_haste)

    def _messages(self, block: Sequence[Item]) -> Iterator[Message]:
        """Yield the messages of a block, in the writing thread."""
        for item in block:
            log_ns = item.tick * SECOND_NS // self._tick_rate_hz
            for topic, content in self._contents(item, log_ns):
                if self.name and isinstance(content, dict):
                    foxglove.in_namespace(self.name, content)
                yield f"{self.space}{topic}", self._encode(content), log_ns, item.real_ns

    def _contents(self, item: Item, log_ns: int) -> Iterator[tuple[str, Any]]:
        if item.topic == ARM:
            yield ARM, foxglove.model(log_ns, self._arm)
        elif item.topic == STATE:
            yield STATE, _rounded(item.content)
            late_ns = log_ns - self._view_due_ns
            if late_ns >= 0:
                self._view_due_ns = log_ns + _VIEW_PERIOD_NS - (late_ns if late_ns < _VIEW_PERIOD_NS else 0)
                base = self.source.cell.base if self.name else None
                yield FRAMES, foxglove.frames(log_ns, self._arm, item.content, self._shows_cell, base)
        else:
            yield item.topic, item.content
            if item.topic == EVENTS:
                yield LOG, _logged(item.content, log_ns)
            elif item.topic == CELL:
                yield SCENE, foxglove.scene(log_ns, self._arm, item.content, self._shows_cell)


def _logged(event: Event, log_ns: int) -> dict[str, Any]:
    code = f"({event.code})" if event.code else ""
    head = " ".join(f"{event.kind} {event.move or ''} {code}".split())
    return {
        "timestamp": foxglove.stamp(log_ns),
        "level": _LEVELS.get(event.kind, _INFO),
        "message": f"{head}: {event.text}" if event.text else head,
        "name": "iiwa-sim",
        "file": "",
        "line": 0,
    }


def _rounded(state: Snapshot) -> dict[str, Any]:
    """Return a state as it is recorded: rounded, and without a gripper that is not there."""
    told = msgspec.structs.asdict(state)
    for name, steps in _STEPS.items():  # floor takes a third of the time of round
        told[name] = [floor(each * steps + 0.5) / steps for each in told[name]]
    if state.gripper is None:
        del told["gripper"]
    return told


def _attachments(cell: Cell) -> dict[str, tuple[str, bytes]]:
    """Return the files of a robot in its cell by their names, with their media types."""
    description = cell.description
    found = {"robot.urdf": ("application/xml", description.urdf.encode())}
    for name, path in (("robot.toml", Path(description.settings_path)), ("cell.toml", cell.path)):
        if path is not None:
            with suppress(OSError):  # gone since it was read
                found[name] = ("application/toml", path.read_bytes())
    return found

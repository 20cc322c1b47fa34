"""A robot recorded while it runs: the messages of a recording, and their times."""

import time
from collections.abc import Callable, Iterator, Sequence
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from iiwa_sim.backdoor.described import described_cell, parts_of
from iiwa_sim.clock.clock import Clock
from iiwa_sim.controller.endings import Ending
from iiwa_sim.controller.modes import Mode
from iiwa_sim.controller.state import snapshot
from iiwa_sim.dialogue import DialogueLine
from iiwa_sim.recordings import foxglove
from iiwa_sim.recordings.recordings import Source
from iiwa_sim.recordings.scene import Arm
from iiwa_sim.recordings.schemas import (
    ACCEPTED,
    ARM,
    BEGINS,
    CELL,
    DIALOGUE,
    ENDS,
    EVENTS,
    FRAMES,
    LOG,
    SCENE,
    STATE,
    Event,
    Spoken,
)
from iiwa_sim.recordings.writer import Message, Writer

SECOND_NS = 1_000_000_000
VIEW_PERIOD_NS = SECOND_NS // 25
"""Period of frames, in simulated time."""
BLOCKS_HZ = 20
"""Blocks per simulated second: 25 ticks at 500 Hz."""


class Item(NamedTuple):
    """A state, an event, a line or a cell, of which the writing thread makes messages."""

    topic: str
    content: Any
    tick: int
    real_ns: int
    """Real time since 1970."""


def recorders_into(path: Path, sources: Sequence[Source], clock: Clock, rate_hz: int) -> "list[Recorder]":
    """Open a file, and return a recorder of each robot. Raises RecordingFault."""
    names = [each.cell.name for each in sources] if len(sources) > 1 else [""]
    head = {"version": metadata.version("iiwa-sim")} | ({"robots": " ".join(names)} if names[0] else {})
    attachments: dict[str, tuple[str, bytes]] = {}
    for name, source in zip(names, sources, strict=True):
        prefix, robot, noise = f"{name}/" if name else "", source.cell.description, source.cell.noise
        described = {
            "robot": robot.name,
            "joints": " ".join(robot.joints),
            "flange": robot.flange,
            "clock": clock.told,
            "rate_hz": str(clock.rate_hz),
            "record_rate_hz": str(rate_hz),
            "seed": "none" if noise is None else str(noise.seed),
            "began": datetime.now(UTC).isoformat(),
        }
        head |= {f"{prefix}{key}": value for key, value in described.items()}
        attachments[f"{prefix}robot.urdf"] = "application/xml", robot.urdf.encode()
        for file, place in (("robot.toml", Path(robot.settings_path)), ("cell.toml", source.cell.path)):
            if place is not None and place.is_file():
                attachments[f"{prefix}{file}"] = "application/toml", place.read_bytes()
    out = Writer(path, head, attachments)
    return [
        Recorder(source, clock, rate_hz, out, name, shows_cell=source is sources[0])
        for name, source in zip(names, sources, strict=True)
    ]


class Recorder:
    """Records one robot: from `start` to `stop`, both called between two ticks.

    Times are simulated, since the start of the simulator; the `publish_time` of each message is real. States
    come once in `tick_rate_hz / rate_hz` ticks, the first and the last one in any case. If nobody waits for
    real time, ticks wait for a file that is too slow; else messages are lost.
    """

    has_commands, watching = False, True

    def __init__(
        self, source: Source, clock: Clock, rate_hz: int, out: Writer, name: str, shows_cell: bool
    ) -> None:
        """Prepare to write `rate_hz` states per simulated second to a file that other robots may share.

        `name` is that of one of several robots, the first of which `shows_cell`: surfaces, parts and bodies.
        """
        self.out, self._source, self._name = out, source, name
        self._space = f"/{name}" if name else ""
        self._clock, self._controller = clock, source.controller
        self._rate_hz, self._tick_rate_hz = rate_hz, clock.rate_hz
        self._due = 0  # in parts of 1 / tick_rate_hz of a state
        self._clocks_apart_ns = time.time_ns() - time.monotonic_ns()
        self._shown: tuple[object, ...] = ()
        self._last_state = -1  # its tick
        self._block: list[Item] = []
        self._block_due = 0  # a tick
        self._heard: tuple[tuple[list[Any], Callable[..., None]], ...] = (
            (source.controller.endings.listeners, self._ended),
            (source.dialogue.listeners, self._hear),
            (source.log.on_refused, self._refused),
            (source.events.listeners, self.event),
            (source.backdoor.listeners, self._backdoor),
        )
        self._arm, self._shows_cell = Arm(source.cell.description), shows_cell
        self._view_due_ns = 0  # of the writing thread
        self._encode = msgspec.json.Encoder().encode

    def start(self) -> None:
        """Record from the present tick on."""
        robot = self._controller
        self._mode, self._accepted, self._begun = robot.mode, robot.accepted, robot.accepted
        for listeners, listener in self._heard:
            listeners.append(listener)
        self._put(ARM, None)
        self._show_cell()
        self._add_state()

    def stop(self) -> None:
        """Record no more."""
        if self._last_state != self._controller.tick:
            self._add_state()
        self._hand_over()
        for listeners, listener in self._heard:
            listeners.remove(listener)

    def tick(self) -> None:
        """A tick has been made."""
        robot = self._controller
        self._look()
        # A servo's target or a stiffness move has no other sign of its beginning.
        if self._begun < robot.accepted and robot.mode is not Mode.NORMAL:
            if robot.motions.is_pending(robot.accepted):
                self._begin(robot.accepted)
            self._begun = robot.accepted
        self._due += self._rate_hz
        if self._due >= self._tick_rate_hz:
            self._due -= self._tick_rate_hz
            self._add_state()
        if robot.tick >= self._block_due:
            self._hand_over()

    def skip(self, ticks: int) -> None:
        """Ticks of a robot at rest have been left out: none of those that are recorded."""

    def event(
        self, kind: str, text: str = "", move: int = 0, code: int = 0, goal_frame: tuple[float, ...] = ()
    ) -> None:
        """Record something that has happened, by the fields of `Event`."""
        tick = self._controller.tick
        self._put(EVENTS, Event(self._seconds(tick), tick, kind, move, code, text, goal_frame))

    def _look(self) -> None:
        """Record a change of the mode, and moves that were accepted or have begun."""
        robot = self._controller
        if robot.mode is not self._mode:
            self.event("mode", f"{self._mode.value} -> {robot.mode.value}")
            self._mode = robot.mode
        while self._accepted < robot.accepted:
            self._accepted += 1
            self.event(ACCEPTED, robot.mode.value, self._accepted)
        if robot.motions.under_way > self._begun:
            self._begin(robot.motions.under_way)

    def _begin(self, move: int) -> None:
        self._begun = move
        self.event(BEGINS, self._controller.mode.value, move, goal_frame=self._controller.goal_frame())

    def _ended(self, ending: Ending) -> None:
        self._look()
        self.event(ENDS, ending.reason or "at its target", ending.move, ending.code)

    def _refused(self, session: str, line: str, code: int, reason: str) -> None:
        self.event("refused", f"{session} '{line}': {reason}", code=code)

    def _backdoor(self, call: str) -> None:
        """A test bench has done something, which may have changed the cell."""
        self.event("backdoor", call)
        if self._shown != self._visible():
            self._show_cell()

    def _hear(self, said: DialogueLine) -> None:
        self._look()  # the line has been carried out
        when, real_ns = self._seconds(said.tick), said.instant_ns + self._clocks_apart_ns
        spoken = Spoken(when, said.tick, said.session, said.mark, said.text, said.reason, said.protocol)
        self._block.append(Item(DIALOGUE, spoken, said.tick, real_ns))

    def _seconds(self, tick: int) -> float:
        return round(tick / self._tick_rate_hz, 9)

    def _visible(self) -> tuple[object, ...]:
        return list(self._controller.load.world.surfaces.values()), parts_of(self._controller)

    def _show_cell(self) -> None:
        self._shown = self._visible()
        self._put(CELL, described_cell(self._controller))

    def _add_state(self) -> None:
        self._last_state = self._controller.tick
        self._put(STATE, snapshot(self._controller))

    def _put(self, topic: str, content: Any) -> None:
        self._block.append(Item(topic, content, self._controller.tick, time.time_ns()))

    def _hand_over(self) -> None:
        self._block_due = self._controller.tick + max(self._tick_rate_hz // BLOCKS_HZ, 1)
        block, self._block = self._block, []
        self.out.put(block, self._messages, can_wait=self._clock.in_haste or self._clock.paused)

    def _messages(self, block: Sequence[Item]) -> Iterator[Message]:
        """Yield the messages of a block, in the writing thread."""
        for item in block:
            log_ns = item.tick * SECOND_NS // self._tick_rate_hz
            for topic, content in self._contents(item, log_ns):
                if self._name and isinstance(content, dict):
                    foxglove.in_namespace(self._name, content)
                yield f"{self._space}{topic}", self._encode(content), log_ns, item.real_ns

    def _contents(self, item: Item, log_ns: int) -> Iterator[tuple[str, Any]]:
        if item.topic == ARM:
            yield ARM, foxglove.model(log_ns, self._arm)
        elif item.topic == STATE:
            state = msgspec.structs.asdict(item.content)
            if item.content.gripper is None:
                del state["gripper"]  # readers know no values that may be null
            yield STATE, state
            if log_ns >= self._view_due_ns:
                self._view_due_ns = log_ns - log_ns % VIEW_PERIOD_NS + VIEW_PERIOD_NS
                base = self._source.cell.base if self._name else None
                yield FRAMES, foxglove.frames(log_ns, self._arm, item.content, self._shows_cell, base)
        else:
            yield item.topic, item.content
            if item.topic == EVENTS:
                yield LOG, foxglove.log(log_ns, item.content)
            elif item.topic == CELL:
                yield SCENE, foxglove.scene(log_ns, self._arm, item.content, self._shows_cell)

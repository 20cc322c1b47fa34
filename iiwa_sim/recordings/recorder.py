"""A robot recorded while it runs: the messages of a recording, and their times."""

import time
from collections.abc import Callable, Iterator, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from iiwa_sim.backdoor.backdoor import BACKDOOR
from iiwa_sim.backdoor.described import described_cell, parts_of
from iiwa_sim.cell.cell import Cell
from iiwa_sim.clock.clock import Clock
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.endings import Ending
from iiwa_sim.controller.modes import Mode
from iiwa_sim.controller.state import snapshot
from iiwa_sim.dialogue import Dialogue, DialogueLine
from iiwa_sim.log import SessionLog
from iiwa_sim.recordings import foxglove, schemas
from iiwa_sim.recordings.scene import Arm
from iiwa_sim.recordings.writer import Message, Writer
from iiwa_sim.robot_events import RobotEvents

SECOND_NS = 1_000_000_000
VIEW_PERIOD_NS = SECOND_NS // 25
"""Period of frames, in simulated time."""
BLOCKS_HZ = 20
"""Blocks per simulated second: 25 ticks at 500 Hz."""
Item = tuple[str, Any, int, int]
"""Topic, a state, event, line or cell, its tick, and real time since 1970 (ns)."""


class Source(NamedTuple):
    """A robot as recordings see it."""

    cell: Cell
    controller: Controller
    dialogue: Dialogue
    log: SessionLog
    events: RobotEvents


def recorders_into(path: Path, sources: Sequence[Source], clock: Clock, rate_hz: int) -> "list[Recorder]":
    """Open a file, and return a recorder of each robot. Raises RecordingFault."""
    names = [each.cell.name for each in sources] if len(sources) > 1 else [""]
    head = {"version": metadata.version("iiwa-sim")} | ({"robots": " ".join(names)} if names[0] else {})
    attachments: dict[str, bytes] = {}
    for name, source in zip(names, sources, strict=True):
        prefix, robot, noise = f"{name}/" if name else "", source.cell.description, source.cell.noise
        described = {
            "robot": robot.name,
            "clock": clock.label,
            "rate_hz": str(clock.rate_hz),
            "record_rate_hz": str(rate_hz),
            "seed": "none" if noise is None else str(noise.seed),
        }
        head |= {f"{prefix}{key}": value for key, value in described.items()}
        attachments[f"{prefix}robot.urdf"] = robot.urdf.encode()
        for file, place in (("robot.toml", Path(robot.settings_path)), ("cell.toml", source.cell.path)):
            if place is not None and place.is_file():
                attachments[f"{prefix}{file}"] = place.read_bytes()
    out = Writer(path, head, attachments)
    return [
        Recorder(source, clock, rate_hz, out, name, shows_cell=source is sources[0])
        for name, source in zip(names, sources, strict=True)
    ]


class Recorder:
    """Recorder of one robot, from `start` to `stop`, both called between two ticks.

    Times are simulated, since the start of the simulator; the `publish_time` of each message is real. States
    come once in `tick_rate_hz / rate_hz` ticks, the first and the last one in any case. If the clock does not
    follow real time, ticks wait for a file that is too slow; else messages are lost.
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
        self._shown: tuple[object, ...] = ()
        self._last_state = -1  # its tick
        self._block: list[Item] = []
        self._block_due = 0  # a tick
        self._listeners: tuple[tuple[list[Any], Callable[..., None]], ...] = (
            (source.controller.endings.listeners, self._ended),
            (source.dialogue.listeners, self._dialogue_line),
            (source.log.on_refused, self._refused),
            (source.events.listeners, self.event),
        )
        self._arm, self._shows_cell = Arm(source.cell.description), shows_cell
        self._view_due_ns = 0  # of the writing thread
        self._encode = msgspec.json.Encoder().encode

    def start(self) -> None:
        """Record from the present tick on."""
        robot = self._controller
        self._mode, self._accepted, self._begun = robot.mode, robot.accepted, robot.accepted
        for listeners, listener in self._listeners:
            listeners.append(listener)
        self._put(schemas.ARM, None)
        self._show_cell()
        self._add_state()

    def stop(self) -> None:
        """Record no more."""
        if self._last_state != self._controller.tick:
            self._add_state()
        self._hand_over()
        for listeners, listener in self._listeners:
            listeners.remove(listener)

    def tick(self) -> None:
        """Notice that a tick has been made."""
        robot = self._controller
        self._look()
        # A servo's target or a stiffness move has no other sign of its beginning.
        if self._begun < robot.accepted and robot.mode is not Mode.NORMAL:
            if robot.motions.is_pending(robot.accepted):
                self._begin(robot.accepted)
            self._begun = robot.accepted
        states, before = (each * self._rate_hz // self._tick_rate_hz for each in (robot.tick, robot.tick - 1))
        if states > before:
            self._add_state()
        if robot.tick >= self._block_due:
            self._hand_over()

    def event(
        self, kind: str, text: str = "", move: int = 0, code: int = 0, goal_frame: tuple[float, ...] = ()
    ) -> None:
        """Record something that has happened, by the fields of `Event`."""
        self._put(schemas.EVENTS, schemas.Event(*self._now(), kind, move, code, text, goal_frame))

    def _look(self) -> None:
        """Record a change of the mode, and moves that were accepted or have begun."""
        robot = self._controller
        if robot.mode is not self._mode:
            self.event("mode", f"{self._mode.value} -> {robot.mode.value}")
            self._mode = robot.mode
        while self._accepted < robot.accepted:
            self._accepted += 1
            self.event(schemas.ACCEPTED, robot.mode.value, self._accepted)
        if robot.motions.under_way > self._begun:
            self._begin(robot.motions.under_way)

    def _begin(self, move: int) -> None:
        self._begun, robot = move, self._controller
        self.event(schemas.BEGINS, robot.mode.value, move, goal_frame=robot.goal_frame())

    def _ended(self, ending: Ending) -> None:
        self._look()
        self.event(schemas.ENDS, ending.reason or "at its target", ending.move, ending.code)

    def _refused(self, session: str, line: str, code: int, reason: str) -> None:
        self.event("refused", f"{session} '{line}': {reason}", code=code)

    def _dialogue_line(self, line: DialogueLine) -> None:
        self._look()  # the line has been carried out
        words = line.session, line.mark, line.text, line.reason, line.protocol
        self._put(schemas.DIALOGUE, schemas.Line(*self._now(), *words))
        if line.session == BACKDOOR:
            self.event(BACKDOOR, line.text)
            if self._shown != self._visible():
                self._show_cell()

    def _now(self) -> tuple[float, int]:
        return round(self._controller.tick / self._tick_rate_hz, 9), self._controller.tick

    def _visible(self) -> tuple[object, ...]:
        return list(self._controller.load.contact.surfaces.values()), parts_of(self._controller)

    def _show_cell(self) -> None:
        self._shown = self._visible()
        self._put(schemas.CELL, described_cell(self._controller))

    def _add_state(self) -> None:
        self._last_state = self._controller.tick
        self._put(schemas.STATE, snapshot(self._controller))

    def _put(self, topic: str, content: Any) -> None:
        self._block.append((topic, content, self._controller.tick, time.time_ns()))

    def _hand_over(self) -> None:
        self._block_due = self._controller.tick + max(self._tick_rate_hz // BLOCKS_HZ, 1)
        block, self._block = self._block, []
        self.out.put(block, self._messages, can_wait=self._clock.ignores_real_time or self._clock.paused)

    def _messages(self, block: Sequence[Item]) -> Iterator[Message]:
        """Yield the messages of a block, in the writing thread."""
        for topic, content, tick, real_ns in block:
            log_ns = tick * SECOND_NS // self._tick_rate_hz
            for name, message in self._contents(topic, content, log_ns):
                if self._name and isinstance(message, dict):
                    foxglove.in_namespace(self._name, message)
                yield f"{self._space}{name}", self._encode(message), log_ns, real_ns

    def _contents(self, topic: str, content: Any, log_ns: int) -> Iterator[tuple[str, Any]]:
        message = foxglove.model(log_ns, self._arm) if topic == schemas.ARM else content
        if topic == schemas.STATE:
            fields = msgspec.structs.asdict(content).items()
            message = {name: value for name, value in fields if value is not None}  # readers know no null
        yield topic, message
        if topic == schemas.STATE and log_ns >= self._view_due_ns:
            self._view_due_ns = log_ns - log_ns % VIEW_PERIOD_NS + VIEW_PERIOD_NS
            base = self._source.cell.base if self._name else None
            yield schemas.FRAMES, foxglove.frames(log_ns, self._arm, content, self._shows_cell, base)
        elif topic == schemas.EVENTS:
            yield schemas.LOG, foxglove.log(log_ns, content)
        elif topic == schemas.CELL:
            yield schemas.SCENE, foxglove.scene(log_ns, self._arm, content, self._shows_cell)

"""A robot recorded while it runs: what is put into a recording, and when."""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

import msgspec

from iiwa_sim.backdoor.described import DescribedCell, described_cell
from iiwa_sim.cell.cell import Cell
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.controller import Controller
from iiwa_sim.dialect.wire.dialogue import Dialogue, DialogueLine, Direction
from iiwa_sim.recordings import watch
from iiwa_sim.recordings.mcap_file import Head, McapFile
from iiwa_sim.recordings.scene import Arm, stamp
from iiwa_sim.recordings.schemas import CELL, DIALOGUE, EVENTS, LOG, SCENE, STATE
from iiwa_sim.recordings.state import state_line
from iiwa_sim.recordings.views import Views
from iiwa_sim.recordings.watch import Event, Watch
from iiwa_sim.recordings.writer import Message, Writer

_INFO, _WARNING, _ERROR = 2, 3, 4  # levels of foxglove.Log
_LEVELS = {watch.FAULT: _ERROR, watch.LOST: _ERROR, watch.REFUSED: _WARNING, watch.CONTACT: _WARNING}
_SECOND_NS = 1_000_000_000


class Recorder:
    """Records one robot into one file: from `start` to `stop`, both called between two ticks, then `finish`.

    Times are simulated, told from the instant at which the recording begins; the `publish_time` of each
    message is the real one. States come once in `tick_rate_hz / rate_hz` ticks, the first and the last one in
    any case. Where nobody waits for real time (`in_haste`), ticks wait for a file that is too slow; elsewhere
    messages are lost.
    """

    def __init__(
        self,
        path: Path,
        controller: Controller,
        dialogue: Dialogue,
        *,
        cell: Cell,
        tick_rate_hz: int,
        rate_hz: int | None = None,
        clock: Callable[[], str],
        in_haste: Callable[[], bool] = lambda: False,
        said_of_it: Mapping[str, str] | None = None,
    ) -> None:
        """`rate_hz` is that of states, None for every tick; `said_of_it` is more for the metadata.

        Nothing of the controller is read before `start`. Raises RecordingFault for a file that cannot be
        written, and ValueError for a rate outside 1 to `tick_rate_hz`.
        """
        if rate_hz is not None and not 1 <= rate_hz <= tick_rate_hz:
            raise ValueError(f"record_rate_hz is {rate_hz}, expected 1 to {tick_rate_hz}, that of the ticks")
        self._controller = controller
        self._dialogue = dialogue
        self._cell = cell
        self._clock = clock
        self._in_haste = in_haste
        self._tick_rate_hz = tick_rate_hz
        self._rate_hz = tick_rate_hz if rate_hz is None else rate_hz
        self._due = 0  # in parts of 1 / tick_rate_hz of a state
        self._began_ns = time.time_ns()
        self._clocks_apart_ns = self._began_ns - time.monotonic_ns()
        self._epoch_ns = self._began_ns  # of tick 0
        self._surfaces: list[Surface] = []
        self._watch: Watch | None = None
        self._last_state = -1  # its tick
        self._encode = msgspec.json.Encoder().encode
        description = cell.description
        self._arm = Arm(description.urdf, description.joints)
        head = Head(
            {
                "version": metadata.version("iiwa-sim"),
                "robot": description.name,
                "joints": " ".join(description.joints),
                "flange": description.flange,
                "velocity_rad_s": " ".join(map(str, description.velocity)),
                "clock": clock(),
                "rate_hz": str(tick_rate_hz),
                "record_rate_hz": str(self._rate_hz),
                "seed": "none" if cell.noise_levels is None else str(cell.noise_levels.seed),
                "began": datetime.fromtimestamp(self._began_ns / _SECOND_NS, UTC).isoformat(),
                **(said_of_it or {}),
            },
            _attachments(cell),
            self._began_ns,
        )
        file = McapFile(path, head)
        self._out = Writer(path, file, Views(self._arm, description.joints).expand)

    def start(self, there: Sequence[tuple[str, str]] = ()) -> None:
        """Record from the present tick on; `there` are sessions that are connected, with their dialects."""
        self._epoch_ns = self._began_ns - self._simulated_ns(self._controller.tick)
        self._watch = Watch(self._controller, self._clock, self.event)
        self._dialogue.listeners.append(self._hear)
        self._show_scene()
        self._put_state()
        for session, dialect in there:
            now_ns = time.monotonic_ns()
            tick = self._controller.tick
            self._hear(DialogueLine(session, Direction.EVENT, "connected", tick, now_ns, dialect=dialect))

    def stop(self) -> None:
        """Record no more. Does nothing a second time."""
        if self._watch is None:
            return
        if self._last_state != self._controller.tick:
            self._put_state()
        self._watch.close()
        self._watch = None
        self._dialogue.listeners.remove(self._hear)

    def finish(self) -> bool:
        """Write what waits and the end of the file; whether that was done, for a file that takes nothing."""
        return self._out.close()

    @property
    def lost(self) -> int:
        """Messages that found no room."""
        return self._out.lost

    def tick(self) -> None:
        """A tick has been made."""
        if self._watch is None:
            return
        self._watch.ticked()
        self._due += self._rate_hz
        if self._due >= self._tick_rate_hz:
            self._due -= self._tick_rate_hz
            self._put_state()

    def skip(self, ticks: int) -> None:
        """Ticks of a robot at rest have been left out: none of those that are recorded."""

    @property
    def watching(self) -> bool:
        """Whether it has to see each tick, also of a robot at rest."""
        return self._watch is not None

    @property
    def has_commands(self) -> bool:
        """It never makes the robot move."""
        return False

    def event(self, event: Event) -> None:
        """Something has happened."""
        real_ns = time.time_ns()
        self._put(
            EVENTS,
            {
                **self._when(self._controller.tick, real_ns),
                "kind": event.kind,
                "move": event.move,
                "code": event.code,
                "text": event.text,
                "goal_frame": event.goal,
            },
            self._controller.tick,
            real_ns,
        )
        self._put(LOG, self._logged(event), self._controller.tick, real_ns)

    def fault(self, code: int, reason: str) -> None:
        """The robot has met with something between commands."""
        if self._watch is not None:
            self._watch.fault(code, reason)

    def refused(self, session: str, line: str, code: int, reason: str) -> None:
        """A line of a session was refused."""
        self.event(Event(watch.REFUSED, f"{session} '{line}': {reason}", code=code))

    def contact(self, move: int, text: str) -> None:
        """A force has ended a move."""
        self.event(Event(watch.CONTACT, text, move))

    def backdoor(self, call: str) -> None:
        """A test bench has done something, which may have changed the scene."""
        self.event(Event(watch.BACKDOOR, call))
        if self._watch is not None:
            self._watch.look()
        if self._surfaces != list(self._controller.load.world.surfaces.values()):
            self._show_scene()

    def _hear(self, said: DialogueLine) -> None:
        if said.direction is not Direction.FROM_CLIENT and self._watch is not None:
            self._watch.look()  # a command has been carried out
        real_ns = said.instant_ns + self._clocks_apart_ns
        message = {
            **self._when(said.tick, real_ns),
            "session": said.session,
            "direction": said.direction.value,
            "text": said.text,
            "reason": said.reason,
            "dialect": said.dialect,
        }
        self._put(DIALOGUE, message, said.tick, real_ns)

    def _put_state(self) -> None:
        self._last_state = self._controller.tick
        line = state_line(self._controller)
        message = Message(STATE, line, self._log_ns(self._last_state), time.time_ns())
        self._out.put(message, can_wait=self._in_haste())

    def _show_scene(self) -> None:
        world, tick = self._controller.load.world, self._controller.tick
        self._surfaces = list(world.surfaces.values())
        radius_m = self._cell.contact_radius_m if self._surfaces else 0.0
        scene = self._arm.scene(self._log_ns(tick), self._surfaces, radius_m)
        real_ns = time.time_ns()
        self._put(SCENE, scene, tick, real_ns)
        self._put(CELL, described_cell(self._controller), tick, real_ns)

    def _logged(self, event: Event) -> dict[str, Any]:
        words = [event.kind, f"{event.move}" if event.move else "", f"({event.code})" if event.code else ""]
        head = " ".join(word for word in words if word)
        return {
            "timestamp": stamp(self._log_ns(self._controller.tick)),
            "level": _LEVELS.get(event.kind, _INFO),
            "message": f"{head}: {event.text}" if event.text else head,
            "name": "iiwa-sim",
            "file": "",
            "line": 0,
        }

    def _put(self, topic: str, content: Mapping[str, Any] | DescribedCell, tick: int, real_ns: int) -> None:
        message = Message(topic, self._encode(content), self._log_ns(tick), real_ns)
        self._out.put(message, can_wait=self._in_haste())

    def _when(self, tick: int, real_ns: int) -> dict[str, Any]:
        return {
            "time_s": round(tick / self._tick_rate_hz, 9),
            "tick": tick,
            "real_s": round((real_ns - self._began_ns) / _SECOND_NS, 6),
        }

    def _log_ns(self, tick: int) -> int:
        return self._epoch_ns + self._simulated_ns(tick)

    def _simulated_ns(self, tick: int) -> int:
        return tick * _SECOND_NS // self._tick_rate_hz


def _attachments(cell: Cell) -> dict[str, tuple[str, bytes]]:
    """The files the robot is made of: what is needed to draw it elsewhere."""
    description = cell.description
    found = {"robot.urdf": ("application/xml", description.urdf.encode())}
    for name, path in (("robot.toml", Path(description.settings_path)), ("cell.toml", cell.path)):
        if path is not None:
            with suppress(OSError):  # gone since it was read
                found[name] = ("application/toml", path.read_bytes())
    return found

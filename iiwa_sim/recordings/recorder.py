"""A robot recorded while it runs: the messages of a recording, and their times."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from importlib import metadata
from math import floor
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec

from iiwa_sim.backdoor.described import bodies_of, described_cell, jaw_m_of, parts_of
from iiwa_sim.cell.cell import Cell
from iiwa_sim.clock.clock import Clock
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.state import Snapshot, snapshot
from iiwa_sim.dialogue import DialogueLine, Direction
from iiwa_sim.frames import Frame
from iiwa_sim.recordings.scene import TCP, WORLD, Arm, in_namespace, stamp, transform
from iiwa_sim.recordings.schemas import (
    ARM,
    CELL,
    DIALOGUE,
    EVENTS,
    FRAMES,
    JOINTS,
    LOG,
    SCENE,
    STATE,
    WRENCH,
)
from iiwa_sim.recordings.watch import Event, Watch
from iiwa_sim.recordings.writer import Block, Head, Message, Writer
from iiwa_sim.robot.meshes import link_meshes
from iiwa_sim.robot.model import arm_model
from iiwa_sim.world.part import Part

if TYPE_CHECKING:
    from iiwa_sim.recordings.recordings import Source

SECOND_NS = 1_000_000_000
VIEW_RATE_HZ = 25
"""Rate of frames, joint states and wrench, in simulated time."""
BLOCKS_HZ = 20
"""Blocks per simulated second: 25 ticks at 500 Hz."""
_VIEW_PERIOD_NS = SECOND_NS // VIEW_RATE_HZ
_INFO, _WARNING, _ERROR = 2, 3, 4  # levels of foxglove.Log
_LEVELS = {"fault": _ERROR, "refused": _WARNING, "contact": _WARNING, "part slips": _WARNING}
_PER_MM, _PER_UNIT, _PER_N = 1e4, 1e7, 1e4
_FRAME = (_PER_MM,) * 3 + (_PER_UNIT,) * 3


class State(NamedTuple):
    """The state of a tick, whose JSON is made by the writing thread."""

    snapshot: Snapshot
    publish_ns: int
    """Real time since 1970."""


class Messages:
    """Makes the messages of blocks, in the writing thread."""

    def __init__(self, cell: Cell, log_ns: Callable[[int], int], namespace: str, shows_cell: bool) -> None:
        """`log_ns` gives the simulated time of a tick; `shows_cell` adds the frames of parts."""
        self._log_ns = log_ns
        self._namespace, self._shows_cell = namespace, shows_cell
        self._base = cell.base
        self._arm = Arm(arm_model(cell.description).links)
        self._joints = cell.description.joints
        self._due_ns = 0
        self._encode = msgspec.json.Encoder().encode

    def of(self, block: Block) -> Iterator[Message]:
        """Yield the messages of a block."""
        for each in block:
            if isinstance(each, Message):
                yield each
                continue
            log_ns = self._log_ns(each.snapshot.tick)
            state = _rounded(each.snapshot)
            yield Message(STATE, self._encode(state), log_ns, each.publish_ns)
            late_ns = log_ns - self._due_ns
            if late_ns >= 0:
                self._due_ns = log_ns + _VIEW_PERIOD_NS - (late_ns if late_ns < _VIEW_PERIOD_NS else 0)
                for topic, content in self._views(state, log_ns):
                    if self._namespace:
                        in_namespace(self._namespace, content)
                    yield Message(topic, self._encode(content), log_ns, each.publish_ns)

    def _views(self, state: dict[str, Any], log_ns: int) -> Iterator[tuple[str, Any]]:
        """Yield frames, joint states and wrench of a state."""
        time_of = stamp(log_ns)
        fx, fy, fz, tx, ty, tz = state["cartesian_force"]
        gripper = state.get("gripper")
        opening_mm = None if gripper is None else gripper.opening_mm
        names = ("name", "position", "velocity", "effort")
        columns = (state[f"joint_{name}"] for name in ("position", "velocity", "torque"))
        rows = zip(self._joints, *columns, strict=True)
        tool, goal = Frame(*state["tool_frame"]), Frame(*state["goal_frame"])
        bodies = (state["parts"], state["bodies"]) if self._shows_cell else ((), ())
        frames = self._arm.frames(log_ns, state["joint_position"], tool, goal, opening_mm, *bodies)
        if self._namespace:
            frames["transforms"].append(transform(time_of, WORLD, self._arm.base, self._base))
        yield FRAMES, frames
        yield JOINTS, {"timestamp": time_of, "joints": [dict(zip(names, row, strict=True)) for row in rows]}
        force, torque = {"x": fx, "y": fy, "z": fz}, {"x": tx, "y": ty, "z": tz}
        yield WRENCH, {"timestamp": time_of, "frame_id": TCP, "force": force, "torque": torque}


class Recorder:
    """Records one robot: from `start` to `stop`, both called between two ticks, then `finish`.

    Times are simulated, since the start of the simulator; the `publish_time` of each message is real. States
    come once in `tick_rate_hz / rate_hz` ticks, the first and the last one in any case. Where nobody waits
    for real time, ticks wait for a file that is too slow; elsewhere messages are lost.
    """

    def __init__(
        self,
        source: "Source",
        clock: Clock,
        rate_hz: int | None = None,
        namespace: str = "",
        shows_cell: bool = True,
    ) -> None:
        """`rate_hz` is that of states, None for every tick.

        Of several robots in a file each has a namespace, and one of them shows surfaces and parts. Nothing of
        the controller is read before `start`. Raises ValueError for a rate outside 1 to that of the ticks.
        """
        self._source, self._clock, self._tick_rate_hz = source, clock, clock.rate_hz
        self._controller, self._cell = source.controller, source.cell
        self._rate_hz = self._tick_rate_hz if rate_hz is None else rate_hz
        if not 1 <= self._rate_hz <= self._tick_rate_hz:
            raise ValueError(
                f"record_rate_hz is {rate_hz}, expected 1 to {self._tick_rate_hz}, that of the ticks"
            )
        self._due = 0  # in parts of 1 / tick_rate_hz of a state
        self._began_ns = time.time_ns()
        self._clocks_apart_ns = self._began_ns - time.monotonic_ns()
        self._surfaces: list[Surface] = []
        self._parts: list[Part] = []
        self._watch: Watch | None = None
        self._last_state = -1  # its tick
        self._block: list[State | Message] = []
        self._block_due = 0  # a tick
        self._encode = msgspec.json.Encoder().encode
        cell = self._cell
        description = cell.description
        self._arm = Arm(arm_model(description).links, description.flange, cell.tool)
        self.namespace, self._shows_cell = namespace, shows_cell
        self.head = {
            "version": metadata.version("iiwa-sim"),
            "robot": description.name,
            "joints": " ".join(description.joints),
            "flange": description.flange,
            "clock": clock.told,
            "rate_hz": str(self._tick_rate_hz),
            "record_rate_hz": str(self._rate_hz),
            "seed": "none" if cell.noise_levels is None else str(cell.noise_levels.seed),
            "began": datetime.fromtimestamp(self._began_ns / SECOND_NS, UTC).isoformat(),
            "protocols": " ".join(source.protocols),
        }
        """The metadata of its recording."""
        self._messages = Messages(cell, self._log_ns, namespace, shows_cell)
        self.out: Writer
        """The file, which other robots may share."""

    def open(self, path: Path, others: Sequence["Recorder"] = ()) -> None:
        """Open a file for this recorder, and `others` with other namespaces. Raises RecordingFault."""
        head, attachments, namespaces = self.head, _attachments(self._cell), [""]
        if others:
            robots = {each.namespace: each for each in (self, *others)}
            head = {"version": head["version"], "robots": " ".join(robots)}
            head |= {f"{name}/{key}": each.head[key] for name, each in robots.items() for key in each.head}
            found = {name: _attachments(each._cell) for name, each in robots.items()}
            attachments = {f"{name}/{key}": file for name in found for key, file in found[name].items()}
            namespaces = [f"/{name}" for name in robots]
        writer = Writer(path, Head(head, attachments, self._began_ns), namespaces)
        for each in (self, *others):
            each._began_ns = self._began_ns
            each.out = writer

    def start(self) -> None:
        """Record from the present tick on."""
        source = self._source
        self._watch = Watch(self._controller, lambda: self._clock.told, self.event)
        source.dialogue.listeners.append(self._hear)
        source.log.on_refused.append(self.refused)
        source.events.listeners.append(self)
        source.backdoor.listeners.append(self.backdoor)
        self._show_arm()
        self._show_scene()
        self._add_state()
        for session, protocol in source.wire.peers():
            now = self._controller.tick, time.monotonic_ns()
            spoken = protocol or source.protocols[0]
            self._hear(DialogueLine(session, Direction.EVENT, "connected", *now, protocol=spoken))

    def stop(self) -> None:
        """Record no more. Does nothing a second time."""
        if self._watch is None:
            return
        if self._last_state != self._controller.tick:
            self._add_state()
        self._hand_over()
        self._watch.close()
        self._watch, source = None, self._source
        source.dialogue.listeners.remove(self._hear)
        source.log.on_refused.remove(self.refused)
        source.events.listeners.remove(self)
        source.backdoor.listeners.remove(self.backdoor)

    def finish(self) -> bool:
        """Write the rest and the end of the file; returns True if it is whole."""
        return self.out.close()

    @property
    def lost(self) -> int:
        """Messages that found no room."""
        return self.out.dropped

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

    @property
    def has_commands(self) -> bool:
        """False: a recorder never makes the robot move."""
        return False

    def event(self, event: Event) -> None:
        """Record something that has happened."""
        real_ns = time.time_ns()
        told = {
            **self._when(self._controller.tick, real_ns),
            "kind": event.kind,
            "move": event.move,
            "code": event.code,
            "text": event.text,
            "goal_frame": event.goal,
        }
        self._put(EVENTS, told, real_ns)
        self._put(LOG, self._logged(event), real_ns)
        self._hasten()

    def fault(self, code: int, reason: str) -> None:
        """The robot has met with something between commands."""
        if self._watch is not None:
            self._watch.fault(code, reason)

    def refused(self, session: str, line: str, code: int, reason: str) -> None:
        """A line of a session was refused."""
        self.event(Event("refused", f"{session} '{line}': {reason}", code=code))

    def contact(self, move: int, text: str) -> None:
        """A force has ended a move."""
        self.event(Event("contact", text, move))

    def touch(self, text: str) -> None:
        """A link begins to touch something."""
        self.event(Event("touch", text))

    def part(self, text: str, slips: bool) -> None:
        """A part is gripped, let go, slips out of the jaws, or is made to go."""
        self.event(Event("part slips" if slips else "part", text))

    def backdoor(self, call: str) -> None:
        """A test bench has done something, which may have changed the scene."""
        self.event(Event("backdoor", call))
        if self._watch is not None:
            self._watch.look()
        surfaces = list(self._controller.load.world.surfaces.values())
        if surfaces != self._surfaces or parts_of(self._controller) != self._parts:
            self._show_scene()

    def _hear(self, said: DialogueLine) -> None:
        carried_out = said.direction is not Direction.FROM_CLIENT
        if carried_out and self._watch is not None:
            self._watch.look()
        real_ns = said.instant_ns + self._clocks_apart_ns
        told = {
            **self._when(said.tick, real_ns),
            "session": said.session,
            "direction": said.direction.value,
            "text": said.text,
            "reason": said.reason,
            "protocol": said.protocol,
        }
        self._put(DIALOGUE, told, real_ns, said.tick)
        if carried_out:
            self._hasten()

    def _log_ns(self, tick: int) -> int:
        """Return the simulated time of a tick."""
        return tick * SECOND_NS // self._tick_rate_hz

    def _when(self, tick: int, real_ns: int) -> dict[str, Any]:
        return {
            "time_s": round(tick / self._tick_rate_hz, 9),
            "tick": tick,
            "real_s": round((real_ns - self._began_ns) / SECOND_NS, 6),
        }

    def _add_state(self) -> None:
        self._last_state = self._controller.tick
        self._block.append(State(snapshot(self._controller), time.time_ns()))

    def _put(self, topic: str, content: Any, real_ns: int, tick: int | None = None) -> None:
        log_ns = self._log_ns(self._controller.tick if tick is None else tick)
        if self.namespace and topic in (SCENE, ARM):
            in_namespace(self.namespace, content)
        self._block.append(Message(topic, self._encode(content), log_ns, real_ns))

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
            self.out.put(block, self._made, can_wait=self._in_haste)

    def _made(self, block: Block) -> Iterator[Message]:
        """Yield the messages of a block, in the writing thread."""
        for message in self._messages.of(block):
            yield message._replace(topic=f"/{self.namespace}{message.topic}") if self.namespace else message

    def _show_arm(self) -> None:
        description = self._cell.description
        meshes = link_meshes(description.urdf, description.urdf_path)
        self._put(ARM, self._arm.model(self._log_ns(self._controller.tick), meshes), time.time_ns())

    def _show_scene(self) -> None:
        log_ns, real_ns = self._log_ns(self._controller.tick), time.time_ns()
        self._surfaces = list(self._controller.load.world.surfaces.values())
        self._parts = parts_of(self._controller)
        radius_m = self._cell.contact_radius_m if self._surfaces else 0.0
        jaw_m = jaw_m_of(self._controller)
        shown = self._surfaces, self._parts, bodies_of(self._controller)
        surfaces, *bodies = shown if self._shows_cell else ((), (), ())
        self._put(SCENE, self._arm.scene(log_ns, surfaces, radius_m, jaw_m, *bodies), real_ns)
        self._put(CELL, described_cell(self._controller), real_ns)

    def _logged(self, event: Event) -> dict[str, Any]:
        code = f"({event.code})" if event.code else ""
        head = " ".join(f"{event.kind} {event.move or ''} {code}".split())
        return {
            "timestamp": stamp(self._log_ns(self._controller.tick)),
            "level": _LEVELS.get(event.kind, _INFO),
            "message": f"{head}: {event.text}" if event.text else head,
            "name": "iiwa-sim",
            "file": "",
            "line": 0,
        }


def _rounded(state: Snapshot) -> dict[str, Any]:
    """Return a state as it is recorded: without a gripper that is not there, and with numbers that follow
    from joint positions rounded to 0.1 um, 1e-7 rad, 1e-7 rad/s, 1e-4 N and Nm: in full they are half of a
    file."""
    told = msgspec.structs.asdict(state)
    told["joint_velocity"] = [floor(each * _PER_UNIT + 0.5) / _PER_UNIT for each in state.joint_velocity]
    for name in ("cartesian_force", "joint_torque"):
        if any(told[name]):
            told[name] = [floor(each * _PER_N + 0.5) / _PER_N for each in told[name]]
    for name in ("flange_frame", "tool_frame", "goal_frame"):
        frame = zip(told[name], _FRAME, strict=True)
        told[name] = [floor(each * steps + 0.5) / steps for each, steps in frame]
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

"""A robot recorded while it runs: what is put into a recording, and when."""

import time
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from importlib import metadata
from math import floor
from pathlib import Path
from typing import Any

import msgspec
from msgspec import structs

from iiwa_sim.backdoor.described import described_cell, jaw_m_of, parts_of
from iiwa_sim.cell.cell import Cell
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.state import Snapshot, snapshot
from iiwa_sim.protocols.dialogue import Dialogue, DialogueLine, Direction
from iiwa_sim.recordings import watch
from iiwa_sim.recordings.attachments import attachments_of
from iiwa_sim.recordings.foxglove import stamp
from iiwa_sim.recordings.handed import Beginning, Handed, Ready, Said
from iiwa_sim.recordings.scene import Arm
from iiwa_sim.recordings.schemas import ARM, CELL, EVENTS, LOG, SCENE, STATE
from iiwa_sim.recordings.times import SECOND_NS, Times
from iiwa_sim.recordings.watch import Event, Watch
from iiwa_sim.recordings.writer import Writer
from iiwa_sim.robot.meshes import link_meshes
from iiwa_sim.robot.model import arm_model
from iiwa_sim.world.part import Part

_INFO, _WARNING, _ERROR = 2, 3, 4  # levels of foxglove.Log
_LEVELS = {
    watch.FAULT: _ERROR,
    watch.LOST: _ERROR,
    watch.REFUSED: _WARNING,
    watch.CONTACT: _WARNING,
    watch.SLIPS: _WARNING,
}
_PER_MM, _PER_UNIT, _PER_N = 1e4, 1e7, 1e4
_FRAME = (_PER_MM,) * 3 + (_PER_UNIT,) * 3
BLOCKS_HZ = 20
"""So often in a simulated second all is put, that of 25 ticks at 500 Hz: in 30 us, since it is little."""


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
        self._surfaces: list[Surface] = []
        self._parts: list[Part] = []
        self._watch: Watch | None = None
        self._last_state = -1  # its tick
        self._waiting: list[Handed] = []
        self._block_due = 0  # a tick
        self._encode = msgspec.json.Encoder().encode
        description = cell.description
        self._arm = Arm(arm_model(description).links, description.flange, cell.tool)
        self._beginning = Beginning(
            description,
            {
                "version": metadata.version("iiwa-sim"),
                "robot": description.name,
                "joints": " ".join(description.joints),
                "flange": description.flange,
                "clock": clock(),
                "rate_hz": str(tick_rate_hz),
                "record_rate_hz": str(self._rate_hz),
                "seed": "none" if cell.noise_levels is None else str(cell.noise_levels.seed),
                "began": datetime.fromtimestamp(self._began_ns / SECOND_NS, UTC).isoformat(),
                **(said_of_it or {}),
            },
            attachments_of(cell),
            tick_rate_hz,
            self._began_ns,
            self._began_ns,
        )
        self._times = Times(tick_rate_hz, self._began_ns, self._began_ns)
        self._out = Writer(path)

    def start(self, there: Sequence[tuple[str, str]] = ()) -> None:
        """Record from the present tick on; `there` are sessions that are connected, with their protocols."""
        self._times.epoch_ns += self._began_ns - self._times.log_ns(self._controller.tick)
        self._out.begin(structs.replace(self._beginning, epoch_ns=self._times.epoch_ns))
        self._watch = Watch(self._controller, self._clock, self.event)
        self._dialogue.listeners.append(self._hear)
        self._show_arm()
        self._show_scene()
        self._add_state()
        for session, protocol in there:
            now = self._controller.tick, time.monotonic_ns()
            self._hear(DialogueLine(session, Direction.EVENT, "connected", *now, protocol=protocol))

    def stop(self) -> None:
        """Record no more. Does nothing a second time."""
        if self._watch is None:
            return
        if self._last_state != self._controller.tick:
            self._add_state()
        self._hand_over()
        self._watch.close()
        self._watch = None
        self._dialogue.listeners.remove(self._hear)

    def finish(self) -> bool:
        """Have what waits and the end of the file written; whether the file is whole then."""
        return self._out.close()

    @property
    def writing_process(self) -> int:
        """The number of the process that writes."""
        return self._out.process

    @property
    def lost(self) -> int:
        """Messages that found no room."""
        return self._out.lost

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
        """Whether it has to see each tick, also of a robot at rest."""
        return self._watch is not None

    @property
    def has_commands(self) -> bool:
        """False: a recorder never makes the robot move."""
        return False

    def event(self, event: Event) -> None:
        """Something has happened."""
        tick, real_ns = self._controller.tick, time.time_ns()
        told = {
            **self._times.when(tick, real_ns),
            "kind": event.kind,
            "move": event.move,
            "code": event.code,
            "text": event.text,
            "goal_frame": event.goal,
        }
        self._put(Ready(EVENTS, self._encode(told), tick, real_ns))
        self._put(Ready(LOG, self._encode(self._logged(event)), tick, real_ns))
        self._hasten()

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

    def touch(self, text: str) -> None:
        """A link begins to touch something."""
        self.event(Event(watch.TOUCH, text))

    def part(self, text: str, slips: bool) -> None:
        """A part is gripped, let go, slips out of the jaws, or is made to go."""
        self.event(Event(watch.SLIPS if slips else watch.PART, text))

    def backdoor(self, call: str) -> None:
        """A test bench has done something, which may have changed the scene."""
        self.event(Event(watch.BACKDOOR, call))
        if self._watch is not None:
            self._watch.look()
        surfaces = list(self._controller.load.world.surfaces.values())
        if surfaces != self._surfaces or parts_of(self._controller) != self._parts:
            self._show_scene()

    def _hear(self, said: DialogueLine) -> None:
        carried_out = said.direction is not Direction.FROM_CLIENT
        if carried_out and self._watch is not None:
            self._watch.look()
        self._put(Said(said, said.instant_ns + self._clocks_apart_ns))
        if carried_out:
            self._hasten()

    def _add_state(self) -> None:
        self._last_state = tick = self._controller.tick
        self._put(Ready(STATE, self._encode(_rounded(snapshot(self._controller))), tick, time.time_ns()))

    def _put(self, handed: Handed) -> None:
        self._waiting.append(handed)

    def _hasten(self) -> None:
        """Where ticks do not follow real time, the next one may never come: hand over what there is."""
        if self._in_haste():
            self._hand_over()

    def _hand_over(self) -> None:
        self._block_due = self._controller.tick + max(self._tick_rate_hz // BLOCKS_HZ, 1)
        waiting, self._waiting = self._waiting, []
        self._out.put(waiting, can_wait=self._in_haste())

    def _show_arm(self) -> None:
        description, tick = self._cell.description, self._controller.tick
        meshes = link_meshes(description.urdf, description.urdf_path)
        model = self._arm.model(self._times.log_ns(tick), meshes)
        self._put(Ready(ARM, self._encode(model), tick, time.time_ns()))

    def _show_scene(self) -> None:
        world, tick = self._controller.load.world, self._controller.tick
        self._surfaces, self._parts = list(world.surfaces.values()), parts_of(self._controller)
        radius_m = self._cell.contact_radius_m if self._surfaces else 0.0
        jaw_m = jaw_m_of(self._controller)
        scene = self._arm.scene(self._times.log_ns(tick), self._surfaces, radius_m, jaw_m, self._parts)
        real_ns = time.time_ns()
        self._put(Ready(SCENE, self._encode(scene), tick, real_ns))
        self._put(Ready(CELL, self._encode(described_cell(self._controller)), tick, real_ns))

    def _logged(self, event: Event) -> dict[str, Any]:
        words = [event.kind, f"{event.move}" if event.move else "", f"({event.code})" if event.code else ""]
        head = " ".join(word for word in words if word)
        return {
            "timestamp": stamp(self._times.log_ns(self._controller.tick)),
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
    told = structs.asdict(state)
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

"""Recordings read: whole ones, and those that were cut off, up to the last whole chunk."""

import struct
import tempfile
from bisect import bisect_left, bisect_right
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeVar

import msgspec
from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, DataEnd, Footer, Header, McapRecord, Metadata
from mcap.records import Message as McapMessage
from mcap.stream_reader import StreamReader
from zstandard import ZstdError

from iiwa_sim.controller.state import Snapshot
from iiwa_sim.dialogue import DialogueLine, Direction
from iiwa_sim.recordings.fault import RecordingFault
from iiwa_sim.recordings.schemas import CELL, DIALOGUE, EVENTS, STATE
from iiwa_sim.recordings.writer import METADATA
from iiwa_sim.robot.description import SETTINGS_FILE, URDF_FILE, RobotDescription, load_robot
from iiwa_sim.transcript.lines import Transcript, read
from iiwa_sim.transcript.record import Lines

MOST_STATES = 60_000
"""States of a `Timeline`, two minutes at 500 Hz."""
LARGEST_RECORD = 64 * 1024 * 1024
"""Bytes; ours have some 100 kB. What says that it is larger is damaged."""

EXPECTED = "expected a recording of iiwa-sim, in MCAP"
DAMAGED = (McapError, ZstdError, ValueError, struct.error, MemoryError, KeyError, IndexError, RuntimeError)
"""Errors that mcap and the libraries below it raise for a damaged file."""


Content = dict[str, Any]
NO_CELL: Content = {
    "contact_radius_mm": 0.0,
    **{key: [] for key in ("inputs", "outputs", "surfaces", "parts", "jaw_mm", "tool_capsules")},
}
_SLACK_S = 1e-6  # of times told in seconds; a tick takes a thousand times that


class Head(NamedTuple):
    """Metadata of a recording."""

    metadata: dict[str, str]
    attachments: dict[str, bytes]
    """Attachments by their names: robot.urdf, robot.toml, and cell.toml where there was one."""

    @property
    def tick_rate_hz(self) -> int:
        """Ticks per second of the robot."""
        return int(self.metadata["rate_hz"])

    @property
    def joints(self) -> list[str]:
        """Names of the robot's joints, base first."""
        return self.metadata.get("joints", "").split()


class Read(NamedTuple):
    """A message."""

    topic: str
    log_ns: int
    """Simulated, told from the instant at which the recording began, since 1970."""
    publish_ns: int
    """Real, since 1970."""
    number: int
    """Among all, in the order in which they were recorded."""
    data: bytes
    """JSON."""


class Spoken(msgspec.Struct):
    """A line of the dialogue, as `iiwa_sim.dialogue` tells it."""

    time_s: float
    tick: int
    real_s: float
    session: str
    direction: Literal[">", "<", "#", "~"]
    text: str
    reason: str
    protocol: str


class _Ticked(msgspec.Struct):
    tick: int


class Happened(msgspec.Struct):
    """An event, as `iiwa_sim.recordings.watch` tells it."""

    time_s: float
    tick: int
    real_s: float
    kind: str
    move: int
    code: int
    text: str
    goal_frame: tuple[float, ...]


T = TypeVar("T")


class Recorded:
    """A file that `iiwa-sim` has recorded."""

    def __init__(self, path: Path) -> None:
        """Reads its head. Raises RecordingFault for a file that is no recording of ours, or not there."""
        self.path = path
        self.cut = False
        """True if its end was missing or damaged when `messages` came to it."""
        self.cut_at_s: float | None = None
        """Up to when it could be read then (s, simulated, since the start of the simulator); None where not
        even the time was."""
        self.head = Head({}, {})  # while it is read
        metadata: dict[str, str] = {}
        attachments: dict[str, bytes] = {}
        for record in self._records():
            if isinstance(record, Metadata) and record.name == METADATA:
                metadata = record.metadata
            elif isinstance(record, Attachment):
                attachments[record.name] = record.data
            elif not isinstance(record, Header):
                break
        self.head = Head(metadata, attachments)
        if not metadata.get("rate_hz", "").isdigit() or int(metadata["rate_hz"]) == 0:
            raise RecordingFault(f"{path}: {EXPECTED}")

    def messages(self, topics: Collection[str] = (STATE, DIALOGUE, EVENTS)) -> Iterator[Read]:
        """Yield the messages of these topics in their recorded order."""
        names: dict[int, str] = {}
        for record in self._records():
            if isinstance(record, McapMessage):
                topic = names.get(record.channel_id, "")
                if topic in topics:
                    yield Read(topic, record.log_time, record.publish_time, record.sequence, record.data)
            elif isinstance(record, Channel):
                names[record.id] = record.topic
            elif isinstance(record, DataEnd):
                return

    def states(self) -> Iterator[Snapshot]:
        """States of the robot, in the order of time. Raises RecordingFault for a message that is none."""
        for state in self._decoded(STATE, Snapshot):
            if len(state.joint_position) != len(self.head.joints):
                raise RecordingFault(f"{self.path}: {STATE}: expected {len(self.head.joints)} joints")
            yield state

    def dialogue(self) -> Iterator[Spoken]:
        """Yield the dialogue. Raises RecordingFault for a message that is no line of a dialogue."""
        return self._decoded(DIALOGUE, Spoken)

    def events(self) -> Iterator[Happened]:
        """Yield the events. Raises RecordingFault for a message that is no event."""
        return self._decoded(EVENTS, Happened)

    def said_and_happened(self) -> Iterator[Spoken | Happened]:
        """Dialogue and events in the order in which they were recorded. Raises RecordingFault as they do."""
        kinds: dict[str, type[Spoken | Happened]] = {DIALOGUE: Spoken, EVENTS: Happened}
        for message in self.messages((DIALOGUE, EVENTS)):
            yield self.content(message, kinds[message.topic])

    def content(self, message: Read, kind: type[T]) -> T:
        """Decode a message. Raises RecordingFault."""
        try:
            return msgspec.json.decode(message.data, type=kind)
        except (msgspec.DecodeError, UnicodeDecodeError) as fault:
            told = f"{self.path}: {message.topic}: expected messages as iiwa-sim writes them: {fault}"
            raise RecordingFault(told) from None

    def description(self) -> RobotDescription:
        """Load the robot whose files are attached. Raises RobotFault."""
        with tempfile.TemporaryDirectory() as folder:
            for name in (SETTINGS_FILE, URDF_FILE):
                Path(folder, name).write_bytes(self.head.attachments.get(name, b""))
            return load_robot(folder)

    def _decoded(self, topic: str, kind: type[T]) -> Iterator[T]:
        return (self.content(message, kind) for message in self.messages((topic,)))

    def _records(self) -> Iterator[McapRecord]:
        """Up to the end, or to what is damaged. Raises RecordingFault where that is the beginning."""
        found, epoch_ns, last_ns = False, None, 0
        try:
            with self.path.open("rb") as stream:
                reader = StreamReader(stream, validate_crcs=True, record_size_limit=LARGEST_RECORD)
                for record in reader.records:
                    found = True
                    if isinstance(record, McapMessage):
                        last_ns = record.log_time
                        if epoch_ns is None:
                            epoch_ns = self._epoch_ns(record)
                    yield record
                    if isinstance(record, Footer):
                        return
        except OSError as fault:
            raise RecordingFault(f"{self.path}: cannot be read: {fault.strerror}") from None
        except DAMAGED:
            if not found:
                raise RecordingFault(f"{self.path}: {EXPECTED}") from None
            self.cut = True
            self.cut_at_s = None if epoch_ns is None else 1e-9 * (last_ns - epoch_ns)

    def _epoch_ns(self, message: McapMessage) -> int | None:
        """The instant of tick 0, where a message tells its tick."""
        try:
            tick = msgspec.json.decode(message.data, type=_Ticked).tick
        except (msgspec.DecodeError, UnicodeDecodeError):
            return None
        return int(message.log_time) - tick * 1_000_000_000 // self.head.tick_rate_hz


class _Track(NamedTuple):
    """Messages of one topic in the order of time."""

    times_s: list[float]
    messages: list[Read]

    def up_to(self, time_s: float) -> int:
        """Return the number of messages at or before a time."""
        return bisect_right(self.times_s, time_s + _SLACK_S)


class Timeline:
    """A recording by time, for a viewer.

    Times are simulated seconds since the start of the simulator. Of more than `MOST_STATES` states only every
    second, fourth ... is kept. Contents have the keys and units of the messages of the recording.
    """

    def __init__(self, path: Path) -> None:
        """Read the file. Raises RecordingFault, also if it has no state."""
        self._recorded = recorded = Recorded(path)
        self.path = path
        self.head = recorded.head
        self._tracks = {topic: _Track([], []) for topic in (STATE, DIALOGUE, EVENTS, CELL)}
        first = next(recorded.messages((STATE,)), None)
        if first is None:
            raise RecordingFault(f"{path}: expected a state of the robot in it")
        tick = recorded.content(first, _Ticked).tick
        epoch_ns = first.log_ns - tick * 1_000_000_000 // self.head.tick_rate_hz
        stride, count = 1, 0
        for message in recorded.messages(tuple(self._tracks)):
            track = self._tracks[message.topic]
            if message.topic == STATE:
                count += 1
                if (count - 1) % stride:
                    continue
                if len(track.messages) == MOST_STATES:
                    del track.times_s[1::2], track.messages[1::2]
                    stride *= 2
            track.times_s.append(1e-9 * (message.log_ns - epoch_ns))
            track.messages.append(message)
        states = self._tracks[STATE]
        self.start_s, self.end_s = states.times_s[0], states.times_s[-1]

    @property
    def cut(self) -> bool:
        """True if the end of the file is missing or damaged."""
        return self._recorded.cut

    @property
    def cut_at_s(self) -> float:
        """Time up to which the file can be read."""
        return self.end_s

    def state_at(self, time_s: float) -> Content:
        """Return the last state at or before a time; the first one if there is none."""
        track = self._tracks[STATE]
        return self._content(track.messages[max(track.up_to(time_s) - 1, 0)])

    def states(self, from_s: float, to_s: float, at_most: int) -> list[Content]:
        """Return the states of a span, evenly thinned out to `at_most`."""
        track = self._tracks[STATE]
        found = track.messages[bisect_left(track.times_s, from_s - _SLACK_S) : track.up_to(to_s)]
        return [self._content(each) for each in found[:: -(-len(found) // at_most) or 1]]

    def said(self, time_s: float, count: int) -> list[Content]:
        """Return the last `count` lines of the dialogue up to a time."""
        return self._last(DIALOGUE, time_s, count)

    def happened(self, time_s: float, count: int) -> list[Content]:
        """Return the last `count` events up to a time."""
        return self._last(EVENTS, time_s, count)

    def cell_at(self, time_s: float) -> Content:
        """Return the surroundings of the robot at a time, with the keys and units of a cell.toml."""
        track = self._tracks[CELL]
        return self._content(track.messages[max(track.up_to(time_s) - 1, 0)]) if track.messages else NO_CELL

    def _last(self, topic: str, time_s: float, count: int) -> list[Content]:
        end = self._tracks[topic].up_to(time_s)
        return [self._content(each) for each in self._tracks[topic].messages[max(end - count, 0) : end]]

    def _content(self, message: Read) -> Content:
        return self._recorded.content(message, dict[str, Any])


def transcript_of(recorded: Recorded) -> Transcript:
    """Return the dialogue as a transcript, at its simulated times since the recording began.

    A line without its reply, at the end of a recording that was cut off, is left out. Raises RecordingFault,
    and TranscriptFault for a dialogue that makes no sense.
    """
    protocols = recorded.head.metadata.get("protocols", "").split()
    if not protocols:
        raise RecordingFault(f"{recorded.path}: it does not tell its protocols")
    lines = Lines(protocols, 0)
    text = [lines.header(f"from {recorded.path.name}")]
    start = next(recorded.states(), None)
    start_s = 0.0 if start is None else start.time_s
    for spoken in _answered(recorded):
        told = DialogueLine(
            spoken.session,
            Direction(spoken.direction),
            spoken.text,
            spoken.tick,
            round(spoken.real_s * 1e9),
            spoken.reason,
            spoken.protocol,
        )
        text.append(lines.line(told, max(0.0, spoken.time_s - start_s)) + "\n")
    return read(str(recorded.path), "".join(text))


def _answered(recorded: Recorded) -> Iterator[Spoken]:
    """Yield the dialogue without lines and replies that have lost each other."""
    unanswered: dict[str, Spoken] = {}
    for spoken in recorded.dialogue():
        if spoken.direction == Direction.FROM_CLIENT.value:
            unanswered[spoken.session] = spoken
        elif spoken.direction == Direction.TO_CLIENT.value:
            line = unanswered.pop(spoken.session, None)
            if line is not None:
                yield line
                yield spoken
        else:
            yield spoken

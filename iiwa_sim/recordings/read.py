"""Recordings read: whole ones, and those that were cut off, up to the last whole chunk."""

import struct
import tempfile
from bisect import bisect_left, bisect_right
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import msgspec
from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, DataEnd, Footer, Header, McapRecord, Message, Metadata
from mcap.stream_reader import StreamReader
from zstandard import ZstdError

from iiwa_sim.controller.state import Snapshot
from iiwa_sim.dialogue import DialogueLine, Direction
from iiwa_sim.recordings.recordings import RecordingFault
from iiwa_sim.recordings.schemas import CELL, DIALOGUE, EVENTS, METADATA, STATE, Event, Spoken
from iiwa_sim.robot.description import SETTINGS_FILE, URDF_FILE, RobotDescription, load_robot
from iiwa_sim.transcript.lines import Transcript, read
from iiwa_sim.transcript.record import Lines

SUFFIX = ".mcap"
MOST_STATES = 60_000
"""States of a `Timeline`, two minutes at 500 Hz."""
LARGEST_RECORD = 64 * 1024 * 1024
"""Bytes; ours have some 100 kB. What says that it is larger is damaged."""
EXPECTED = "expected a recording of iiwa-sim, in MCAP"
DAMAGED = (McapError, ZstdError, ValueError, struct.error, MemoryError, KeyError, IndexError, RuntimeError)
"""Errors that mcap and the libraries below it raise for a damaged file."""
NO_CELL: dict[str, Any] = {
    "contact_radius_mm": 0.0,
    **{key: [] for key in ("inputs", "outputs", "surfaces", "parts", "bodies", "jaw_mm", "tool_capsules")},
}
_SLACK_S = 1e-6  # of times told in seconds; a tick takes a thousand times that

Content = dict[str, Any]
T = TypeVar("T")


KINDS: dict[str, type[Any]] = {STATE: Snapshot, DIALOGUE: Spoken, EVENTS: Event}


class Recorded:
    """A robot in a file that `iiwa-sim` has recorded."""

    def __init__(self, path: Path) -> None:
        """Read its head; `FILE.mcap:NAME` is one of several robots, the first of them without a name.

        Raises RecordingFault for a file that is no recording of ours, or not there.
        """
        name, ending, robot = str(path).rpartition(f"{SUFFIX}:")
        self.path = Path(f"{name}{SUFFIX}") if ending else path
        self.cut_at_s: float | None = None
        """The time up to which a file without its end can be read (s), when `messages` has come to it."""
        self.metadata: dict[str, str] = {}
        self.attachments: dict[str, bytes] = {}
        """Attachments by their names: robot.urdf, robot.toml, and cell.toml where there was one."""
        for record in self._records():
            if isinstance(record, Metadata) and record.name == METADATA:
                self.metadata = record.metadata
            elif isinstance(record, Attachment):
                self.attachments[record.name] = record.data
            elif not isinstance(record, Header):
                break
        self._space = ""
        if robots := self.metadata.get("robots", "").split():
            space = f"{robot if ending else robots[0]}/"
            if space[:-1] not in robots:
                raise RecordingFault(f"{path}: expected {' or '.join(robots)} behind the colon")
            self.metadata = {key.removeprefix(space): each for key, each in self.metadata.items()}
            self.attachments = {key.removeprefix(space): each for key, each in self.attachments.items()}
            self._space = f"/{space[:-1]}"
        rate_hz = self.metadata.get("rate_hz", "")
        if not rate_hz.isdigit() or int(rate_hz) == 0:
            raise RecordingFault(f"{path}: {EXPECTED}")
        self.tick_rate_hz = int(rate_hz)
        self.joints = self.metadata.get("joints", "").split()
        """Names of the robot's joints, base first."""

    def messages(self, topics: Collection[str]) -> Iterator[tuple[str, Message]]:
        """Yield the messages of these topics in their recorded order. `log_time` is simulated time."""
        names: dict[int, str] = {}
        for record in self._records():
            if isinstance(record, Message):
                topic = names.get(record.channel_id, "").removeprefix(self._space)
                if topic in topics:
                    yield topic, record
            elif isinstance(record, Channel):
                names[record.id] = record.topic
            elif isinstance(record, DataEnd):
                return

    def contents(self, *topics: str) -> Iterator[Any]:
        """Yield states, dialogue or events, as Snapshot, Spoken and Event. Raises RecordingFault."""
        for topic, message in self.messages(topics):
            content = self.content(topic, message, KINDS[topic])
            if isinstance(content, Snapshot) and len(content.joint_position) != len(self.joints):
                raise RecordingFault(f"{self.path}: {STATE}: expected {len(self.joints)} joints")
            yield content

    def content(self, topic: str, message: Message, kind: type[T]) -> T:
        """Decode a message. Raises RecordingFault."""
        try:
            return msgspec.json.decode(message.data, type=kind)
        except (msgspec.DecodeError, UnicodeDecodeError) as fault:
            told = f"{self.path}: {topic}: expected messages as iiwa-sim writes them: {fault}"
            raise RecordingFault(told) from None

    def description(self) -> RobotDescription:
        """Load the robot whose files are attached. Raises RobotFault."""
        with tempfile.TemporaryDirectory() as folder:
            for name in (SETTINGS_FILE, URDF_FILE):
                Path(folder, name).write_bytes(self.attachments.get(name, b""))
            return load_robot(folder)

    def _records(self) -> Iterator[McapRecord]:
        """Up to the end, or to what is damaged. Raises RecordingFault where that is the beginning."""
        last_ns = None
        try:
            with self.path.open("rb") as stream:
                reader = StreamReader(stream, validate_crcs=True, record_size_limit=LARGEST_RECORD)
                for record in reader.records:
                    last_ns = record.log_time if isinstance(record, Message) else last_ns or 0
                    yield record
                    if isinstance(record, Footer):
                        return
        except OSError as fault:
            raise RecordingFault(f"{self.path}: cannot be read: {fault.strerror}") from None
        except DAMAGED:
            if last_ns is None:
                raise RecordingFault(f"{self.path}: {EXPECTED}") from None
            self.cut_at_s = 1e-9 * last_ns


class _Track(NamedTuple):
    """Messages of one topic in the order of time."""

    times_s: list[float]
    messages: list[Message]

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
        self.recorded = recorded = Recorded(path)
        self._tracks = {topic: _Track([], []) for topic in (STATE, DIALOGUE, EVENTS, CELL)}
        stride, count = 1, 0
        for topic, message in recorded.messages(self._tracks):
            track = self._tracks[topic]
            if topic == STATE:
                count += 1
                if (count - 1) % stride:
                    continue
                if len(track.messages) == MOST_STATES:
                    del track.times_s[1::2], track.messages[1::2]
                    stride *= 2
            track.times_s.append(1e-9 * message.log_time)
            track.messages.append(message)
        if not count:
            raise RecordingFault(f"{path}: expected a state of the robot in it")
        times_s = self._tracks[STATE].times_s
        self.start_s, self.end_s = times_s[0], times_s[-1]

    def state_at(self, time_s: float) -> Content:
        """Return the last state at or before a time; the first one if there is none."""
        track = self._tracks[STATE]
        return self._content(STATE, track.messages[max(track.up_to(time_s) - 1, 0)])

    def states(self, from_s: float, to_s: float, at_most: int) -> list[Content]:
        """Return the states of a span, evenly thinned out to `at_most`."""
        track = self._tracks[STATE]
        found = track.messages[bisect_left(track.times_s, from_s - _SLACK_S) : track.up_to(to_s)]
        return [self._content(STATE, each) for each in found[:: -(-len(found) // at_most) or 1]]

    def last(self, topic: str, time_s: float, count: int) -> list[Content]:
        """Return the last `count` lines of the dialogue, or events, up to a time."""
        track = self._tracks[topic]
        end = track.up_to(time_s)
        return [self._content(topic, each) for each in track.messages[max(end - count, 0) : end]]

    def cell_at(self, time_s: float) -> Content:
        """Return the surroundings of the robot at a time, with the keys and units of a cell.toml."""
        track = self._tracks[CELL]
        place = max(track.up_to(time_s) - 1, 0)
        return self._content(CELL, track.messages[place]) if track.messages else NO_CELL

    def _content(self, topic: str, message: Message) -> Content:
        return self.recorded.content(topic, message, dict[str, Any])


def transcript_of(recorded: Recorded) -> Transcript:
    """Return the dialogue as a transcript, at its simulated times since the recording began.

    A line without its reply, at the end of a recording that was cut off, is left out. Raises RecordingFault,
    and TranscriptFault for a dialogue that makes no sense.
    """
    protocols = recorded.metadata.get("protocols", "").split()
    if not protocols:
        raise RecordingFault(f"{recorded.path}: it does not tell its protocols")
    lines = Lines(protocols, 0)
    text = [lines.header(f"from {recorded.path.name}")]
    start = next(recorded.contents(STATE), None)
    start_s = 0.0 if start is None else start.time_s
    spoken = list(recorded.contents(DIALOGUE))
    if spoken and spoken[-1].direction == Direction.FROM_CLIENT.value:
        spoken.pop()
    for each in spoken:
        real_ns = round(each.real_s * 1e9)
        told = (
            each.session,
            Direction(each.direction),
            each.text,
            each.tick,
            real_ns,
            each.reason,
            each.protocol,
        )
        text.append(lines.line(DialogueLine(*told), max(0.0, each.time_s - start_s)) + "\n")
    return read(str(recorded.path), "".join(text))

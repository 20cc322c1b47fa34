"""Recordings read: whole ones, and those that were cut off, up to the last whole chunk."""

import struct
import tempfile
from bisect import bisect_right
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import msgspec
from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, DataEnd, Footer, Header, McapRecord, Message, Metadata
from mcap.stream_reader import StreamReader
from zstandard import ZstdError

from iiwa_sim.controller.state import Snapshot
from iiwa_sim.recordings.recordings import RecordingFault
from iiwa_sim.recordings.schemas import CELL, DIALOGUE, EVENTS, METADATA, STATE, Event, Spoken
from iiwa_sim.robot.description import SETTINGS_FILE, URDF_FILE, RobotDescription, load_robot

SUFFIX = ".mcap"
STEP_NS = 20_000_000
"""Least simulated time between two states of a `Timeline`."""
LARGEST_RECORD = 64 * 1024 * 1024
"""Bytes; ours have some 100 kB. What says that it is larger is damaged."""
EXPECTED = "expected a recording of iiwa-sim, in MCAP"
DAMAGED = (McapError, ZstdError, ValueError, struct.error, MemoryError, KeyError, IndexError, RuntimeError)
"""Errors that mcap and the libraries below it raise for a damaged file."""
_SLACK_S = 1e-6  # of times told in seconds; a tick takes a thousand times that

KINDS: dict[str, type[Any]] = {STATE: Snapshot, DIALOGUE: Spoken, EVENTS: Event, CELL: dict[str, Any]}


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
        """Yield states, dialogue, events or cells, of the types in `KINDS`. Raises RecordingFault."""
        for topic, message in self.messages(topics):
            yield self.content(topic, message)

    def content(self, topic: str, message: Message) -> Any:
        """Decode a message. Raises RecordingFault."""
        try:
            content = msgspec.json.decode(message.data, type=KINDS[topic])
        except (msgspec.DecodeError, UnicodeDecodeError) as fault:
            told = f"{self.path}: {topic}: expected messages as iiwa-sim writes them: {fault}"
            raise RecordingFault(told) from None
        return content

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


class Timeline:
    """A recording by time, for a viewer.

    Times are simulated seconds since the start of the simulator. States nearer than `STEP_NS` are left out.
    """

    def __init__(self, path: Path) -> None:
        """Read the file. Raises RecordingFault, also if it has no state."""
        self.recorded = recorded = Recorded(path)
        self._messages: dict[str, list[Message]] = {topic: [] for topic in KINDS}
        states = self._messages[STATE]
        for topic, message in recorded.messages(KINDS):
            if topic != STATE or not states or message.log_time - states[-1].log_time >= STEP_NS:
                self._messages[topic].append(message)
        if not states:
            raise RecordingFault(f"{path}: expected a state of the robot in it")
        self.start_s, self.end_s = 1e-9 * states[0].log_time, 1e-9 * states[-1].log_time

    def last(self, topic: str, time_s: float, count: int = 1) -> list[Any]:
        """Return the last `count` states, lines, events or cells up to a time; the first one before that."""
        messages = self._messages[topic]
        end = bisect_right(messages, 1e9 * (time_s + _SLACK_S), key=lambda message: message.log_time)
        found = messages[max(end - count, 0) : end]
        if topic in (STATE, CELL):
            found = found or messages[:1]
        return [self.recorded.content(topic, each) for each in found]

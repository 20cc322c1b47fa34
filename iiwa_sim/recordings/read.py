"""Recordings read: whole ones, and those that were cut off, up to the last whole chunk."""

import struct
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import NamedTuple, TypeVar

import msgspec
from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, DataEnd, Footer, Header, McapRecord, Metadata
from mcap.records import Message as McapMessage
from mcap.stream_reader import StreamReader
from zstandard import ZstdError

from iiwa_sim.controller.state import Snapshot
from iiwa_sim.recordings.fault import RecordingFault
from iiwa_sim.recordings.mcap_file import METADATA
from iiwa_sim.recordings.schemas import DIALOGUE, EVENTS, STATE

LARGEST_RECORD = 64 * 1024 * 1024
"""Bytes; ours have some 100 kB. What says that it is larger is damaged."""

EXPECTED = "expected a recording of iiwa-sim, in MCAP"
DAMAGED = (McapError, ZstdError, ValueError, struct.error, MemoryError, KeyError, IndexError, RuntimeError)
"""What the library raises where a file is damaged: that of what it reads by, too."""


class Head(NamedTuple):
    """What a recording says of itself."""

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
    """A line of the dialogue, as `iiwa_sim.protocols.dialogue` tells it."""

    time_s: float
    tick: int
    real_s: float
    session: str
    direction: str
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
        """Whether its end was missing or damaged when `messages` came to it."""
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
        """All messages of these topics, as they were recorded."""
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
        """What was said. Raises RecordingFault for a message that is no line of a dialogue."""
        return self._decoded(DIALOGUE, Spoken)

    def events(self) -> Iterator[Happened]:
        """What happened. Raises RecordingFault for a message that is no event."""
        return self._decoded(EVENTS, Happened)

    def said_and_happened(self) -> Iterator[Spoken | Happened]:
        """Dialogue and events in the order in which they were recorded. Raises RecordingFault as they do."""
        spoken, happened = msgspec.json.Decoder(Spoken), msgspec.json.Decoder(Happened)
        for message in self.messages((DIALOGUE, EVENTS)):
            if message.topic == DIALOGUE:
                yield self._content(message, spoken)
            else:
                yield self._content(message, happened)

    def _decoded(self, topic: str, kind: type[T]) -> Iterator[T]:
        decoder = msgspec.json.Decoder(kind)
        for message in self.messages((topic,)):
            yield self._content(message, decoder)

    def _content(self, message: Read, decoder: msgspec.json.Decoder[T]) -> T:
        try:
            return decoder.decode(message.data)
        except (msgspec.DecodeError, UnicodeDecodeError) as fault:
            told = f"{self.path}: {message.topic}: expected messages as iiwa-sim writes them: {fault}"
            raise RecordingFault(told) from None

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

"""Recordings read: whole ones, and those that were cut off, up to the last whole chunk."""

import tempfile
from bisect import bisect_right
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import msgspec
from mcap.records import Attachment, Channel, DataEnd, Footer, Header, McapRecord, Message, Metadata
from mcap.stream_reader import StreamReader

from iiwa_sim.controller.state import Snapshot
from iiwa_sim.recordings import RecordingFault
from iiwa_sim.recordings.schemas import CELL, DIALOGUE, EVENTS, METADATA, STATE, Event, Line
from iiwa_sim.robot.description import SETTINGS_FILE, URDF_FILE, RobotDescription, load_robot

SUFFIX = ".mcap"
STEP_NS = 20_000_000
"""Least simulated time between two states of a `Timeline`."""
LARGEST_RECORD = 64 * 1024 * 1024
"""Bytes; ours have some 100 kB. A larger one is damaged."""
EXPECTED = "expected a recording of iiwa-sim, in MCAP"

KINDS: dict[str, type[Any]] = {STATE: Snapshot, DIALOGUE: Line, EVENTS: Event, CELL: dict[str, Any]}


class Recording:
    """A robot in a file that `iiwa-sim` has recorded."""

    def __init__(self, path: Path) -> None:
        """Read its head; `FILE.mcap:NAME` is one of several robots, the first of them without a name.

        Raises RecordingFault for a file that is no recording of ours, or not there.
        """
        name, ending, robot = str(path).rpartition(f"{SUFFIX}:")
        self.path = Path(f"{name}{SUFFIX}") if ending else path
        self.cut_at_s: float | None = None
        """The time up to which a file without its end can be read (s), once `messages` has reached it."""
        self._attachments: dict[str, bytes] = {}
        robots = None
        for record in self._records():
            if isinstance(record, Metadata) and record.name == METADATA:
                robots = record.metadata.get("robots", "").split()
            elif isinstance(record, Attachment):
                self._attachments[record.name] = record.data
            elif not isinstance(record, Header):
                break
        if robots is None:
            raise RecordingFault(f"{path}: {EXPECTED}")
        if ending and robot not in robots:
            raise RecordingFault(f"{path}: expected {' or '.join(robots) or 'nothing'} behind the colon")
        self._space = f"{robot if ending else robots[0]}/" if robots else ""

    def messages(self, topics: Collection[str]) -> Iterator[tuple[str, int, Any]]:
        """Yield topic, simulated time (ns) and content of messages in their order. Raises RecordingFault.

        The contents have the types in `KINDS`.
        """
        names: dict[int, str] = {}
        for record in self._records():
            if isinstance(record, Message) and (topic := names.get(record.channel_id, "")) in topics:
                try:
                    content = msgspec.json.decode(record.data, type=KINDS.get(topic, Any))
                except (msgspec.DecodeError, UnicodeDecodeError) as fault:
                    raise RecordingFault(f"{self.path}: {topic}: {EXPECTED}: {fault}") from None
                yield topic, record.log_time, content
            elif isinstance(record, Channel):
                names[record.id] = record.topic.replace(f"/{self._space}", "/", 1)
            elif isinstance(record, DataEnd):
                return

    def contents(self, *topics: str) -> Iterator[Any]:
        """Yield states, dialogue, events or cells. Raises RecordingFault."""
        for _, _, content in self.messages(topics):
            yield content

    def description(self) -> RobotDescription:
        """Load the robot whose files are attached. Raises RobotFault."""
        with tempfile.TemporaryDirectory() as folder:
            for name in (SETTINGS_FILE, URDF_FILE):
                Path(folder, name).write_bytes(self._attachments.get(f"{self._space}{name}", b""))
            return load_robot(folder)

    def _records(self) -> Iterator[McapRecord]:
        """Yield records up to the end, or to damage. Raises RecordingFault for damage at the beginning."""
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
        except Exception:  # noqa: BLE001  # mcap and the libraries below it raise many for a damaged file
            if last_ns is None:
                raise RecordingFault(f"{self.path}: {EXPECTED}") from None
            self.cut_at_s = 1e-9 * last_ns


class Timeline:
    """A recording by time, for a viewer.

    Times are simulated seconds since the start of the simulator. States nearer than `STEP_NS` are left out.
    """

    def __init__(self, path: Path) -> None:
        """Read the file. Raises RecordingFault, also if it has no state."""
        self.recorded = Recording(path)
        self._times_ns: dict[str, list[int]] = {topic: [] for topic in KINDS}
        self._contents: dict[str, list[Any]] = {topic: [] for topic in KINDS}
        states_ns = self._times_ns[STATE]
        for topic, time_ns, content in self.recorded.messages(KINDS):
            if topic != STATE or not states_ns or time_ns - states_ns[-1] >= STEP_NS:
                self._times_ns[topic].append(time_ns)
                self._contents[topic].append(content)
        if not states_ns:
            raise RecordingFault(f"{path}: expected a state of the robot in it")
        self.start_s = 1e-9 * states_ns[0]
        self.end_s = 1e-9 * max(each[-1] for each in self._times_ns.values() if each)

    def last(self, topic: str, time_s: float, count: int = 1) -> list[Any]:
        """Return the last `count` states, lines, events or cells up to a time; the first one before that."""
        end = bisect_right(self._times_ns[topic], round(1e9 * time_s))
        end = max(end, 1) if topic in (STATE, CELL) else end
        return self._contents[topic][max(end - count, 0) : end]

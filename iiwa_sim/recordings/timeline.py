"""A recording by time: the state at an instant, and what was said and what happened before it."""

from bisect import bisect_right
from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
from mcap.records import Channel, Chunk, McapRecord, MessageIndex
from mcap.records import Message as McapMessage
from mcap.stream_reader import StreamReader, breakup_chunk

from iiwa_sim.recordings.fault import RecordingFault
from iiwa_sim.recordings.read import DAMAGED, LARGEST_RECORD, Head, Recorded
from iiwa_sim.recordings.schemas import CELL, DIALOGUE, EVENTS, STATE

CHUNKS_KEPT = 512
"""Decoded, at a time: about a minute of a robot at 500 Hz, some 50 MB."""
_SLACK_NS = 1000  # of times told in seconds; a tick takes a thousand times that

Content = dict[str, Any]
NO_CELL: Content = {
    "contact_radius_mm": 0.0,
    "inputs": [],
    "outputs": [],
    "surfaces": [],
    "parts": [],
    "jaw_mm": [],
    "tool_capsules": [],
}


class _Chunk(NamedTuple):
    begins: int
    """Place in the file at which the chunk begins."""
    first_ns: int
    channels: frozenset[int]
    """Channels that have messages in it."""


class _Messages(NamedTuple):
    """Messages of one topic in one chunk, in the order of time."""

    times_ns: list[int]
    contents: list[bytes]


class Timeline:
    """A file that `iiwa-sim` has recorded, whole or cut off, read where it is asked about.

    Times are the robot's, in simulated seconds since the start of the simulator. What is given of states has
    the keys and units of a line of the status port (`protocol/status.schema.json`).
    """

    def __init__(self, path: Path) -> None:
        """Reads its head and where its chunks are. Raises RecordingFault, also where it has no state."""
        recorded = Recorded(path)
        self.path = path
        self.head: Head = recorded.head
        self.cut = False
        """Whether its end is missing, or a part of it was found damaged."""
        self._chunks: list[_Chunk] = []
        self._channels: dict[str, int] = {}
        self._scan()
        self._opened: Callable[[int], dict[str, _Messages]] = lru_cache(CHUNKS_KEPT)(self._decoded)
        first = next(self._forwards(STATE), None)
        last = next(self._backwards(STATE, None), None)
        if first is None or last is None:
            raise RecordingFault(f"{path}: expected a state of the robot in it")
        rate_hz = self.head.tick_rate_hz
        tick = int(first[1].get("tick", 0))
        self._epoch_ns = first[0] - tick * 1_000_000_000 // rate_hz  # of tick 0
        self.start_s: float = self._seconds(first[0])
        """Simulated time of the first state."""
        self.end_s: float = self._seconds(last[0])
        """Simulated time of the last state."""

    @property
    def cut_at_s(self) -> float:
        """Up to when it can be read."""
        return self.end_s

    def state_at(self, time_s: float) -> Content:
        """The last state at or before an instant; the first one where that is too early."""
        found = next(self._backwards(STATE, time_s), None) or next(self._forwards(STATE))
        return found[1]

    def states(self, from_s: float, to_s: float, at_most: int) -> list[Content]:
        """States in this span, at even times where there are more than `at_most` (from 2 on)."""
        from_s, to_s = max(from_s, self.start_s), min(to_s, self.end_s)
        if to_s < from_s:
            return []
        tick_s = 1.0 / self.head.tick_rate_hz
        count = min(at_most, round((to_s - from_s) / tick_s) + 1)
        step_s = (to_s - from_s) / max(count - 1, 1)
        found = [self.state_at(from_s + step * step_s) for step in range(count)]
        ticks = [each.get("tick") for each in found]
        return [each for place, each in enumerate(found) if not place or ticks[place] != ticks[place - 1]]

    def said(self, time_s: float, count: int) -> list[Content]:
        """The last lines of the dialogue up to an instant, the newest one last."""
        return self._last(DIALOGUE, time_s, count)

    def happened(self, time_s: float, count: int) -> list[Content]:
        """The last events up to an instant, the newest one last."""
        return self._last(EVENTS, time_s, count)

    def cell_at(self, time_s: float) -> Content:
        """What was round the robot at an instant, with the keys and units of a cell.toml."""
        found = next(self._backwards(CELL, time_s), None) or next(self._forwards(CELL), (0, NO_CELL))
        return found[1]

    def _last(self, topic: str, time_s: float, count: int) -> list[Content]:
        found: list[Content] = []
        for _, content in self._backwards(topic, time_s):
            if len(found) == count:
                break
            found.append(content)
        return found[::-1]

    def _seconds(self, log_ns: int) -> float:
        return 1e-9 * float(log_ns - self._epoch_ns)

    def _forwards(self, topic: str) -> Iterator[tuple[int, Content]]:
        for place in range(len(self._chunks)):
            messages = self._messages(place, topic)
            for at_ns, content in zip(messages.times_ns, messages.contents, strict=True):
                yield at_ns, self._content(topic, content)

    def _backwards(self, topic: str, time_s: float | None) -> Iterator[tuple[int, Content]]:
        """Messages backwards from an instant, or from the end."""
        if time_s is None:
            limit_ns, place = None, len(self._chunks)
        else:
            limit_ns = self._epoch_ns + round(time_s * 1e9) + _SLACK_NS
            place = bisect_right(self._chunks, limit_ns, key=lambda chunk: chunk.first_ns)
        while place > 0:
            place -= 1
            messages = self._messages(place, topic)
            count = len(messages.times_ns)
            if limit_ns is not None:
                count = bisect_right(messages.times_ns, limit_ns)
            for each in range(count - 1, -1, -1):
                yield messages.times_ns[each], self._content(topic, messages.contents[each])

    def _messages(self, place: int, topic: str) -> _Messages:
        if self._channels.get(topic) not in self._chunks[place].channels:
            return _Messages([], [])
        return self._opened(place).get(topic) or _Messages([], [])

    def _content(self, topic: str, data: bytes) -> Content:
        try:
            return msgspec.json.decode(data, type=Content)
        except (msgspec.DecodeError, UnicodeDecodeError) as fault:
            told = f"{self.path}: {topic}: expected messages as iiwa-sim writes them: {fault}"
            raise RecordingFault(told) from None

    def _scan(self) -> None:
        """Find the chunks and what is in them, without decompressing any but the first."""
        chunk: Chunk | None = None
        begins = 0
        channels: set[int] = set()

        def note() -> None:
            if chunk is not None:
                self._chunks.append(_Chunk(begins, chunk.message_start_time, frozenset(channels)))
                channels.clear()

        for position, record in self._records():
            if isinstance(record, MessageIndex):
                channels.add(record.channel_id)
                continue
            note()
            chunk = None
            if isinstance(record, Chunk):
                chunk, begins = record, position
                if not self._channels:
                    self._learn(record)
        # The last chunk of a file that was cut off may have lost its index: what is in it is not known.
        if chunk is not None:
            channels.update(self._channels.values())
            note()

    def _learn(self, chunk: Chunk) -> None:
        """The numbers of the channels: our recordings tell all of them in the first chunk."""
        try:
            records = breakup_chunk(chunk, validate_crc=True)
        except DAMAGED:
            self.cut = True
            return
        self._channels = {each.topic: each.id for each in records if isinstance(each, Channel)}

    def _records(self) -> Iterator[tuple[int, McapRecord]]:
        """What stands in the file, and where: chunks as they are."""
        try:
            with self.path.open("rb") as stream:
                reader = StreamReader(stream, emit_chunks=True, record_size_limit=LARGEST_RECORD)
                records, position = reader.records, 0
                while True:
                    record = next(records, None)
                    if record is None:
                        return
                    yield position, record
                    position = stream.tell()
        except OSError as fault:
            raise RecordingFault(f"{self.path}: cannot be read: {fault.strerror}") from None
        except DAMAGED:
            self.cut = True

    def _decoded(self, place: int) -> dict[str, _Messages]:
        found = {topic: _Messages([], []) for topic in self._channels}
        names = {number: topic for topic, number in self._channels.items()}
        try:
            with self.path.open("rb") as stream:
                stream.seek(self._chunks[place].begins)
                chunk = next(StreamReader(stream, skip_magic=True, emit_chunks=True).records)
                for record in breakup_chunk(chunk, validate_crc=True) if isinstance(chunk, Chunk) else ():
                    if isinstance(record, McapMessage) and record.channel_id in names:
                        messages = found[names[record.channel_id]]
                        messages.times_ns.append(record.log_time)
                        messages.contents.append(record.data)
        except OSError as fault:
            raise RecordingFault(f"{self.path}: cannot be read: {fault.strerror}") from None
        except DAMAGED:
            self.cut = True
        return found

"""An MCAP file while it is written: its head at once, then messages in chunks, and at last where what is."""

import zlib
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import BinaryIO, NamedTuple

import msgspec
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from iiwa_sim.recordings.chunk import ChunkBuilder
from iiwa_sim.recordings.opening import MAGIC
from iiwa_sim.recordings.schemas import channels

CHUNK_BYTES = 64 * 1024
"""Messages of a chunk, which is compressed at once: larger ones take longer, for no smaller files."""

METADATA = "iiwa_sim"
"""The name of the metadata record by which a recording of ours is known."""

_CRC_BYTES = 4


class Head(NamedTuple):
    """What stands at the beginning of a recording."""

    metadata: Mapping[str, str]
    attachments: Mapping[str, tuple[str, bytes]]
    """Attachments by their names: media type and content."""
    began_ns: int
    """Since 1970."""


class McapFile:
    """A recording that is open for writing. Whatever writes may raise OSError."""

    def __init__(self, stream: BinaryIO, head: Head) -> None:
        """`stream` is that of a file that `opening.opened` has begun; it is this one's from now on."""
        self._chunk = ChunkBuilder()
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._chunks: list[ChunkIndex] = []
        self._attachments: list[AttachmentIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._counts: Counter[int] = Counter()  # of messages, by their channels
        self._stream = stream
        self._position = len(MAGIC)
        self._begin(head)
        self._ids = {channel.topic: channel.id for channel in self._channels}

    def add(self, topic: str, data: bytes, log_ns: int, publish_ns: int, number: int) -> None:
        """A message: its simulated and its real time (ns since 1970), and its number among all."""
        self._chunk.add(self._ids[topic], log_ns, data, publish_ns, number & 0xFFFF_FFFF)
        if self._chunk.size > CHUNK_BYTES:
            self._end_chunk()

    def flush(self) -> None:
        """End the present chunk and hand all to the system."""
        self._end_chunk()
        self._stream.flush()

    def finish(self, said_of_its_end: dict[str, str]) -> None:
        """Write what is to be said of the end, the index, and close."""
        self._end_chunk()
        self._tell(f"{METADATA}_end", said_of_its_end)
        self._write(_bytes_of([DataEnd(0)]))
        self._summarize()
        self._stream.write(MAGIC)
        self._stream.close()

    def _begin(self, head: Head) -> None:
        self._write(_bytes_of([Header("", f"iiwa-sim {head.metadata['version']}")]))
        self._tell(METADATA, dict(head.metadata))
        for name, (media_type, content) in head.attachments.items():
            ns, offset = head.began_ns, self._position
            length = self._write(_bytes_of([Attachment(ns, ns, name, media_type, content)]))
            index = AttachmentIndex(offset, length, ns, ns, len(content), name, media_type)
            self._attachments.append(index)
        for number, channel in enumerate(channels(), 1):
            text = msgspec.json.encode(channel.schema)
            self._schemas.append(Schema(number, text, "jsonschema", channel.schema_name))
            self._channels.append(Channel(number, channel.topic, "json", {}, number))
        pairs = zip(self._schemas, self._channels, strict=True)
        self._chunk.begin_with(_bytes_of([record for pair in pairs for record in pair]))
        self._stream.flush()

    def _tell(self, name: str, metadata: dict[str, str]) -> None:
        offset = self._position
        length = self._write(_bytes_of([Metadata(name, metadata)]))
        self._metadata.append(MetadataIndex(offset, length, name))

    def _end_chunk(self) -> None:
        ended = self._chunk.end(self._position)
        if ended is not None:
            written, index, counts = ended
            self._write(written)
            self._chunks.append(index)
            self._counts.update(counts)

    def _summarize(self) -> None:
        """Tell where what is: https://mcap.dev/spec#summary-section"""
        begins = self._position
        groups: list[tuple[Opcode, Sequence[McapRecord]]] = [
            (Opcode.SCHEMA, self._schemas),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.ATTACHMENT_INDEX, self._attachments),
            (Opcode.METADATA_INDEX, self._metadata),
        ]
        summary, offsets = b"", []
        for opcode, group in groups:
            if group:
                told = _bytes_of(group)
                offsets.append(SummaryOffset(opcode, begins + len(summary), len(told)))
                summary += told
        offsets_begin = begins + len(summary)
        summary += _bytes_of(offsets)
        footer = _bytes_of([Footer(begins, offsets_begin, 0)])[:-_CRC_BYTES]
        crc = zlib.crc32(footer, zlib.crc32(summary))
        self._write(summary + footer + crc.to_bytes(_CRC_BYTES, "little"))

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=len(self._chunks),
            message_count=self._counts.total(),
            message_end_time=max((chunk.message_end_time for chunk in self._chunks), default=0),
            message_start_time=min((chunk.message_start_time for chunk in self._chunks), default=0),
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )

    def _write(self, data: bytes) -> int:
        """How many bytes it was."""
        self._position += len(data)
        return self._stream.write(data)


def _bytes_of(records: Sequence[McapRecord]) -> bytes:
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]

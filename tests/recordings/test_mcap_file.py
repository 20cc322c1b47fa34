"""What we write of an MCAP file by ourselves is what the library would have written."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import hypothesis.strategies as st
import msgspec
from hypothesis import given
from mcap.reader import make_reader
from mcap.records import Chunk, ChunkIndex, Footer, McapRecord, MetadataIndex, SummaryOffset
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import CompressionType, Writer

from iiwa_sim.recordings.mcap_file import CHUNK_BYTES, METADATA, Head, McapFile
from iiwa_sim.recordings.opening import opened
from iiwa_sim.recordings.schemas import channels

URDF = b"<robot/>"
HEAD = Head({"version": "1.2", "rate_hz": "500"}, {"robot.urdf": ("application/xml", URDF)}, 7)
Said = list[tuple[str, bytes, int, int] | None]
"""Messages, and flushes between them."""

TIMES_NS = st.integers(0, 2**63)  # which need not be in order
MESSAGES = st.tuples(
    st.sampled_from([channel.topic for channel in channels()]),
    st.binary(max_size=300).map(lambda data: data * 100),
    TIMES_NS,
    TIMES_NS,
)


@given(st.lists(MESSAGES | st.none(), max_size=20))
def test_a_file_has_the_records_the_library_would_have_written(said: Said) -> None:
    with tempfile.TemporaryDirectory() as folder:
        ours, theirs = Path(folder, "ours.mcap"), Path(folder, "theirs.mcap")
        _write_ours(ours, said)
        _write_theirs(theirs, said)
        assert list(_records(ours)) == list(_records(theirs))
        with ours.open("rb") as stream:  # by the index, with its checksums
            found = make_reader(stream, validate_crcs=True).iter_messages()
            by_index = sorted((m.sequence, c.topic, m.data, m.log_time, m.publish_time) for _, c, m in found)
    messages = [each for each in said if each is not None]
    assert by_index == [(number, *message) for number, message in enumerate(messages)]


def _write_ours(path: Path, said: Said) -> None:
    opened(path).close()
    file = McapFile(path.open("ab"), HEAD)
    number = 0
    for each in said:
        if each is not None:
            file.add(*each, number)
            number += 1
        else:
            file.flush()
    file.finish({"lost_messages": "3"})


def _write_theirs(path: Path, said: Said) -> None:
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        writer.start("", "iiwa-sim 1.2")
        writer.add_metadata(METADATA, dict(HEAD.metadata))
        writer.add_attachment(HEAD.began_ns, HEAD.began_ns, "robot.urdf", "application/xml", URDF)
        ids = {}
        for channel in channels():
            text = msgspec.json.encode(channel.schema)
            schema = writer.register_schema(channel.schema_name, "jsonschema", text)
            ids[channel.topic] = writer.register_channel(channel.topic, "json", schema)
        number = 0
        for each in said:
            if each is not None:
                topic, data, log_ns, publish_ns = each
                writer.add_message(ids[topic], log_ns, data, publish_ns, number)
                number += 1
            else:
                writer.flush()  # type: ignore[no-untyped-call]
        writer.flush()  # type: ignore[no-untyped-call]
        writer.add_metadata(f"{METADATA}_end", {"lost_messages": "3"})
        writer.finish()  # type: ignore[no-untyped-call]


def _records(path: Path) -> Iterator[object]:
    """What stands in a file, without what hangs on how far chunks are compressed."""
    with path.open("rb") as stream:
        for record in StreamReader(stream, emit_chunks=True, validate_crcs=True).records:
            yield from _comparable(record)


def _comparable(record: McapRecord) -> Iterator[object]:
    match record:
        case Chunk():
            yield replace(record, data=b"")
            yield from breakup_chunk(record, validate_crc=True)
        case ChunkIndex():
            channels_in_it = dict.fromkeys(record.message_index_offsets, 0)
            yield replace(
                record,
                chunk_start_offset=0,
                chunk_length=0,
                compressed_size=0,
                message_index_offsets=channels_in_it,
            )
        case MetadataIndex():
            yield replace(record, offset=0)
        case SummaryOffset():
            if record.group_length:  # the library tells of groups that are empty, too
                yield record.group_opcode
        case Footer():
            yield Footer
        case _:
            yield record

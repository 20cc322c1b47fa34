"""A chunk of an MCAP file while messages are put into it.

`mcap.writer` builds a record of a message by some twenty calls, in 8 us; at 500 states in a second that is as
much as making the states. Here it is one. What is rare, the library's own records write.
"""

import struct
import zlib

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Chunk, ChunkIndex

_MESSAGE = struct.Struct("<BQHIQQ")
"""Opcode, length, channel, sequence, log_time, publish_time: https://mcap.dev/spec#message-op0x05"""
_INDEX = struct.Struct("<BQHI")
"""Opcode, length, channel, bytes of its pairs: https://mcap.dev/spec#message-index-op0x07"""
_OPCODE_AND_LENGTH = 9
_BEFORE_DATA = _MESSAGE.size - _OPCODE_AND_LENGTH
_PAIR = 16  # log_time and offset
_LEVEL = 1
"""Level of zstd: digits that are as good as random become no smaller at a higher one."""


class ChunkBuilder:
    """Messages that become one chunk and its indices, one chunk after the other."""

    def __init__(self) -> None:
        self.size = 0
        """Bytes of what is in it, before they are compressed."""
        self._pieces: list[bytes] = []
        self._pairs: dict[int, list[int]] = {}
        self._compress = zstandard.ZstdCompressor(level=_LEVEL).compress

    def begin_with(self, records: bytes) -> None:
        """Put other records before the first message of the first chunk: schemas and channels."""
        self._pieces.append(records)
        self.size += len(records)

    def add(self, channel: int, log_ns: int, data: bytes, publish_ns: int, sequence: int) -> None:
        """A message: times since 1970."""
        length = len(data)
        pairs = self._pairs.get(channel)
        if pairs is None:
            pairs = self._pairs[channel] = []
        pairs += (log_ns, self.size)
        head = _MESSAGE.pack(Opcode.MESSAGE, _BEFORE_DATA + length, channel, sequence, log_ns, publish_ns)
        self._pieces += (head, data)
        self.size += _MESSAGE.size + length

    def end(self, offset: int) -> tuple[bytes, ChunkIndex, dict[int, int]] | None:
        """What stands in the file from `offset` on, a chunk and its indices; what the end of the file tells
        of them; and how many messages each channel has in it. None where there is no message.
        """
        if not self._pairs:
            return None
        pairs, content = self._pairs, b"".join(self._pieces)
        self._pairs, self._pieces, self.size = {}, [], 0
        first_ns, last_ns = (which(which(each[::2]) for each in pairs.values()) for which in (min, max))
        compressed = self._compress(content)
        builder = RecordBuilder()
        Chunk(
            compression="zstd",
            data=compressed,
            message_start_time=first_ns,
            message_end_time=last_ns,
            uncompressed_crc=zlib.crc32(content),
            uncompressed_size=len(content),
        ).write(builder)
        chunk = bytes(builder.end())  # type: ignore[no-untyped-call]
        written, offsets = [chunk], {}
        position = offset + len(chunk)
        for channel, each in pairs.items():
            size = len(each) // 2 * _PAIR
            head = _INDEX.pack(Opcode.MESSAGE_INDEX, _INDEX.size - _OPCODE_AND_LENGTH + size, channel, size)
            written += (head, struct.pack(f"<{len(each)}Q", *each))
            offsets[channel] = position
            position += _INDEX.size + size
        index = ChunkIndex(
            chunk_length=len(chunk),
            chunk_start_offset=offset,
            compression="zstd",
            compressed_size=len(compressed),
            message_end_time=last_ns,
            message_index_length=position - offset - len(chunk),
            message_index_offsets=offsets,
            message_start_time=first_ns,
            uncompressed_size=len(content),
        )
        return b"".join(written), index, {channel: len(each) // 2 for channel, each in pairs.items()}

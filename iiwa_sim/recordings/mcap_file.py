"""An MCAP file while it is written: its head at once, then messages in chunks."""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import msgspec
from mcap.writer import CompressionType, Writer

from iiwa_sim.recordings.fault import RecordingFault
from iiwa_sim.recordings.schemas import channels

CHUNK_BYTES = 64 * 1024
"""Of messages; each chunk is compressed at once. Larger ones take longer at a time, for no smaller files."""

METADATA = "iiwa_sim"
"""The name of the metadata record by which a recording of ours is known."""


class Head(NamedTuple):
    """What stands at the beginning of a recording."""

    metadata: Mapping[str, str]
    attachments: Mapping[str, tuple[str, bytes]]
    """By their names: media type and content."""
    began_ns: int
    """Since 1970."""


class McapFile:
    """A recording that is open for writing. Whatever writes may raise OSError."""

    def __init__(self, path: Path, head: Head) -> None:
        """Overwrites a file that is there. Raises RecordingFault where it cannot be written."""
        try:
            if path.exists() and not path.is_file() and not path.is_char_device():
                raise RecordingFault(f"{path}: expected the name of a file, to write a recording there")
            self._stream = path.open("wb")
        except (OSError, ValueError) as fault:  # ValueError for a name with a NUL
            raise _unwritable(path, fault) from None
        try:
            if self._stream.isatty() or not self._stream.seekable():
                raise RecordingFault(f"{path}: expected the name of a file, to write a recording there")
            self._writer = Writer(self._stream, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
            self._channels = self._begin(head)
        except OSError as fault:
            self.abandon()
            raise _unwritable(path, fault) from None
        except RecordingFault:
            self.abandon()
            raise

    def add(self, topic: str, data: bytes, log_ns: int, publish_ns: int, number: int) -> None:
        """A message: its simulated and its real time (ns since 1970), and its number among all."""
        self._writer.add_message(self._channels[topic], log_ns, data, publish_ns, number & 0xFFFF_FFFF)

    def flush(self) -> None:
        """End the present chunk and hand all to the system."""
        self._writer.flush()  # type: ignore[no-untyped-call]

    def finish(self, lost: int) -> None:
        """Write how many messages were lost, the index, and close."""
        try:
            self._writer.add_metadata(f"{METADATA}_end", {"lost_messages": str(lost)})
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._stream.flush()
        except OSError:
            self.abandon()
            raise
        self._stream.close()

    def abandon(self) -> None:
        """Close as it is."""
        with suppress(OSError):  # what is in its buffer finds no room either; the descriptor is closed
            self._stream.close()

    def _begin(self, head: Head) -> dict[str, int]:
        writer = self._writer
        writer.start(profile="", library=f"iiwa-sim {head.metadata['version']}")
        writer.add_metadata(METADATA, dict(head.metadata))
        for name, (media_type, content) in head.attachments.items():
            writer.add_attachment(head.began_ns, head.began_ns, name, media_type, content)
        ids = {}
        for channel in channels():
            schema = writer.register_schema(
                channel.schema_name, "jsonschema", msgspec.json.encode(channel.schema)
            )
            ids[channel.topic] = writer.register_channel(channel.topic, "json", schema)
        self._stream.flush()
        return ids


def _unwritable(path: Path, fault: Exception) -> RecordingFault:
    return RecordingFault(f"{path}: cannot be written: {getattr(fault, 'strerror', None) or fault}")

"""Writes a recording into an MCAP file, in a thread of its own.

The robot's thread puts blocks into a bounded queue and waits for nothing. The writing thread makes messages
of them; the library compresses and writes chunks.
"""

import contextvars
import logging
import queue
import threading
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec
from mcap.writer import Writer as McapWriter

from iiwa_sim.recordings import RecordingFault
from iiwa_sim.recordings.schemas import CHANNELS, METADATA, schemas

MOST_BLOCKS = 600
"""Blocks that wait for the file, 30 s of a robot in real time; later ones are dropped."""
PATIENCE_S = 5.0
"""A robot without a real-time clock, and the end of a recording, wait this long for a file."""
FLUSH_S = 0.5
"""Real time after which the data is handed to the system: a killed robot loses no more."""
_CHUNK_BYTES = 64 * 1024  # compressed at once; larger chunks would hold the interpreter for milliseconds

logger = logging.getLogger(__name__)

Block = Sequence[Any]
Message = tuple[str, bytes, int, int]
"""Topic, data, simulated time since the start of the simulator (ns), and real time since 1970 (ns)."""


class Writer:
    """A recording that is being written.

    Blocks that find no room are dropped: the end of the file and the log tell the number of messages. A full
    disk ends the recording with one line in the log.
    """

    def __init__(self, path: Path, metadata: Mapping[str, str], attachments: Mapping[str, bytes]) -> None:
        """Open the file, which is overwritten. Raises RecordingFault."""
        self.dropped = 0
        """Messages that found no room."""
        self._path = path
        self._blocks: queue.Queue[tuple[Block, Any] | None] = queue.Queue(MOST_BLOCKS)
        self._over = False  # nothing is written any more
        try:
            self._stream = path.open("wb")
            self._file = file = McapWriter(self._stream, _CHUNK_BYTES)
            file.start(library=f"iiwa-sim {metadata['version']}")
            file.add_metadata(METADATA, dict(metadata))
            now_ns = time.time_ns()
            for name, content in attachments.items():
                file.add_attachment(now_ns, now_ns, name, "text/plain", content)
            self._schemas = {
                name: file.register_schema(name, "jsonschema", msgspec.json.encode(schema))
                for name, schema in schemas().items()
            }
            self._channels: dict[str, int] = {}
            self._stream.flush()
        except OSError as fault:
            raise RecordingFault(f"{path}: cannot be written: {fault.strerror}") from None
        context = contextvars.copy_context()  # the log knows by it whose recording this is
        self._thread = threading.Thread(target=context.run, args=(self._write,), daemon=True)
        self._thread.start()

    def put(self, block: Block, made: Callable[[Any], Iterable[Message]], *, can_wait: bool = False) -> None:
        """Write a block, whose messages `made` makes in the writing thread.

        If there is no room, wait for it if `can_wait`, else drop the block.
        """
        if self._over:
            return
        try:
            self._blocks.put((block, made), block=can_wait, timeout=PATIENCE_S)
        except queue.Full:
            self.dropped += len(block)

    def close(self) -> None:
        """Write the rest and the end of the file; it is whole then."""
        with suppress(queue.Full):
            self._blocks.put(None, block=not self._over, timeout=PATIENCE_S)
        self._thread.join(PATIENCE_S)
        if self._thread.is_alive():
            self._over = True
            logger.error("%s: the recording is cut off: the file takes nothing", self._path)
        elif self.dropped:
            logger.warning("%s: the recording has lost %d messages", self._path, self.dropped)

    def _write(self) -> None:
        flushed_s = time.monotonic()
        try:
            with self._stream:
                for block, made in iter(self._blocks.get, None):
                    for topic, data, log_ns, publish_ns in made(block):
                        self._file.add_message(self._channel(topic), log_ns, data, publish_ns)
                    if self._blocks.empty() and time.monotonic() - flushed_s > FLUSH_S:
                        self._file.flush()  # type: ignore[no-untyped-call]
                        flushed_s = time.monotonic()
                self._file.add_metadata(f"{METADATA}_end", {"lost_messages": str(self.dropped)})
                self._file.finish()  # type: ignore[no-untyped-call]
        except (OSError, ValueError) as fault:
            logger.error("%s: the recording ends here: %s", self._path, fault)
        finally:
            self._over = True

    def _channel(self, topic: str) -> int:
        if topic not in self._channels:
            schema = self._schemas[CHANNELS[f"/{topic.rpartition('/')[2]}"]]
            self._channels[topic] = self._file.register_channel(topic, "json", schema)
        return self._channels[topic]

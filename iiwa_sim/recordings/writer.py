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
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter

from iiwa_sim.recordings.recordings import RecordingFault
from iiwa_sim.recordings.schemas import CHANNELS, METADATA, schemas

MOST_BLOCKS = 600
"""Blocks that wait for the file, 30 s of a robot in real time; later ones are dropped."""
PATIENCE_S = 5.0
"""A robot without a real-time clock, and the end of a recording, wait this long for a file."""
FLUSH_S = 0.5
"""Real time after which the data is handed to the system: a killed robot loses no more."""
_CHUNK_BYTES = 64 * 1024  # compressed at once; larger chunks would hold the interpreter for milliseconds

logger = logging.getLogger(__name__)


Message = tuple[str, bytes, int, int]
"""Topic, data, simulated time since the start of the simulator (ns), and real time since 1970 (ns)."""
Block = Sequence[Any]


class Writer:
    """A recording that is being written.

    Blocks that find no room are dropped: the log tells the first time, and the end of the file the number of
    messages. A full disk ends the recording with one line in the log.
    """

    def __init__(
        self,
        path: Path,
        metadata: Mapping[str, str],
        attachments: Mapping[str, tuple[str, bytes]],
        namespaces: Sequence[str] = ("",),
    ) -> None:
        """Open the file. Raises RecordingFault.

        Args:
            path: The file, which is overwritten.
            metadata: Description of the run, with the `version`.
            attachments: Attachments by their names: media type and content.
            namespaces: Prefixes of topics, such as `/left`.
        """
        self.dropped = 0
        """Messages that found no room."""
        self._path = path
        self._blocks: queue.Queue[tuple[Block, Any] | None] = queue.Queue(MOST_BLOCKS)
        self._whole = False
        self._over = False  # nothing is written any more
        try:
            if path.exists() and not (path.is_file() or path.is_char_device()):
                raise RecordingFault(f"{path}: expected the name of a file, to write a recording there")
            self._stream = path.open("wb")
            self._file = file = McapWriter(
                self._stream, chunk_size=_CHUNK_BYTES, compression=CompressionType.ZSTD
            )
            file.start(library=f"iiwa-sim {metadata['version']}")
            file.add_metadata(METADATA, dict(metadata))
            now_ns = time.time_ns()
            for name, (media_type, content) in attachments.items():
                file.add_attachment(now_ns, now_ns, name, media_type, content)
            known = {
                name: file.register_schema(name, "jsonschema", msgspec.json.encode(schema))
                for name, schema in schemas().items()
            }
            topics = [(f"{space}{topic}", CHANNELS[topic]) for space in namespaces for topic in CHANNELS]
            self._ids = {topic: file.register_channel(topic, "json", known[name]) for topic, name in topics}
            self._stream.flush()
        except (OSError, ValueError) as fault:  # ValueError for a name with a NUL
            why = getattr(fault, "strerror", None) or fault
            raise RecordingFault(f"{path}: cannot be written: {why}") from None
        context = contextvars.copy_context()  # the log knows by it whose recording this is
        self._thread = threading.Thread(
            target=context.run, args=(self._write,), name="iiwa-sim-recording", daemon=True
        )
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
            if not self.dropped:
                logger.warning("%s: the recording loses messages: the file takes them too slowly", self._path)
            self.dropped += len(block)

    def close(self) -> bool:
        """Write the rest and the end of the file; returns True if the file is whole."""
        with suppress(queue.Full):
            self._blocks.put(None, timeout=PATIENCE_S)
        self._thread.join(PATIENCE_S)
        if self._thread.is_alive():
            self._over = True
            logger.error("%s: the recording is cut off: the file takes nothing", self._path)
        elif self.dropped:
            logger.warning("%s: the recording has lost %d messages", self._path, self.dropped)
        return self._whole

    def _write(self) -> None:
        flushed_s = time.monotonic()
        try:
            with self._stream:
                while (item := self._blocks.get()) is not None:
                    block, made = item
                    for topic, data, log_ns, publish_ns in made(block):
                        self._file.add_message(self._ids[topic], log_ns, data, publish_ns)
                    if self._blocks.empty() and time.monotonic() - flushed_s > FLUSH_S:
                        self._file.flush()  # type: ignore[no-untyped-call]
                        flushed_s = time.monotonic()
                self._file.add_metadata(f"{METADATA}_end", {"lost_messages": str(self.dropped)})
                self._file.finish()  # type: ignore[no-untyped-call]
            self._whole = True
        except OSError as fault:
            logger.error("%s: the recording ends here: %s", self._path, fault.strerror)
        except Exception:  # an internal error must not leave the robot waiting for room
            logger.exception("%s: the recording ends here", self._path)
        finally:
            self._over = True
            with suppress(queue.Empty):
                while True:
                    self._blocks.get_nowait()

"""A recording written in a thread of its own: whoever puts a message into it waits for nothing."""

import contextlib
import contextvars
import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Generic, NamedTuple, Protocol, TypeVar

from iiwa_sim.recordings.mcap_file import McapFile

MOST_BYTES = 8 * 1024 * 1024
"""Messages that wait to be written, some 15 s of a robot at 500 Hz; beyond, messages are lost."""
PERIOD_S = 0.4
"""Between two looks for what was put: much at a time costs a third of what little by little would. What was
put before is in the file then, so whatever ends the process costs less than a second."""
FLUSH_S = 0.3
"""A chunk is ended no sooner than so long after the one before, however much is put."""
PATIENCE_S = 1.0
"""So long a file may take nothing, before who can wait, and the end of the recording, wait no longer."""
THREAD_NAME = "iiwa-sim-recording"
_TAKEN_BYTES = 512 * 1024  # so that who waits for room gets some soon
_AT_ONCE = 16  # messages, some 0.15 ms: then the other threads get their turn
_TURN_S = 5e-5

logger = logging.getLogger(__name__)


class Message(NamedTuple):
    """What waits to be written."""

    topic: str
    data: bytes
    log_ns: int
    publish_ns: int

    @property
    def size(self) -> int:
        """Bytes that it takes."""
        return len(self.data)


class Sized(Protocol):
    """What waits until it is made messages."""

    @property
    def size(self) -> int:
        """Bytes that it takes, about."""


T = TypeVar("T", bound=Sized)


def as_they_are(messages: Sequence[Message]) -> Sequence[Message]:
    """What messages become that are some already."""
    return messages


class Writer(Generic[T]):
    """Writes messages into a file, which it owns; the thread is a daemon. They are made there, too.

    Messages that find no room are lost and counted, which the log tells once, and the end of the file. A file
    that takes no more, such as on a full disk, ends the recording with one line in the log.
    """

    def __init__(self, path: Path, file: McapFile, make: Callable[[Sequence[T]], Iterable[Message]]) -> None:
        """`make` makes messages of what was put, in the thread; `path` names the file in the log."""
        self.lost = 0
        """Messages, so far."""
        self._path = path
        self._file = file
        self._make = make
        self._changed = threading.Condition()
        self._waiting: deque[T] = deque()
        self._put_bytes = 0  # so far, as who puts counts them
        self._taken_bytes = 0  # of these, so far, as the thread counts them when they are written
        self._closed = False
        self._broken = False
        self._number = 0
        self._stuck = False  # the file has taken nothing for PATIENCE_S
        context = contextvars.copy_context()  # in which the log knows whose recording it is
        self._thread = threading.Thread(target=context.run, args=(self._run,), name=THREAD_NAME, daemon=True)
        self._thread.start()

    def put(self, message: T, *, can_wait: bool = False) -> None:
        """Have something written. Where there is no room it waits, if it `can_wait`, or is lost."""
        size = message.size
        if self._waiting_bytes + size > MOST_BYTES and can_wait:
            self._wait_for_room(size)
        if self._broken or self._closed:
            return
        waiting_bytes = self._waiting_bytes
        if waiting_bytes and waiting_bytes + size > MOST_BYTES:
            self.lost += 1
            if self.lost == 1:
                logger.warning("%s: the recording loses messages: the file takes them too slowly", self._path)
            return
        # Without the lock: one thread puts, one takes, and each has a count of its own.
        self._put_bytes += size
        self._waiting.append(message)
        if waiting_bytes + size > MOST_BYTES // 4:
            with self._changed:
                self._changed.notify_all()

    def close(self) -> bool:
        """Write what waits, and the end of the file; whether that was done, for a file that takes nothing."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        while self._thread.is_alive():
            before = self._progress()
            self._thread.join(PATIENCE_S)
            if self._thread.is_alive() and self._progress() == before:
                logger.error("%s: the recording is cut off: the file takes nothing", self._path)
                return False
        if self.lost:
            logger.warning("%s: the recording has lost %d messages", self._path, self.lost)
        return True

    @property
    def _waiting_bytes(self) -> int:
        """In what waits, and in what is being written."""
        return self._put_bytes - self._taken_bytes

    def _progress(self) -> tuple[int, int]:
        return self._number, self._taken_bytes

    def _wait_for_room(self, size: int) -> None:
        with self._changed:
            while not self._stuck and not self._broken and self._waiting_bytes + size > MOST_BYTES:
                before = self._progress()
                self._changed.notify_all()
                self._changed.wait(PATIENCE_S)
                self._stuck = self._progress() == before

    def _run(self) -> None:
        try:
            self._write()
            self._file.finish(self.lost)
        except OSError as fault:
            logger.error("%s: the recording ends here: %s", self._path, fault.strerror)
            self._break()
        except Exception:  # a fault of ours must not leave who waits without an end
            logger.exception("%s: the recording ends here: internal error", self._path)
            self._break()

    def _write(self) -> None:
        flushed_s, dirty = time.monotonic(), False
        while True:
            with self._changed:
                if not self._closed and self._waiting_bytes <= MOST_BYTES // 4:
                    self._changed.wait(PERIOD_S)
                taken, size = self._next()
                closed = self._closed
            for message in self._make(taken):
                self._number += 1
                self._file.add(message.topic, message.data, message.log_ns, message.publish_ns, self._number)
                if self._number % _AT_ONCE == 0 and not closed:
                    time.sleep(_TURN_S)
            self._taken(size)
            dirty = dirty or bool(taken)
            if dirty and time.monotonic() - flushed_s > FLUSH_S:
                self._file.flush()
                flushed_s, dirty = time.monotonic(), False
            if closed and not taken:
                return

    def _next(self) -> tuple[list[T], int]:
        """Of what waits, in its order, as much as is made and written at a time; and its bytes."""
        taken: list[T] = []
        size = 0
        while self._waiting and size < _TAKEN_BYTES:
            taken.append(self._waiting.popleft())
            size += taken[-1].size
        return taken, size

    def _taken(self, size: int) -> None:
        with self._changed:
            self._taken_bytes += size
            self._stuck = False
            self._changed.notify_all()

    def _break(self) -> None:
        with self._changed:
            self._broken = True
            self._waiting.clear()
            self._taken_bytes = self._put_bytes
            self._changed.notify_all()
        with contextlib.suppress(Exception):
            self._file.abandon()

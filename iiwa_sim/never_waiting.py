"""Writing lines to a file that may block, such as a stopped terminal or a FIFO that nobody reads."""

import contextlib
import os
import select
import threading
from collections import deque
from collections.abc import Callable
from functools import partial

MOST_LINES = 4096
"""Most lines that wait to be written; further ones are dropped."""
AT_ONCE = 256
"""Lines written at once."""
PATIENCE_S = 1.0
"""Seconds for which the end of the program, `flush` and `close` wait for a file that blocks."""


class NeverWaiting:
    """Writes lines in a daemon thread, the only one that waits for the file.

    Lines for which there is no room, or that the file refuses, are dropped and counted. When writing goes on,
    a line tells the number.
    """

    def __init__(self, descriptor: int, told: Callable[[int], bytes]) -> None:
        """`told` formats the line that tells how many were dropped."""
        self.fault: OSError | None = None
        """Why the file has refused a line."""
        self._descriptor = descriptor
        self._told = told
        self._changed = threading.Condition()
        self._lines: deque[bytes] = deque()
        self._lost = 0
        self._writing = 0  # lines that the thread is writing
        self._batches = 0  # that have been written or refused
        self._closed = False
        self._thread: threading.Thread | None = None

    @property
    def untold(self) -> int:
        """Lines that are not written, dropped or waiting, and that no written line counts."""
        with self._changed:
            return self._lost + self._writing + len(self._lines)

    def put(self, line: bytes) -> None:
        """Queue a line with its end."""
        with self._changed:
            if self._closed or len(self._lines) >= MOST_LINES:
                self._lost += 1
                return
            self._lines.append(line)
            if self._thread is None:
                self._thread = threading.Thread(target=self._go_on, name="iiwa-sim-writer", daemon=True)
                self._thread.start()
            self._changed.notify_all()

    def flush(self) -> bool:
        """Wait until all is written, or for PATIENCE_S without progress; returns whether all is written."""
        with self._changed:
            while self._lines or self._writing:
                if not self._changed.wait_for(partial(self._went_on, self._batches), PATIENCE_S):
                    return False
        return True

    def close(self) -> bool:
        """`flush`, and write no more; what the file has not taken is dropped. The file stays open."""
        done = self.flush()
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        return done

    def _went_on(self, batches: int) -> bool:
        return self._batches > batches

    def _go_on(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._lines or self._closed)
                if self._closed:
                    return
                lines = [self._lines.popleft() for _ in range(min(len(self._lines), AT_ONCE))]
                self._writing = len(lines)
            fault = written(self._descriptor, b"".join(lines))
            with self._changed:
                self._writing = 0
                self._batches += 1
                if fault is not None:
                    self.fault = fault
                    self._lost += len(lines)
                elif self._lost:
                    self._lines.append(self._told(self._lost))
                    self._lost = 0
                self._changed.notify_all()


def written(descriptor: int, data: bytes) -> OSError | None:
    """Write all the data, however long it takes; returns why the file refused, None if it did not."""
    rest = memoryview(data)
    while rest:
        try:
            rest = rest[os.write(descriptor, rest) :]
        except BlockingIOError:  # the descriptor is non-blocking
            with contextlib.suppress(OSError):
                ready = select.poll()
                ready.register(descriptor, select.POLLOUT)
                ready.poll()
        except OSError as fault:
            return fault
    return None

"""Writing lines to a file that may block, such as a stopped terminal or a FIFO that nobody reads."""

import contextlib
import os
import queue
import select
import threading
import time
from collections.abc import Callable

MOST_LINES = 4096
"""Most lines that wait to be written; further ones are dropped."""
PATIENCE_S = 1.0
"""Seconds for which the end of the program, `flush` and `close` wait for a file that blocks."""
LOOKS_S = 0.002


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
        self._lines: queue.Queue[bytes] = queue.Queue(MOST_LINES)
        self._lost = 0
        self._closed, self._ends = False, 0
        self._thread: threading.Thread | None = None

    @property
    def untold(self) -> int:
        """Lines that are not written, dropped or waiting, and that no written line counts."""
        return self._lost + max(self._lines.unfinished_tasks - self._ends, 0)

    def put(self, line: bytes) -> None:
        """Queue a line with its end."""
        try:
            self._lines.put_nowait(line)
        except queue.Full:
            self._lost += 1
        if self._thread is None:
            self._thread = threading.Thread(target=self._go_on, name="iiwa-sim-writer", daemon=True)
            self._thread.start()

    def flush(self) -> bool:
        """Wait until all is written, or for PATIENCE_S without progress; returns whether all is written."""
        left, until_s = MOST_LINES + 1, 0.0
        while waiting := self._lines.unfinished_tasks:
            if waiting < left:
                left, until_s = waiting, time.monotonic() + PATIENCE_S
            if time.monotonic() > until_s:
                return False
            time.sleep(LOOKS_S)
        return True

    def close(self) -> bool:
        """`flush`, and write no more; what the file has not taken is dropped. The file stays open."""
        done = self.flush()
        self._closed = True
        with contextlib.suppress(queue.Full):  # the thread waits for the file
            self._lines.put_nowait(b"")
            self._ends = 1  # which is no line
        return done

    def _go_on(self) -> None:
        while not self._closed:
            line = self._lines.get()
            fault = written(self._descriptor, line)
            if fault is not None:
                self.fault = fault
                self._lost += 1
            elif self._lost:
                lost, self._lost = self._lost, 0
                written(self._descriptor, self._told(lost))
            self._lines.task_done()


def written(descriptor: int, data: bytes) -> OSError | None:
    """Write all the data, however long it takes; returns why the file refused, None if it did not."""
    rest = memoryview(data)
    while rest:
        try:
            rest = rest[os.write(descriptor, rest) :]
        except BlockingIOError:  # the descriptor is non-blocking
            with contextlib.suppress(OSError):
                select.select((), (descriptor,), ())
        except OSError as fault:
            return fault
    return None

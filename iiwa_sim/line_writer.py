"""Writing lines to a file that may block, such as a stopped terminal or a FIFO that nobody reads."""

import os
import queue
import threading
import time
from collections.abc import Callable

MOST_LINES = 4096
"""Most lines that wait to be written; further ones are dropped."""
PATIENCE_S = 1.0
"""Seconds for which `flush` and `close`, and so the end of the program, wait for a file that blocks."""
LOOKS_S = 0.002


class LineWriter:
    """Writes lines in a daemon thread, the only one that waits for the file.

    Lines for which there is no room are dropped; a line tells their number when writing goes on.
    """

    def __init__(self, descriptor: int, tell_lost: Callable[[int], bytes]) -> None:
        """`tell_lost` formats the line that tells how many were dropped."""
        self.fault: OSError | None = None
        """The last error of the file."""
        self._descriptor, self._tell_lost = descriptor, tell_lost
        self._lines: queue.Queue[bytes] = queue.Queue(MOST_LINES)
        self._lost = 0
        threading.Thread(target=self._write, name="iiwa-sim-writer", daemon=True).start()

    def put(self, line: bytes) -> None:
        """Queue a line with its end."""
        try:
            self._lines.put_nowait(line)
        except queue.Full:
            self._lost += 1

    def flush(self) -> bool:
        """Wait until all is written, up to PATIENCE_S; return True if it is."""
        until_s = time.monotonic() + PATIENCE_S
        while self._lines.unfinished_tasks and time.monotonic() < until_s:
            time.sleep(LOOKS_S)
        return not self._lines.unfinished_tasks

    def close(self) -> bool:
        """`flush`, and end the thread; return False if the file blocks. The file stays open."""
        done = self.flush()
        if done:
            self._lines.put_nowait(b"")
        return done

    def _write(self) -> None:
        while line := self._lines.get():
            lost, self._lost = self._lost, 0
            try:
                os.write(self._descriptor, line + (self._tell_lost(lost) if lost else b""))
            except OSError as fault:
                self.fault = fault
            self._lines.task_done()

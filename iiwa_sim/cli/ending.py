"""The first lines of a run, and its end by a signal."""

import asyncio
import contextlib
import signal
import sys
import threading
from typing import TextIO

from iiwa_sim.cli.output import StdoutFault
from iiwa_sim.never_waiting import PATIENCE_S, written

SIGNALS = (signal.SIGTERM, signal.SIGINT)


class Ending:
    """Handles SIGTERM and SIGINT by an orderly end; process 1 of a container has no default for them."""

    def __init__(self) -> None:
        self.asked = asyncio.Event()
        self._fault: OSError | None = None
        self._writers: list[threading.Thread] = []
        for number in SIGNALS:
            signal.signal(number, lambda *_: sys.exit(0))

    def watch(self) -> None:
        """Signals set `asked` from now on instead of ending the process. To be called inside the loop.

        The loop's own handlers wake it up, also where a signal arrives just before it waits.
        """
        for number in SIGNALS:
            asyncio.get_running_loop().add_signal_handler(number, self.asked.set)

    def announce(self, text: str, stream: TextIO | None) -> None:
        """Write to stdout or stderr, if it is there, in a thread that a full pipe may block."""
        if stream is None:
            return
        loop, descriptor = asyncio.get_running_loop(), stream.fileno()

        def write() -> None:
            self._fault = written(descriptor, text.encode()) or self._fault
            if self._fault is not None:
                with contextlib.suppress(RuntimeError):  # the loop is closed
                    loop.call_soon_threadsafe(self.asked.set)

        self._writers.append(threading.Thread(target=write, name="iiwa-sim-announces", daemon=True))
        self._writers[-1].start()

    async def wait(self) -> None:
        """Return when the end is requested. Raises StdoutFault for an announcement that fails."""
        await self.asked.wait()
        for writer in self._writers:  # all is written long since, unless nobody reads
            writer.join(PATIENCE_S)
        if self._fault is not None:
            raise StdoutFault(f"cannot write to stdout: {self._fault.strerror}")

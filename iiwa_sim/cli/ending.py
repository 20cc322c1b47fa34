"""The first lines of a run, and its end by a signal."""

import asyncio
import contextlib
import signal
import sys
import threading
from collections.abc import Coroutine
from typing import TextIO

from iiwa_sim.cli.output import StdoutFault
from iiwa_sim.never_waiting import PATIENCE_S, written

SIGNALS = (signal.SIGTERM, signal.SIGINT)


class Ending:
    """Handles SIGTERM and SIGINT by an orderly end; process 1 of a container has no default for them."""

    def __init__(self) -> None:
        self.asked = asyncio.Event()
        for number in SIGNALS:
            signal.signal(number, lambda *_: sys.exit(0))

    def watch(self) -> None:
        """Signals set `asked` from now on instead of ending the process. To be called inside the loop.

        The loop's own handlers wake it up, also where a signal arrives just before it waits.
        """
        for number in SIGNALS:
            asyncio.get_running_loop().add_signal_handler(number, self.asked.set)

    async def wait(self, *announced: Coroutine[None, None, None]) -> None:
        """Return when the end is requested; raise at once what goes wrong with an announcement meanwhile.

        After the request an announcement has PATIENCE_S more: it has been written long since, unless nobody
        reads.
        """
        told = {asyncio.create_task(each) for each in announced}
        ends = asyncio.create_task(self.asked.wait())
        while not ends.done():
            done, _ = await asyncio.wait({ends, *told}, return_when=asyncio.FIRST_COMPLETED)
            for each in done & told:
                each.result()
            told -= done
        if told:
            await asyncio.wait(told, timeout=PATIENCE_S)


async def announce(text: str, stream: TextIO | None) -> None:
    """Write to stdout or stderr, if it is there; a stopped terminal or a full pipe may block it.

    Only the caller that awaits this is blocked: the text is written in a thread that ends with the process.
    Raises `StdoutFault`.
    """
    if stream is None:
        return
    loop, descriptor = asyncio.get_running_loop(), stream.fileno()
    over: asyncio.Future[OSError | None] = loop.create_future()

    def settle(fault: OSError | None) -> None:
        if not over.done():
            over.set_result(fault)

    def write() -> None:
        fault = written(descriptor, text.encode())
        with contextlib.suppress(RuntimeError):  # the loop is closed
            loop.call_soon_threadsafe(settle, fault)

    threading.Thread(target=write, name="iiwa-sim-announces", daemon=True).start()
    fault = await over
    if fault is not None:
        raise StdoutFault(f"cannot write to stdout: {fault.strerror}")

"""Writing to stdout and to a terminal."""

import asyncio
import contextlib
import os
import sys
import threading
from typing import TextIO

from iiwa_sim.never_waiting import written
from iiwa_sim.wording import Unusable


class StdoutFault(Unusable):
    """stdout cannot be written. The message is one line."""


def say(text: str, stream: TextIO | None = None) -> None:
    """Write to stdout at once, or to `stream`, which was stdout before. Raises `StdoutFault`."""
    stdout = stream or sys.stdout
    if stdout is None:
        return
    try:
        stdout.write(text)
        stdout.flush()
    except OSError as fault:
        # Data left in the buffer is flushed again at exit, which would fail a second time.
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stdout.fileno())
        os.close(nowhere)
        raise StdoutFault(f"cannot write to stdout: {fault.strerror}") from None


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

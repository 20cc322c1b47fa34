"""Writing to stdout."""

import os
import sys
from typing import TextIO

from iiwa_sim.wording import Unusable


def say(text: str, stream: TextIO | None = None) -> None:
    """Write to stdout at once, or to `stream`, which was stdout before. Raises Unusable."""
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
        raise Unusable(f"cannot write to stdout: {fault.strerror}") from None


def reached_at(host: str) -> str:
    """Return the address on this machine of a server that listens on `host`."""
    return {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)  # among all addresses

"""What the program writes to stdout."""

import os
import sys

from iiwa_sim.wording import Unusable


class StdoutFault(Unusable):
    """A stdout that takes nothing. The message is one line."""


def say(text: str) -> None:
    """Write to stdout at once. Raises `StdoutFault`."""
    if sys.stdout is None:
        return
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except OSError as fault:
        # What is left in the buffer is tried again at exit, and would be complained of a second time.
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
        raise StdoutFault(f"cannot write to stdout: {fault.strerror}") from None

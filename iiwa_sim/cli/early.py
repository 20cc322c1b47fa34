"""Signals while the program is loading."""

import os
import signal
from typing import NoReturn


def end_while_loading() -> None:
    """Make SIGTERM and SIGINT end the process with exit code 0, until an `Ending` handles them.

    Process 1 of a container ignores a signal without a handler, and loading takes tenths of a second: a
    `docker stop` in between would wait ten seconds and then kill.
    """
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, _leave)


def _leave(*_: object) -> NoReturn:
    # Nothing is open yet; and sys.exit would tear down half loaded libraries, where Pinocchio crashes.
    os._exit(0)

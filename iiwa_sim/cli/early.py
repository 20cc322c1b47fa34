"""A signal that comes while the program is still loading."""

import os
import signal
from typing import NoReturn


def end_while_loading() -> None:
    """SIGTERM and SIGINT end the process with exit code 0, until an `Ending` takes them over.

    Process 1 of a container ignores a signal that it does not handle, and loading takes tenths of a second: a
    `docker stop` in between would wait ten seconds, and then kill.
    """
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, _leave)


def _leave(*_: object) -> NoReturn:
    # Nothing is open yet; and sys.exit takes down libraries that are half loaded, where Pinocchio crashes.
    os._exit(0)

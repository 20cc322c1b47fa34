"""What is set before the program loads libraries: signals, and the number of threads."""

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


def one_thread() -> None:
    """OpenBLAS, a part of numpy, starts no threads unless OPENBLAS_NUM_THREADS asks for them.

    Arrays are small here, and a thread for each core takes time to start.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def _leave(*_: object) -> NoReturn:
    # Nothing is open yet; and sys.exit would tear down half loaded libraries, where Pinocchio crashes.
    os._exit(0)

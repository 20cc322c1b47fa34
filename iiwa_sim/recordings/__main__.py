"""The process that writes recordings: `python -m iiwa_sim.recordings DESCRIPTOR PROCESS`.

DESCRIPTOR is that of a socket, over which come, for each recording, a byte with two descriptors: a socket for
its frames, and its file, which is open. The process ends when the socket has ended and all files are whole;
or when PROCESS, which has started it, is gone.
"""

import os
import signal
import socket
import sys
import threading
from contextlib import suppress

LOOKS_S = 1.0
"""Time between two looks whether the process that has started this one is there."""


def main(descriptor: int, process: int) -> None:
    """Write until there is nothing more to write."""
    _step_back()
    from iiwa_sim.recordings.written import write

    def alone() -> bool:
        return os.getppid() != process

    with socket.socket(fileno=descriptor) as control:
        control.settimeout(LOOKS_S)
        while True:
            try:
                said, given, *_ = socket.recv_fds(control, 1, 2)
            except TimeoutError:
                if alone():
                    break
                continue
            if not said:
                break
            if len(given) < 2:  # too many files are open: whoever has sent them sees that nobody is here
                for descriptor in given:
                    os.close(descriptor)
                continue
            connection, file = given
            stream = os.fdopen(file, "wb")
            frames = socket.socket(fileno=connection)
            threading.Thread(target=write, args=(frames, stream, alone)).start()


def _step_back() -> None:
    """Interrupt nobody who computes, and end with nothing but the recordings."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    if hasattr(os, "sched_setscheduler"):  # nor is the strict priority for it that a robot may have
        with suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))

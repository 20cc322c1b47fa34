"""The page as a process that the simulator starts: `python -m iiwa_sim.view`, with a `Task` in JSON on stdin.

It ends with stdin, so it does not outlive the simulator.
"""

import os
import signal
import socket
import sys
import threading

import msgspec

from iiwa_sim import log
from iiwa_sim.server.token import Token
from iiwa_sim.view.app import run_page
from iiwa_sim.view.connection import Place


class Task(msgspec.Struct, frozen=True, kw_only=True):
    """Settings of the page."""

    listening: int
    """The descriptor of a socket that listens."""
    places: list[Place]
    token: str | None
    """Token that browsers have to give; None without one."""
    log_level: str
    log_json: bool


def main() -> None:
    """Serve until stdin ends."""
    for number in (signal.SIGINT, signal.SIGTERM):  # the terminal's Ctrl-C is for who has started it
        signal.signal(number, signal.SIG_IGN)
    task = msgspec.json.decode(sys.stdin.buffer.readline(), type=Task)
    log.configure(task.log_level, task.log_json, 2)
    over = threading.Event()

    def wait() -> None:
        os.read(0, 1)  # nothing comes but the end
        over.set()

    threading.Thread(target=wait, daemon=True).start()
    token = None if task.token is None else Token(task.token)
    run_page(socket.socket(fileno=task.listening), task.places, over, token)


if __name__ == "__main__":
    main()

"""The page as a process that the simulator starts: `python -m iiwa_sim.view`.

`iiwa_sim.cli.serve` writes its settings as JSON to stdin. It ends with stdin, so it does not outlive the
simulator.
"""

import os
import socket
import sys
import threading

import msgspec

from iiwa_sim import log
from iiwa_sim.server.token import Token
from iiwa_sim.view.app import run_page
from iiwa_sim.view.connection import Place


def main() -> None:
    """Serve until stdin ends."""
    task = msgspec.json.decode(sys.stdin.buffer.readline())
    log.configure(task["log_level"], task["log_json"], 2)
    over = threading.Event()

    def wait() -> None:
        os.read(0, 1)  # nothing comes but the end
        over.set()

    threading.Thread(target=wait, daemon=True).start()
    token, places = task["token"], msgspec.convert(task["places"], list[Place])
    run_page(socket.socket(fileno=task["listening"]), places, over, token and Token(token))


if __name__ == "__main__":
    main()

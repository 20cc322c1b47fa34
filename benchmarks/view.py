"""What three open pages and a recording do to who talks to the robot: answers beside those of a robot alone.

The goal is 1.2 times the slowest hundredth; it is told, not held: a busy machine decides it.
"""

import contextlib
import json
import multiprocessing
import socket
import tempfile
import time
from collections.abc import Iterator
from multiprocessing.synchronize import Event
from pathlib import Path
from statistics import median

import msgspec
import viser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from benchmarks.figures import Figure, percentile
from benchmarks.peers import IIWA_SIM, Line, listening
from benchmarks.replies import QUESTION, check_moving, keep_moving

VIEWERS = 3
ASKS, WARM_UP = 4000, 200
PERIOD_S = 0.005
"""Between two questions to one robot: a driver that asks 200 times a second. For one that never waits the
recording would have to write as many lines."""
STARTS_S = 60.0
CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (2.0, 0.0, 1.0),
    "fov": 1.0,
    "near": 0.01,
    "far": 100.0,
    "image_height": 480,
    "image_width": 640,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}
"""What makes a viewer one to whom the robot is shown."""


def measure() -> list[Figure]:
    """Questions to both robots alternate, so that other load affects both; viewers draw nothing."""
    page, status = _free_port(), _free_port()
    of_watched: list[float] = []
    of_alone: list[float] = []
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as running:
        record = str(Path(folder, "run.mcap"))
        options = ("--view-port", str(page), "--status-port", str(status), "--record", record)
        watched = running.enter_context(Line(*running.enter_context(listening([*IIWA_SIM, *options]))))
        alone = running.enter_context(Line(*running.enter_context(listening(IIWA_SIM))))
        running.enter_context(_viewers(page))
        for line in (watched, alone):
            keep_moving(line)
        first_tick, first_s = _tick(status)
        for ask in range(ASKS + WARM_UP):
            for line, samples in ((watched, of_watched), (alone, of_alone)):
                time.sleep(0.5 * PERIOD_S)
                took_us = line.timed(QUESTION)[0]
                if ask >= WARM_UP:
                    samples.append(took_us)
        for line in (watched, alone):
            check_moving(line)
        last_tick, last_s = _tick(status)
    return [
        Figure(
            "with three pages and a recording, ask-answer, p50",
            median(of_watched),
            "us",
            median(of_alone),
        ),
        Figure(
            "with three pages and a recording, ask-answer, p99",
            percentile(of_watched, 0.99),
            "us",
            percentile(of_alone, 0.99),
        ),
        Figure("ticks in a real second, meanwhile", (last_tick - first_tick) / (last_s - first_s), "Hz"),
    ]


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port: int = free.getsockname()[1]
    return port


def _tick(status_port: int) -> tuple[int, float]:
    """The newest tick, and when it was told (s)."""
    with (
        socket.create_connection(("127.0.0.1", status_port), STARTS_S) as port,
        port.makefile("rb") as lines,
    ):
        tick: int = json.loads(lines.readline())["tick"]
        return tick, time.monotonic()


@contextlib.contextmanager
def _viewers(page_port: int) -> Iterator[None]:
    """Viewers of a page, in a process of their own; all see it when the context is entered."""
    there = multiprocessing.Event()
    process = multiprocessing.Process(target=_view, args=(page_port, there), daemon=True)
    process.start()
    try:
        if not there.wait(STARTS_S):
            raise RuntimeError("nobody sees the page")
        yield
    finally:
        process.kill()
        process.join()


def _view(page_port: int, there: Event) -> None:
    with contextlib.ExitStack() as connected:
        viewers = [
            connected.enter_context(
                connect(
                    f"ws://127.0.0.1:{page_port}/",
                    subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
                    compression=None,
                    max_size=None,
                    open_timeout=STARTS_S,
                )
            )
            for _ in range(VIEWERS)
        ]
        for viewer in viewers:
            viewer.send(msgspec.msgpack.encode(CAMERA))
            viewer.recv(STARTS_S)
        there.set()
        with contextlib.suppress(ConnectionClosed):
            while True:
                for viewer in viewers:
                    viewer.recv()

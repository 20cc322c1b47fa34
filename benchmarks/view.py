"""What three open pages and a recording do to who talks to the robot: answers with them beside those without.

One robot; blocks with both alternate with blocks without, many times, and medians over blocks are compared:
neither other load nor one stall of the machine decides. The goal is 1.2 times the slowest hundredth; it is
told, not held.
"""

import contextlib
import json
import multiprocessing
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from multiprocessing.connection import Connection
from multiprocessing.synchronize import Event
from pathlib import Path
from statistics import median, quantiles
from typing import NamedTuple

import msgspec
import viser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from benchmarks.figures import Figure, Kind, percentile
from benchmarks.peers import Line
from benchmarks.replies import QUESTION, check_moving, keep_moving
from iiwa_sim.simulator import Simulator

VIEWERS = 3
BLOCKS, ASKS, WARM_UP = 20, 1000, 200
"""Blocks of each kind, questions in each, and questions before the first that counts."""
PERIOD_S = 0.005
"""Between two questions: a driver that asks 200 times a second. For one that never waits the recording would
have to write as many lines."""
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


class Block(NamedTuple):
    """What some seconds of questions have shown."""

    p50_us: float
    p99_us: float
    ticks_hz: float


def measure() -> list[Figure]:
    """Viewers draw nothing: it is not known what else browsers have to do."""
    page = _free_port()
    with_them: list[Block] = []
    without: list[Block] = []
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as running:
        robot = running.enter_context(_robot())
        port, status, backdoor = robot.recv()
        running.enter_context(_page(page, status, backdoor))
        line = running.enter_context(Line("127.0.0.1", port))
        keep_moving(line)
        for number in range(BLOCKS):
            with _viewers(page):
                _told(robot, str(Path(folder, f"{number}.mcap")))
                with_them.append(_block(line, status))
                _told(robot, "")
            without.append(_block(line, status))
            check_moving(line)
        robot.send(None)
    ratios = [one.p99_us / other.p99_us for one, other in zip(with_them, without, strict=True)]
    lower, _, upper = quantiles(ratios)
    both = "with three pages and a recording"
    return [
        _compared(f"{both}, ask-answer, p50, median of blocks", with_them, without, "p50_us"),
        _compared(f"{both}, ask-answer, p99, median of blocks", with_them, without, "p99_us", 1.2),
        Figure("the same, a block beside the next one: a quarter is below", lower, "times"),
        Figure("the same: a quarter is above", upper, "times"),
        Figure("ticks in a real second, meanwhile", median(each.ticks_hz for each in with_them), "Hz"),
    ]


def _compared(
    name: str, with_them: list[Block], without: list[Block], what: str, at_most: float | None = None
) -> Figure:
    value, floor = (median(getattr(each, what) for each in blocks) for blocks in (with_them, without))
    kind = None if at_most is None else Kind.TAIL
    return Figure(name, value, "us", floor, ratio_at_most=at_most, kind=kind)


def _block(line: Line, status: int) -> Block:
    samples: list[float] = []
    first_tick, first_s = _tick(status)
    for ask in range(ASKS + WARM_UP):
        time.sleep(PERIOD_S)
        took_us = line.timed(QUESTION)[0]
        if ask >= WARM_UP:
            samples.append(took_us)
    last_tick, last_s = _tick(status)
    ticks_hz = (last_tick - first_tick) / (last_s - first_s)
    return Block(median(samples), percentile(samples, 0.99), ticks_hz)


@contextlib.contextmanager
def _robot() -> Iterator[Connection]:
    """A robot in a process of its own. It tells its ports (driver, status, backdoor); each path that it is
    sent then begins a recording, "" ends it, and None ends the process; what is done is answered."""
    spawning = multiprocessing.get_context("spawn")  # with nothing of this process in it
    here, there = spawning.Pipe()
    process = spawning.Process(target=_run_robot, args=(there,), daemon=True)
    process.start()
    try:
        yield here
    finally:
        process.kill()
        process.join()


def _run_robot(pipe: Connection) -> None:
    with Simulator(port=0, status_port=0, backdoor_port=0) as robot:
        pipe.send((robot.port, robot.status_port, robot.backdoor_port))
        recording = None
        for path in iter(pipe.recv, None):
            if recording is not None:
                recording.close()
            recording = robot.record(path) if path else None
            pipe.send(True)


def _told(robot: Connection, path: str) -> None:
    robot.send(path)
    robot.recv()


@contextlib.contextmanager
def _page(port: int, status: int, backdoor: int) -> Iterator[None]:
    """A page of a robot."""
    command = [
        sys.executable,
        "-m",
        "iiwa_sim",
        "view",
        f"127.0.0.1:{status}",
        "--backdoor",
        f"127.0.0.1:{backdoor}",
    ]
    with subprocess.Popen([*command, "--port", f"{port}"], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            if not process.stdout.readline().startswith("page on "):
                raise RuntimeError("the page did not start")
            yield
        finally:
            process.terminate()


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

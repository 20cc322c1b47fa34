"""A hundred robots in one process, each asked 50 times a second; and the duration of a start.

All robots rest, or ten of them move. The reference is a hundred bare echo servers in one process.
"""

import asyncio
import contextlib
import subprocess
import sys
from collections.abc import Iterator
from statistics import median
from time import perf_counter

from benchmarks.echo import Echo
from benchmarks.figures import Figure, Kind, percentile
from iiwa_sim.simulator import Simulator

ROBOTS = 100
PERIOD_S = 0.02
SECONDS = 8.0
WARM_UP_S = 1.0
QUESTION = b"get joint position\r\n"
STARTS = 50
MOVING = 10
TARGETS = ("0.8 0.6 0.2 -1.2 0.3 1.4 0.5", "-0.8 0.3 -0.2 -0.9 -0.3 1.7 -0.5")
MOVES = 12
"""Moves that each robot that moves is sent: more than it makes in the time."""


def measure() -> list[Figure]:
    """Measure replies of both fleets, one after the other, and the start of a simulator in a thread."""
    of_robots, of_echoes = (_latencies_us(kind, 0) for kind in ("robots", "echoes"))
    while_some_move = _latencies_us("robots", MOVING)
    of = f"{ROBOTS} in one process, each asked at {1 / PERIOD_S:g} Hz"
    return [
        Figure(f"{of}, p50", percentile(of_robots, 0.5), "us", percentile(of_echoes, 0.5)),
        Figure(f"{of}, p99", percentile(of_robots, 0.99), "us", percentile(of_echoes, 0.99)),
        Figure(
            f"the same while {MOVING} move, p99",
            percentile(while_some_move, 0.99),
            "us",
            percentile(of_echoes, 0.99),
            ratio_at_most=5,
            kind=Kind.WALL,
        ),
        Figure(
            "a simulator in a thread, to readiness, p50", median(_start_ms() for _ in range(STARTS)), "ms"
        ),
    ]


def _start_ms() -> float:
    began = perf_counter()
    with Simulator():
        return 1e3 * (perf_counter() - began)


def _latencies_us(kind: str, moving: int) -> list[float]:
    with _fleet(kind) as ports:
        return asyncio.run(_ask_all(ports, moving))


@contextlib.contextmanager
def _fleet(kind: str) -> Iterator[list[int]]:
    """The ports of a fleet in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.fleet", kind]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            yield [int(port) for port in process.stdout.readline().split()]
        finally:
            process.terminate()


async def _ask_all(ports: list[int], moving: int) -> list[float]:
    """Latencies of all replies, without those of the first second; the first `moving` robots move."""
    taken: list[float] = []
    drivers = [await _set_going(port) for port in ports[:moving]]
    asking = [_ask(port, PERIOD_S * k / len(ports), taken) for k, port in enumerate(ports)]
    await asyncio.gather(*asking)
    for driver in drivers:
        driver.close()
    return taken


async def _set_going(port: int) -> asyncio.StreamWriter:
    """Send moves there and back; returns the connection, without which the robot would stop."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    for turn in range(MOVES):
        writer.write(f"joint move : {TARGETS[turn % 2]} {' '.join(['0.15'] * 7)}\r\n".encode())
        if await reader.readline() != b"done\r\n":
            raise RuntimeError("a move was refused")
    return writer


async def _ask(port: int, delay_s: float, taken: list[float]) -> None:
    """Ask at fixed times; a late request is sent at once."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    begin = perf_counter() + delay_s
    for k in range(int((WARM_UP_S + SECONDS) / PERIOD_S)):
        await asyncio.sleep(begin + k * PERIOD_S - perf_counter())
        began = perf_counter()
        writer.write(QUESTION)
        await reader.readline()
        if k * PERIOD_S >= WARM_UP_S:
            taken.append(1e6 * (perf_counter() - began))
    writer.close()
    await writer.wait_closed()


async def _serve(kind: str) -> None:
    """Serve a fleet and report its ports."""
    async with contextlib.AsyncExitStack() as stack:
        if kind == "robots":
            robots = [await stack.enter_async_context(Simulator()) for _ in range(ROBOTS)]
            ports = [robot.port for robot in robots]
        else:
            loop = asyncio.get_running_loop()
            servers = [await loop.create_server(Echo, "127.0.0.1", 0) for _ in range(ROBOTS)]
            ports = [server.sockets[0].getsockname()[1] for server in servers]
        print(*ports, flush=True)
        await asyncio.Event().wait()


if __name__ == "__main__":
    asyncio.run(_serve(sys.argv[1]))

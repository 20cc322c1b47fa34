"""Latency of iiwa-sim while its robot moves or presses: request by request, and pipelined."""

import threading
from pathlib import Path
from statistics import median
from time import perf_counter, sleep

from benchmarks.figure import Figure, percentile
from benchmarks.servers import Line, both, one_processor

TABLE = Path(__file__).parent.parent / "examples" / "table.toml"
QUESTION = b"get joint position\r\n"
FORCE = b"get cartesian force\r\n"
BLOCKS, ASKS_PER_BLOCK = 60, 500
PIPELINES, LINES_PER_PIPELINE = 10, 50_000
DRIVERS_QUERIES = [
    f"get {what}\r\n".encode()
    for what in ("joint position", "joint torque", "tool frame", "flange frame", "cartesian force")
]
CADENCE_S, CADENCE_PERIODS = 0.01, 500


def measure() -> list[Figure]:
    """Measure; blocks of both servers alternate, so that other load affects both."""
    with one_processor(), both() as (sim, echo):
        keep_moving(sim)
        found = _ask_answer(sim, echo, QUESTION, "moving")
    with one_processor(), both(str(TABLE)) as (sim, echo):
        keep_pressing(sim)
        found += _ask_answer(sim, echo, FORCE, "pressing")
    with both() as (sim, echo):
        keep_moving(sim)
        found += [_pipelined(sim, echo, QUESTION), _pipelined(sim, echo, b"hello\r\n")]
    with both() as (sim, echo):
        return found + _cadence(sim, echo)


def keep_moving(sim: Line) -> None:
    """Queue slow moves back and forth, for half an hour."""
    for turn in range(300):
        target = "0.8 0.6 0.2 -1.2 0.3 1.4 0.5" if turn % 2 else "-0.8 0.3 -0.2 -0.9 -0.3 1.7 -0.5"
        sim.asks(f"joint move : {target} {' '.join(['0.15'] * 7)}")


def keep_pressing(sim: Line) -> None:
    """Queue slow force moves back and forth, a millimetre deep in the table, for more than half an hour."""
    for turn in range(300):
        frame = f"600 {150 if turn % 2 else -150} 302 3.14159265359 0 3.14159265359"
        sim.asks(f"linforce move : {frame} {0.02 if turn else 1} 0 1000 1000 1000")
    while float(sim.ask(FORCE).split()[2]) > -19.0:
        sim.asks("get status", "moving")


def _ask_answer(sim: Line, echo: Line, question: bytes, how: str) -> list[Figure]:
    samples: dict[Line, list[float]] = {sim: [], echo: []}
    for block in range(BLOCKS + 2):
        for line, of_line in samples.items():
            taken = [line.latency_us(question) for _ in range(ASKS_PER_BLOCK)]
            of_line += taken if block >= 2 else []  # warm-up
        sim.asks("get status", "moving")
    name = f"ask-answer, {question.decode().strip()}, {how}"
    p50, p99 = ([percentile(samples[line], share) for line in (sim, echo)] for share in (0.5, 0.99))
    return [
        Figure(f"{name}, p50", p50[0], "us", p50[1], at_most=1.1, margin=2.0),
        Figure(f"{name}, p99", p99[0], "us", p99[1], at_most=1.5),
    ]


def _cadence(sim: Line, echo: Line) -> list[Figure]:
    """Measure the load of the public driver: 550 queries and 50 moves a second."""
    of_sim: list[float] = []
    of_echo: list[float] = []
    begun = perf_counter()
    for period in range(CADENCE_PERIODS):
        sleep(max(0.0, begun + period * CADENCE_S - perf_counter()))
        queries = [*DRIVERS_QUERIES, b"get status\r\n"] if period % 2 else DRIVERS_QUERIES
        if period % 2:
            sim.asks(f"smart joint move : {0.002 * (period % 400)} 0.5 0 -1 0 1.5 0 {'0.2 ' * 7}")
        for line in queries:
            of_sim.append(sim.latency_us(line))
            of_echo.append(echo.latency_us(line))
    rate = CADENCE_PERIODS / (perf_counter() - begun)
    p99 = [percentile(samples, 0.99) for samples in (of_sim, of_echo)]
    return [
        Figure("550 queries and 50 moves a second, periods", rate, "Hz", at_least=99.0),
        # A request may meet a tick in progress.
        Figure("550 queries and 50 moves a second, p99 of the queries", p99[0], "us", p99[1], at_most=3.0),
    ]


def _pipelined(sim: Line, echo: Line, question: bytes) -> Figure:
    rates: dict[Line, list[float]] = {sim: [], echo: []}
    for _ in range(PIPELINES):
        for line, of_line in rates.items():
            of_line.append(_flood(line, question))
        sim.asks("get status", "moving")
    return Figure(
        f"pipelined, {question.decode().strip()}", median(rates[sim]), "commands/s", median(rates[echo])
    )


def _flood(line: Line, question: bytes) -> float:
    """Return replies per second to pipelined lines."""
    sender = threading.Thread(target=line.socket.sendall, args=(question * LINES_PER_PIPELINE,))
    start = perf_counter()
    sender.start()
    replies = 0
    while replies < LINES_PER_PIPELINE:
        data = line.socket.recv(1 << 18)
        if not data:
            raise ConnectionError("the server closed the connection")
        replies += data.count(b"\n")
    taken = perf_counter() - start
    sender.join()
    return LINES_PER_PIPELINE / taken

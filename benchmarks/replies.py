"""Latency of iiwa-sim while its robot moves or presses: request by request, and pipelined."""

import threading
from pathlib import Path
from statistics import median
from time import perf_counter, sleep

from benchmarks.figures import Figure, Kind, percentile
from benchmarks.peers import Line, both, one_processor

TABLE = Path(__file__).parent.parent / "examples" / "table.toml"
QUESTION = b"get joint position\r\n"
FORCE = b"get cartesian force\r\n"
BLOCKS = 60
ASKS_PER_BLOCK = 500
PIPELINES = 10
LINES_PER_PIPELINE = 50_000
DRIVERS_QUERIES = [
    f"get {what}\r\n".encode()
    for what in ("joint position", "joint torque", "tool frame", "flange frame", "cartesian force")
]
STATUS = b"get status\r\n"
CADENCE_S = 0.01
CADENCE_PERIODS = 500


def measure() -> list[Figure]:
    """Measure; blocks of both servers alternate, so that other load affects both."""
    with one_processor(), both() as (sim, echo):
        keep_moving(sim)
        found = _ask_answer(sim, echo, QUESTION, "")
    with one_processor(), both(str(TABLE)) as (sim, echo):
        keep_pressing(sim)
        found += _ask_answer(sim, echo, FORCE, ", pressing")
    with both() as (sim, echo):
        keep_moving(sim)
        found += [
            *_pipelined(sim, echo, QUESTION),
            *_pipelined(sim, echo, b"hello\r\n"),
        ]
    with both() as (sim, echo):
        return found + _cadence(sim, echo)


def keep_moving(sim: Line) -> None:
    """Queue slow moves back and forth, for half an hour."""
    for turn in range(300):
        target = "0.8 0.6 0.2 -1.2 0.3 1.4 0.5" if turn % 2 else "-0.8 0.3 -0.2 -0.9 -0.3 1.7 -0.5"
        reply = sim.ask(f"joint move : {target} {' '.join(['0.15'] * 7)}\r\n".encode())
        if reply != b"done\r\n":
            raise RuntimeError(f"joint move: {reply!r}")


def keep_pressing(sim: Line) -> None:
    """Queue slow force moves back and forth, a millimetre deep in the table, for more than half an hour."""
    for turn in range(300):
        frame = f"600 {150 if turn % 2 else -150} 302 3.14159265359 0 3.14159265359"
        reply = sim.ask(f"linforce move : {frame} {0.02 if turn else 1} 0 1000 1000 1000\r\n".encode())
        if reply != b"done\r\n":
            raise RuntimeError(f"linforce move: {reply!r}")
    while float(sim.ask(FORCE).split()[2]) > -19.0:
        check_moving(sim)


def check_moving(sim: Line) -> None:
    if sim.ask(b"get status\r\n") != b"moving\r\n":
        raise RuntimeError("the robot should have moved all the time")


def _ask_answer(sim: Line, echo: Line, question: bytes, how: str) -> list[Figure]:
    of_sim: list[float] = []
    of_echo: list[float] = []
    for block in range(BLOCKS + 2):
        for line, samples in ((sim, of_sim), (echo, of_echo)):
            block_of = [line.timed(question)[0] for _ in range(ASKS_PER_BLOCK)]
            if block >= 2:  # warm-up
                samples += block_of
        check_moving(sim)
    return [
        Figure(
            f"ask-answer, {question.decode().strip()}{how}, {name}",
            value,
            "us",
            floor,
            ratio_at_most=goal,
            kind=kind,
        )
        for name, value, floor, goal, kind in (
            ("p50", median(of_sim), median(of_echo), 1.1, Kind.RATIO),
            ("p99", percentile(of_sim, 0.99), percentile(of_echo, 0.99), 1.5, Kind.TAIL),
        )
    ]


def _cadence(sim: Line, echo: Line) -> list[Figure]:
    """The load of the public driver: five queries 100 times a second, status and a move 50 times a second."""
    of_sim: list[float] = []
    of_echo: list[float] = []
    of_moves: list[float] = []
    begun = perf_counter()
    for period in range(CADENCE_PERIODS):
        sleep(max(0.0, begun + period * CADENCE_S - perf_counter()))
        if period % 2:
            a1 = 0.002 * (period % 400)
            move = f"smart joint move : {a1} 0.5 0 -1 0 1.5 0 {'0.2 ' * 7}\r\n"
            of_moves.append(sim.timed(move.encode())[0])
        for line in [*DRIVERS_QUERIES, STATUS] if period % 2 else DRIVERS_QUERIES:
            of_sim.append(sim.timed(line)[0])
            of_echo.append(echo.timed(line)[0])
    rate = CADENCE_PERIODS / (perf_counter() - begun)
    name = "550 queries and 50 moves a second"
    return [
        Figure(f"{name}, periods a second", rate, "Hz", at_least=99.0, kind=Kind.WALL),
        Figure(
            f"{name}, p99 of the queries",
            percentile(of_sim, 0.99),
            "us",
            percentile(of_echo, 0.99),
            # A request may meet a tick in progress. Nine runs, some beside busy loops: 1.0 to 1.9.
            ratio_at_most=3.0,
            kind=Kind.TAIL,
        ),
        Figure(f"{name}, p99 of the moves", percentile(of_moves, 0.99), "us"),
    ]


def _pipelined(sim: Line, echo: Line, question: bytes) -> list[Figure]:
    of_sim: list[float] = []
    of_echo: list[float] = []
    for _ in range(PIPELINES):
        for line, rates in ((sim, of_sim), (echo, of_echo)):
            rates.append(_flood(line, question))
        check_moving(sim)
    name = question.decode().strip()
    return [Figure(f"pipelined, {name}", median(of_sim), "commands/s", median(of_echo))]


def _flood(line: Line, question: bytes) -> float:
    """Replies per second to pipelined lines."""
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

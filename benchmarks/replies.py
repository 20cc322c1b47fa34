"""How fast iiwa-sim answers while its robot moves: strictly ask-answer, and pipelined."""

import threading
from statistics import median
from time import perf_counter

from benchmarks.figures import Figure, percentile
from benchmarks.peers import Line, both

QUESTION = b"get joint position\r\n"
BLOCKS = 60
ASKS_PER_BLOCK = 500
PIPELINES = 10
LINES_PER_PIPELINE = 50_000


def measure() -> list[Figure]:
    """Blocks of both servers alternate, so that whatever else the machine does hits both."""
    with both() as (sim, echo):
        keep_moving(sim)
        return _ask_answer(sim, echo) + _pipelined(sim, echo, QUESTION) + _pipelined(sim, echo, b"hello\r\n")


def keep_moving(sim: Line) -> None:
    """Queue slow moves there and back, half an hour of them."""
    for turn in range(300):
        target = "0.8 0.6 0.2 -1.2 0.3 1.4 0.5" if turn % 2 else "-0.8 0.3 -0.2 -0.9 -0.3 1.7 -0.5"
        reply = sim.ask(f"joint move : {target} {' '.join(['0.15'] * 7)}\r\n".encode())
        if reply != b"done\r\n":
            raise RuntimeError(f"joint move: {reply!r}")


def check_moving(sim: Line) -> None:
    if sim.ask(b"get status\r\n") != b"moving\r\n":
        raise RuntimeError("the robot should have moved all the time")


def _ask_answer(sim: Line, echo: Line) -> list[Figure]:
    of_sim: list[float] = []
    of_echo: list[float] = []
    for block in range(BLOCKS + 2):
        for line, samples in ((sim, of_sim), (echo, of_echo)):
            block_of = [line.timed(QUESTION)[0] for _ in range(ASKS_PER_BLOCK)]
            if block >= 2:  # the first ones warm up
                samples += block_of
        check_moving(sim)
    return [
        Figure(f"ask-answer, get joint position, {name}", value, "us", floor, ratio_at_most=goal)
        for name, value, floor, goal in (
            ("p50", median(of_sim), median(of_echo), 1.1),
            ("p99", percentile(of_sim, 0.99), percentile(of_echo, 0.99), 1.5),
        )
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
    """Replies per second to as many lines as the server takes in."""
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

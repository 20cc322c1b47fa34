"""Latency of a move's reply while the robot moves and the queue fills.

The reply comes when the path is found and checked: reach, limits, singular poses. Its timing is planned in
the tick in which the move begins; see `durations` for that cost.
"""

import random
from collections.abc import Callable
from statistics import median
from time import sleep

from benchmarks.figures import Figure, Kind, percentile
from benchmarks.peers import Line, both

SEED = 2
BLOCKS = 8
MOVES_PER_BLOCK = 150
HOME = "0 0.5235987755982988 0 -1.0471975511965976 0 1.5707963267948966 0"


def measure() -> list[Figure]:
    """Measure; blocks of moves alternate with blocks of the same lines to the echo server."""
    with both() as (sim, echo):
        _rest_at_home(sim)
        centre = [float(word) for word in sim.ask(b"get tool frame\r\n").split()]
        chance = random.Random(SEED)
        found: list[Figure] = []
        kinds: tuple[tuple[str, Callable[[], str]], ...] = (
            ("joint move", lambda: f"joint move : {_joints(chance)} {_numbers([0.5] * 7)}"),
            ("ptp move", lambda: f"ptp move : {_frame(chance, centre)} 0.5 10"),
            ("lin move", lambda: f"lin move : {_frame(chance, centre)} 0.5 10"),
        )
        for name, command in kinds:
            found += _one_kind(sim, echo, name, command)
        return found


def _one_kind(sim: Line, echo: Line, name: str, command: Callable[[], str]) -> list[Figure]:
    of_sim: list[float] = []
    of_echo: list[float] = []
    for _ in range(BLOCKS):
        lines = [f"{command()}\r\n".encode() for _ in range(MOVES_PER_BLOCK)]
        for line in lines:
            taken, reply = sim.timed(line)
            if reply != b"done\r\n":
                raise RuntimeError(f"{line!r}: {reply!r}")
            of_sim.append(taken)
        of_echo += [echo.timed(line)[0] for line in lines]
        _rest_at_home(sim)
    slow_sim, slow_echo = percentile(of_sim, 0.99), percentile(of_echo, 0.99)
    return [
        Figure(f"reply to {name}, p50", median(of_sim), "us", median(of_echo)),
        Figure(f"reply to {name}, p99", slow_sim, "us", slow_echo, at_most=2000, kind=Kind.WALL),
    ]


def _rest_at_home(sim: Line) -> None:
    for line in ("stop", f"joint move : {HOME} {_numbers([1.0] * 7)}"):
        if sim.ask(f"{line}\r\n".encode()) != b"done\r\n":
            raise RuntimeError(line)
    while sim.ask(b"get status\r\n") == b"moving\r\n":
        sleep(0.02)


def _joints(chance: random.Random) -> str:
    return _numbers([chance.uniform(-1.5, 1.5) for _ in range(7)])


def _frame(chance: random.Random, centre: list[float]) -> str:
    """A random frame in a box of 200 x 400 x 200 mm, turned by up to 0.3 rad, reachable by straight lines."""
    sides = ((-150, 50), (-200, 200), (-150, 50), (-0.3, 0.3), (-0.3, 0.3), (-0.3, 0.3))
    return _numbers([c + chance.uniform(*side) for c, side in zip(centre, sides, strict=True)])


def _numbers(values: list[float]) -> str:
    return " ".join(f"{value:.6f}" for value in values)

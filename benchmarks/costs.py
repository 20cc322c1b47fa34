"""CPU time of moves: to accept them, to plan them while the robot moves, and to reply."""

import gc
from statistics import median
from time import thread_time
from typing import NamedTuple

import numpy as np

from benchmarks.figures import Figure, Kind, percentile
from benchmarks.told import ENOUGH, Told
from iiwa_sim.controller.controller import Controller
from iiwa_sim.frames import Frame
from iiwa_sim.protocols.iiwa import IiwaSession
from iiwa_sim.robot.description import load_robot

LONG, SHORT = 1000, 400
"""Moves of a chain that is sent at once, and of one whose moves are sent as long as four wait."""
TICK_S = 0.002
REPEATS = 3
RADII_MM = (5.0, 80.0)
SPEEDS_REL = (0.1, 1.0)
LOW, HIGH = (-150.0, -200.0, -150.0), (50.0, 200.0, 50.0)
"""Bounds of the targets, seen from home (mm)."""
TURN_RAD = 0.3
JOINTS_RAD = 0.2
REPLIES = 300
LARGEST_REPLY_US = {"lin": 700.0, "ptp": 400.0, "joint": 400.0}


class Costs(NamedTuple):
    """Microseconds of computing: for accepting each move, for each tick, and for the tick after each move."""

    accepting: list[float]
    ticks: list[float]
    sent_before: list[int]


def measure() -> list[Figure]:
    """Measure chains of mixed moves of the default robot, and replies to moves."""
    return [*_known_at_once(), *_appended(), *_replies()]


def _known_at_once() -> list[Figure]:
    accepting, ticks, _ = _cheapest([_run(LONG, LONG) for _ in range(REPEATS)])
    tick_us = median(ticks)
    in_ticks = (sum(ticks) - len(ticks) * tick_us) / LONG
    of = f"chain of {LONG} mixed moves"
    return [
        Figure(
            f"{of}: planning, mean per move",
            in_ticks + sum(accepting) / LONG,
            "us",
            at_most=500,
            kind=Kind.CPU,
            margin=3,  # missed: some 750
        ),
        Figure(f"{of}: planning while it runs, mean per move", in_ticks, "us"),
        Figure(f"{of}: accepting a move, p50", percentile(accepting, 0.5), "us"),
        Figure(f"{of}: accepting a move, p95", percentile(accepting, 0.95), "us"),
        Figure(f"{of}: accepting one of the last 100, p95", percentile(accepting[-100:], 0.95), "us"),
        Figure(f"{of}: a tick without planning", tick_us, "us"),
        _largest_tick(of, ticks),
    ]


def _appended() -> list[Figure]:
    """Cost of a move in a chain: accepting it, and the extra cost of ticks until the next one is sent."""
    accepting, ticks, sent_before = _cheapest([_run(SHORT, ENOUGH) for _ in range(REPEATS)])
    tick_us = median(ticks)
    above = np.array(ticks) - tick_us
    spent = np.append(0.0, np.cumsum(above))
    # If several moves are sent before a tick, the last one is charged for all extra cost that follows.
    costs = np.array(accepting) + np.diff(spent[[*sent_before, len(ticks)]])
    of = f"{SHORT} mixed moves, each sent when fewer than {ENOUGH} wait"
    return [
        Figure(
            f"{of}: planning, median per move",
            percentile(costs.tolist(), 0.5),
            "us",
            at_most=1000,
            kind=Kind.CPU,
        ),
        Figure(
            f"{of}: planning, p95 per move",
            percentile(costs.tolist(), 0.95),
            "us",
            at_most=2000,
            kind=Kind.CPU,
            margin=4,  # missed: some 2,900
        ),
        _largest_tick(of, ticks),
    ]


def _largest_tick(of: str, ticks: list[float]) -> Figure:
    return Figure(f"{of}: a tick, largest", max(ticks), "us", at_most=1000, kind=Kind.CPU, margin=5)


def _cheapest(runs: list[Costs]) -> Costs:
    """The least cost of each tick and each move over all runs, which excludes other load of the machine."""
    accepting = [min(each) for each in zip(*(run.accepting for run in runs), strict=True)]
    ticks = [min(each) for each in zip(*(run.ticks for run in runs), strict=True)]
    return Costs(accepting, ticks, runs[0].sent_before)


def _run(count: int, waiting: int) -> Costs:
    """Run a chain, sending moves as long as fewer than `waiting` wait."""
    rng = np.random.default_rng(4)
    controller = Controller(load_robot(), TICK_S)
    centre, home = controller.tool_frame(), controller.joints
    unsent = [in_a_box(rng, centre, home) for _ in range(count)][::-1]
    costs = Costs([], [], [])
    gc.collect()
    gc.disable()
    try:
        while unsent or controller.moving:
            while unsent and (not controller.moving or controller.queue < waiting):
                move = unsent.pop()
                began = thread_time()
                move.to(controller)
                costs.accepting.append(1e6 * (thread_time() - began))
                costs.sent_before.append(len(costs.ticks))
            began = thread_time()
            controller.step()
            costs.ticks.append(1e6 * (thread_time() - began))
    finally:
        gc.enable()
    return costs


def in_a_box(rng: np.random.Generator, centre: Frame, home: tuple[float, ...]) -> Told:
    """A random move to a place within 150 mm in x and z, 200 mm in y, of the centre, at any speed."""
    radius_mm, speed_rel = float(rng.uniform(*RADII_MM)), float(rng.uniform(*SPEEDS_REL))
    kind = ("joint", "lin", "ptp")[int(rng.integers(3))]
    if kind == "joint":
        joints = np.add(home, rng.uniform(-JOINTS_RAD, JOINTS_RAD, len(home)))
        return Told(kind, tuple(joints.tolist()), speed_rel)
    shift = (*rng.uniform(LOW, HIGH), *rng.uniform(-TURN_RAD, TURN_RAD, 3))
    return Told(kind, Frame(*np.add(centre, shift).tolist()), speed_rel, radius_mm)


def _replies() -> list[Figure]:
    """CPU time from the line to its reply: before the robot moves, and with a tick after each."""
    figures = []
    for kind, at_most in LARGEST_REPLY_US.items():
        for busy in (False, True):
            costs = [
                min(each) for each in zip(*(_replying_us(kind, busy) for _ in range(REPEATS)), strict=True)
            ]
            name = f"computing the reply to {kind} move, {'under way' if busy else 'before they begin'}"
            figures += [
                Figure(f"{name}, p50", percentile(costs, 0.5), "us"),
                Figure(
                    f"{name}, p99", percentile(costs, 0.99), "us", at_most=at_most, kind=Kind.CPU, margin=10
                ),
            ]
    return figures


def _replying_us(kind: str, busy: bool) -> list[float]:
    rng = np.random.default_rng(6)
    controller = Controller(load_robot(), TICK_S)
    session = IiwaSession(controller, _Silent(), "benchmark")
    centre, home = controller.tool_frame(), controller.joints
    taken: list[float] = []
    gc.collect()
    gc.disable()
    try:
        while len(taken) < REPLIES:
            move = in_a_box(rng, centre, home)
            if move.kind != kind:
                continue
            line = f"{move.line}\r\n".encode()
            began = thread_time()
            session.receive(line)
            reply = session.answer()
            taken.append(1e6 * (thread_time() - began))
            if reply != b"done\r\n":
                raise RuntimeError(f"{line!r}: {reply!r}")
            if busy:
                controller.step()
    finally:
        gc.enable()
    return taken


class _Silent:
    """A log that drops its entries."""

    def wants_commands(self) -> bool:
        return False

    def command(self, session: str, line: str, reply: str) -> None: ...

    def refused(self, session: str, line: str, code: int, reason: str) -> None: ...

    def ignored(self, session: str, command: str, takes: str, beyond: int) -> None: ...

    def odd(self, session: str, command: str, remark: str) -> None: ...

    def stopped(self, session: str, vanished: bool) -> None: ...

    def exception(self, session: str, line: str, fault: Exception) -> None: ...

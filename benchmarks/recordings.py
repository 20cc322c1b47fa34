"""What a recording costs at 500 Hz while the robot moves: computing, bytes, and how much later ticks come."""

import gc
import random
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from benchmarks.figures import Figure, Kind, percentile
from iiwa_sim.cell.cell import robot_alone
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.requests import Kind as How
from iiwa_sim.controller.requests import MoveRequest
from iiwa_sim.protocols.dialogue import Dialogue
from iiwa_sim.recordings.recorder import Recorder

SEED = 5
RATE_HZ = 500
PERIOD_NS = 1_000_000_000 // RATE_HZ
BLOCK_S = 5
BLOCKS = 4
"""Blocks of each kind, in turn: recorded and not."""
LINES_HZ = 50
"""A driver that asks for the joints so often."""
MINUTE_S = 60.0


class Block(NamedTuple):
    """What so many seconds of a robot at the pace of real time have shown."""

    computing_s: float
    """By the recording: in ticks, in lines, and in the process that writes. Of a robot that is not recorded:
    what it takes to ask for that, some 0.3 %."""
    longest_s: float
    """The most of it in one tick, with what is handed over there."""
    late_ms: list[float]
    """How much after it was due each tick was done."""
    size: int
    """Bytes of the file."""


def measure() -> list[Figure]:
    """Blocks that are recorded alternate with some that are not, and with a loop that only sleeps."""
    return _figures(BLOCKS)


def gate() -> list[Figure]:
    """What CI has the time for."""
    return _figures(2)


def _figures(blocks: int) -> list[Figure]:
    recorded: list[Block] = []
    bare: list[Block] = []
    asleep_ms: list[float] = []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(blocks):
            recorded.append(_block(Path(folder, f"{number}.mcap"), number))
            bare.append(_block(None, number))
            asleep_ms.extend(_slept())
    seconds = blocks * BLOCK_S
    late = [each for block in recorded for each in block.late_ms]
    late_bare = [each for block in bare for each in block.late_ms]
    return [
        Figure(
            "a recording at 500 Hz: computing, of a core",
            1e2 * (_least_s(recorded) - _least_s(bare)) / BLOCK_S,
            "%",
            at_most=3,
            kind=Kind.CPU,
            margin=4,  # missed beside other work: 4.7, with cold caches 500 times a second
        ),
        Figure(
            "a recording at 500 Hz: a minute of motion",
            1e-6 * sum(block.size for block in recorded) * MINUTE_S / seconds,
            "MB",
            at_most=8,
            kind=Kind.SIMULATED,
            margin=1.2,  # where chunks end hangs on real time
        ),
        Figure(
            "a recording at 500 Hz: computing in one tick, at most",
            1e3 * max(block.longest_s for block in recorded),
            "ms",
            at_most=1,
            kind=Kind.CPU,
        ),
        Figure(
            "ticks of a robot that is recorded: done after they are due, p99",
            percentile(late, 0.99),
            "ms",
            percentile(late_bare, 0.99),
        ),
        Figure(
            "the same, at most; beside a loop that only sleeps, at most",
            max(late),
            "ms",
            max(asleep_ms),
            at_most=1,
            kind=Kind.WALL,
        ),
        _share(
            "ticks of a robot that is recorded: over 1 ms late; beside a loop that only sleeps",
            late,
            asleep_ms,
        ),
        _share("the same of a robot that is not recorded", late_bare, asleep_ms),
    ]


def _share(name: str, late_ms: list[float], floor_ms: list[float]) -> Figure:
    """How many are late by more than a millisecond."""
    value, floor = (100.0 * sum(each > 1.0 for each in them) / len(them) for them in (late_ms, floor_ms))
    return Figure(name, value, "%", floor or None)


def _slept() -> list[float]:
    """How much after it was due a loop of the same pace awoke (ms), as long as a block takes."""
    late_ms: list[float] = []
    due_ns = time.monotonic_ns() + PERIOD_NS
    for _ in range(BLOCK_S * RATE_HZ):
        time.sleep(max(0, due_ns - time.monotonic_ns()) * 1e-9)
        late_ms.append(1e-6 * (time.monotonic_ns() - due_ns))
        due_ns += PERIOD_NS
    return late_ms


def _least_s(blocks: list[Block]) -> float:
    return min(block.computing_s for block in blocks)


def _block(path: Path | None, seed: int) -> Block:
    """A random motion by its seed: recorded where there is a path, else not."""
    cell = robot_alone()
    controller = Controller(cell.description, 1.0 / RATE_HZ)
    dialogue = Dialogue(lambda: controller.tick)
    if path is None:
        return Block(*_paced(controller, dialogue, seed, _nothing), size=0)
    recorder = Recorder(
        path, controller, dialogue, cell=cell, tick_rate_hz=RATE_HZ, clock=lambda: "real",
        said_of_it={"protocols": "iiwa"},
    )  # fmt: skip
    recorder.start()
    written_s = _computed_s(recorder.writing_process)
    computing_s, longest_s, late_ms = _paced(controller, dialogue, seed, recorder.tick)
    recorder.stop()
    if not recorder.finish() or recorder.lost:
        raise RuntimeError("the recording is not whole")
    computing_s += _computed_s(recorder.writing_process) - written_s
    return Block(computing_s, longest_s, late_ms, path.stat().st_size)


def _paced(
    controller: Controller, dialogue: Dialogue, seed: int, tick: Callable[[], None]
) -> tuple[float, float, list[float]]:
    """The seconds of computing in `tick` and in what the dialogue tells; the most of it in a tick; lateness
    of each tick (ms)."""
    chance = random.Random(SEED + seed)
    home = controller.joints
    late_ms: list[float] = []
    computing_s = longest_s = 0.0
    gc.collect()
    due_ns = time.monotonic_ns() + PERIOD_NS
    for number in range(BLOCK_S * RATE_HZ):
        if controller.queue < 2:  # planned while one waits, as by a driver that keeps ahead
            target = [q + chance.uniform(-0.4, 0.4) for q in home]
            controller.move(MoveRequest(How.PTP, target, speeds=[0.5] * len(home)))
            due_ns = max(due_ns, time.monotonic_ns() + PERIOD_NS)  # planning is not what is asked here
        time.sleep(max(0, due_ns - time.monotonic_ns()) * 1e-9)
        began_s = time.thread_time()
        if number % (RATE_HZ // LINES_HZ) == 0:
            dialogue.exchange("127.0.0.1:50000", "get joint position", f"{controller.joints}")
        between_s = time.thread_time()
        controller.step()
        stepped_s = time.thread_time()
        tick()
        in_tick_s = time.thread_time() - stepped_s + between_s - began_s
        computing_s += in_tick_s
        longest_s = max(longest_s, in_tick_s)
        late_ms.append(1e-6 * (time.monotonic_ns() - due_ns))
        due_ns += PERIOD_NS
    return computing_s, longest_s, late_ms


def _computed_s(process: int) -> float:
    """What a process has computed: its clock has the number that Linux gives it. The process that writes is
    started with the first recording, so the first block has that in it, too."""
    return time.clock_gettime(~process << 3 | 2)


def _nothing() -> None:
    """Do nothing: the robot is not recorded."""

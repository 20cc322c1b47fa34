"""What parts cost: the program that packs 24 boxes, over sockets, and jaws that go through 64 cubes."""

import gc
import runpy
from collections.abc import Callable
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import process_time, thread_time

from benchmarks.figures import Figure, Kind
from benchmarks.peers import one_processor
from iiwa_sim import Iiwa, Simulator
from iiwa_sim.cell.cell import load_cell
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.requests import Kind as How
from iiwa_sim.controller.requests import MoveRequest
from iiwa_sim.frames import Frame

DOWN = (3.14159265, 0.0, 3.14159265)
CLOSE = 1  # the number of the output
PROGRAM = Path(__file__).parent.parent / "examples" / "palletising.py"
TICK_S = 0.002
RUNS = 3
MISSED = 3.0  # met at rest
CUBES = "".join(
    f'[[part]]\nname = "{i} {k}"\nshape = "box"\nsize_mm = [20, 20, 20]\nmass_kg = 0.02\n'
    f"x_mm = {470 + 22 * i}\ny_mm = {-170 + 22 * k}\nz_mm = 310\n"
    for i in range(8)
    for k in range(8)
)


def measure() -> list[Figure]:
    """Measure; CPU time of the whole process, of server and client, for the program."""
    program = runpy.run_path(str(PROGRAM))
    plough_us = 1e6 * _ploughing(program["CELL"])
    return [
        Figure(
            "24 boxes packed, over sockets",
            median(_packing(program) for _ in range(RUNS)),
            "x real time",
            at_least=50,
            kind=Kind.CPU,
            margin=MISSED,
        ),
        Figure("64 cubes ploughed, a tick", plough_us, "us", at_most=600, kind=Kind.CPU, margin=MISSED),
    ]


def _packing(program: dict[str, object]) -> float:
    """Simulated seconds per second of computing. On one processor: robot and driver are threads that take
    turns at Python's lock, and on two they compute a fifth more for the same, in caches that are cold."""
    cell, palletise = program["CELL"], program["palletise"]
    assert callable(palletise)
    with (
        one_processor(),
        Simulator(cell=cell, clock="fast") as simulator,
        Iiwa(simulator.host, simulator.port) as robot,
    ):
        start, since_s = process_time(), simulator.state().time_s
        palletise(robot, wait=lambda _: None)
        return (simulator.state().time_s - since_s) / (process_time() - start)


def _ploughing(boxes: Path) -> float:
    """Seconds of computing of a tick."""
    text = boxes.read_text()
    with TemporaryDirectory() as folder:
        file = Path(folder) / "cell.toml"
        file.write_text(text[: text.index("[[part]]")] + CUBES)
        robot = load_cell(file).controller(TICK_S)
    robot.io.set_output(CLOSE, True)
    for kind, y_mm, z_mm in ((How.PTP, -250.0, 420.0), (How.LIN, -250.0, 312.0)):
        robot.move(MoveRequest(kind, Frame(550.0, y_mm, z_mm, *DOWN), 1.0))
        while robot.moving:
            robot.step()
    robot.move(MoveRequest(How.LIN, Frame(550.0, 0.0, 312.0, *DOWN), 1.0, tcp_speed_m_s=0.1))
    return _timed(robot.step, robot)


def _timed(step: Callable[[], None], robot: Controller) -> float:
    ticks, start = robot.tick, thread_time()
    gc.disable()
    try:
        while robot.moving:
            step()
    finally:
        gc.enable()
    return (thread_time() - start) / (robot.tick - ticks)

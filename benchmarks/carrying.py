"""The cost of parts: the program that packs 24 boxes, over sockets, and jaws that go through 64 cubes."""

import gc
import runpy
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import process_time, thread_time
from typing import Any

from benchmarks.figure import Figure
from benchmarks.servers import one_processor
from iiwa_sim import Iiwa, Simulator
from iiwa_sim.cell.cell import load_cells
from iiwa_sim.controller.requests import Kind, MoveRequest
from iiwa_sim.frames import Frame

DOWN = (3.14159265, 0.0, 3.14159265)
CLOSE = 1  # the number of the output
PROGRAM = Path(__file__).parent.parent / "examples" / "palletising.py"
RUNS = 3
MARGIN = 3.0
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
    packed = median(_packing(program) for _ in range(RUNS))
    return [
        Figure("24 boxes packed, over sockets", packed, "x real time", at_least=38, margin=MARGIN),
        Figure("64 cubes ploughed, a tick", plough_us, "us", at_most=600, margin=MARGIN),
    ]


def _packing(program: dict[str, Any]) -> float:
    """Simulated seconds per second of computing.

    On one processor: robot and driver are threads that take turns at Python's lock.
    """
    with (
        one_processor(),
        Simulator(cell=program["CELL"], clock="fast") as simulator,
        Iiwa(simulator.host, simulator.port) as robot,
    ):
        start, since_s = process_time(), simulator.state().time_s
        program["palletise"](robot, wait=lambda _: None)
        return (simulator.state().time_s - since_s) / (process_time() - start)


def _ploughing(boxes: Path) -> float:
    """Return seconds of computing of a tick."""
    text = boxes.read_text()
    with TemporaryDirectory() as folder:
        file = Path(folder) / "cell.toml"
        file.write_text(text[: text.index("[[part]]")] + CUBES)
        robot = load_cells(file)[0].controller(0.002)
    robot.io.set_output(CLOSE, True)
    for kind, y_mm, z_mm in ((Kind.PTP, -250.0, 420.0), (Kind.LIN, -250.0, 312.0)):
        robot.move(MoveRequest(kind, Frame(550.0, y_mm, z_mm, *DOWN), 1.0))
        while robot.moving:
            robot.step()
    robot.move(MoveRequest(Kind.LIN, Frame(550.0, 0.0, 312.0, *DOWN), 1.0, tcp_speed_m_s=0.1))
    ticks, start = robot.tick, thread_time()
    gc.disable()
    try:
        while robot.moving:
            robot.step()
    finally:
        gc.enable()
    return (thread_time() - start) / (robot.tick - ticks)

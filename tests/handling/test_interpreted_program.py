"""A whole program of picking, carrying, pushing and dropping: all kernels interpreted give the same bits."""

from __future__ import annotations

import sys
from hashlib import sha256
from pathlib import Path
from struct import pack

import pytest

from iiwa_sim.cell.cell import load_cell
from iiwa_sim.controller.requests import Kind as How
from iiwa_sim.controller.requests import MoveRequest
from iiwa_sim.frames import Frame
from tests.processes import succeeds

ROOT = Path(__file__).parents[2]
DOWN = (3.14159265359, 0.0, 3.14159265359)
TICK_S = 0.01
CLOSE = 1
INTERPRETED = f"""
from tests.interpreted import interpret_all
interpret_all()
from {__name__} import program
print(program())
"""


def program() -> str:
    """A checksum of joints, forces and parts over all ticks of the program."""
    robot = load_cell(ROOT / "examples" / "boxes.toml").controller(TICK_S)
    seen = sha256()

    def tick() -> None:
        robot.step()
        numbers = [*robot.joints, *robot.cartesian_force(), *robot.joint_torque()]
        for each in robot.handling.parts if robot.handling else ():
            numbers += each.frame
            seen.update(each.state.encode())
        seen.update(pack(f"{len(numbers)}d", *numbers))

    def go(kind: How, x_mm: float, y_mm: float, z_mm: float, speed: float = 0.5) -> None:
        robot.move(MoveRequest(kind, Frame(x_mm, y_mm, z_mm, *DOWN), speed))
        while robot.moving:
            tick()

    def jaws(close: bool) -> None:
        robot.io.set_output(CLOSE, close)
        for _ in range(round(1.0 / TICK_S)):
            tick()

    go(How.PTP, 400.0, -350.0, 395.0)
    go(How.LIN, 400.0, -350.0, 315.0)
    jaws(close=True)
    assert robot.handling is not None
    assert robot.handling.holds
    go(How.LIN, 400.0, -350.0, 345.0)
    go(How.LIN, 440.0, -350.0, 318.0, 0.1)  # into its neighbour
    jaws(close=False)
    return f"{robot.tick} {seen.hexdigest()}"


@pytest.mark.slow
def test_picked_pushed_and_dropped_it_is_the_same_to_the_last_bit() -> None:
    assert succeeds([sys.executable, "-c", INTERPRETED], cwd=ROOT).split() == program().split()

"""Cells in files, and a driver that talks to one in simulated time."""

from __future__ import annotations

from pathlib import Path

from iiwa_sim.cell.cell import Cell, load_cells
from tests.journal import Journal
from tests.protocols.fake_robot import Conversation
from tests.stepped import SteppedRobot

EXAMPLES = Path(__file__).parents[2] / "examples"
CELLS = sorted(file for file in EXAMPLES.glob("*.toml") if file.name not in ("fleet.toml", "every_key.toml"))
TICK_S = 0.001
GRIPPER = """
[gripper]
stroke_mm = 80
speed_mm_per_s = 100
grip_force_n = 40
close_output = 1

[[part]]
name = "block"
shape = "box"
size_mm = [40, 40, 60]
mass_kg = 0.5
x_mm = 600
z_mm = 60

[[box]]
name = "table"
size_mm = [800, 1000, 40]
x_mm = 600
z_mm = 10
stiffness_n_per_m = 100000
"""
"""A block that lies on a table."""


def cell_from(folder: Path, text: str) -> Cell:
    """Return the cell that a text describes."""
    file = folder / "cell.toml"
    file.write_text(text)
    return load_cells(file)[0]


class SteppedDriver(Conversation):
    """A driver of the robot in a cell, which also advances the time."""

    def __init__(self, cell: Cell, tick_s: float = TICK_S) -> None:
        self.controller = SteppedRobot(cell=cell, tick_s=tick_s).controller
        super().__init__(self.controller, Journal(fails=True))

    def moves(self, command: str) -> None:
        """A move that has to be accepted, to its end."""
        assert self.ask(command) == "done", self.ask("get error")
        while self.ask("get status") == "moving":
            self.controller.step()

    def force(self) -> list[float]:
        """Return the reply to `get cartesian force`: N and Nm along the axes of the TCP."""
        return [float(word) for word in self.ask("get cartesian force").split()]

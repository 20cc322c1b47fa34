"""Cells in files, and a driver that talks to one in simulated time."""

from __future__ import annotations

from pathlib import Path

from iiwa_sim.cell.cell import Cell, load_cell
from iiwa_sim.controller.controller import Controller
from iiwa_sim.dialect.iiwa.session import IiwaSession

EXAMPLES = Path(__file__).parents[2] / "examples"
CELLS = sorted(file for file in EXAMPLES.glob("*.toml") if file.name != "fleet.toml")
TICK_S = 0.001
DOWN = "3.14159265359 0 3.14159265359"
"""Orientation on the wire of a tool that points down."""

TOOL = """
[tool_in_flange]
x_mm = 0
y_mm = 0
z_mm = 150
alpha = 0
beta = 0
gamma = 0
"""
TABLE = """
[[box]]
name = "table"
size_mm = [800, 1000, 40]
x_mm = 600
z_mm = 280
stiffness_n_per_m = 20000
"""


def cell_from(folder: Path, text: str) -> Cell:
    """The cell that a text describes."""
    file = folder / "cell.toml"
    file.write_text(text)
    return load_cell(file)


class SteppedDriver:
    """One connection to the controller of a cell; time passes only when it says so."""

    def __init__(self, cell: Cell, tick_s: float = TICK_S) -> None:
        self.controller = Controller(
            cell.description,
            tick_s,
            start=cell.start,
            tool_in_flange=cell.tool_in_flange,
            world=cell.world(),
            noise=cell.noise(),
        )
        self._session = IiwaSession(self.controller, _Silent(), "a driver")

    def ask(self, command: str) -> str:
        """One command, one reply."""
        self._session.receive(command.encode() + b"\r\n")
        return self._session.answer().decode().removesuffix("\r\n")

    def moves(self, command: str) -> None:
        """A move that has to be accepted, to its end."""
        assert self.ask(command) == "done", self.ask("get error")
        while self.ask("get status") == "moving":
            self.controller.step()

    def force(self) -> list[float]:
        """Of `get cartesian force`: N and Nm along the axes of the TCP."""
        return [float(word) for word in self.ask("get cartesian force").split()]


class _Silent:
    """A `DialectLog` nobody reads."""

    commands = False

    def command(self, session: str, line: str, reply: str) -> None:
        pass

    def refused(self, session: str, line: str, code: int, reason: str) -> None:
        pass

    def stopped(self, session: str, vanished: bool) -> None:
        pass

    def exception(self, session: str, line: str, fault: Exception) -> None:
        raise AssertionError(f"{session}: {line}") from fault

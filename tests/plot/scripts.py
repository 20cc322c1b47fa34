"""Files of commands that the tests run, and cells."""

from __future__ import annotations

from pathlib import Path

from iiwa_sim.cell.cell import Cell, robot_alone
from iiwa_sim.plot.record import Recording, record
from iiwa_sim.plot.script import parse_script

EXAMPLES = Path(__file__).parents[2] / "examples"
EXAMPLE = EXAMPLES / "blending.txt"
TABLE = EXAMPLES / "table.toml"

LIN = "lin move : 450 100 520 0 -1.57079 0 0.5 20"
JOINTS = "0 0.5 0.2 -1 0 1.5 0"
JOINT = f"joint move : {JOINTS} 1 1 1 1 1 1 1"


def recorded(text: str, robot: str = "lbr_iiwa_7_r800", rate_hz: int = 500) -> Recording:
    return recorded_in(robot_alone(robot), text, rate_hz)


def recorded_in(cell: Cell, text: str, rate_hz: int = 500) -> Recording:
    return record(parse_script("moves.txt", text.encode()), cell, rate_hz)

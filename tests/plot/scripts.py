"""Files of commands that the tests run."""

from __future__ import annotations

from pathlib import Path

from iiwa_sim.plot.record import Recording, record
from iiwa_sim.plot.script import parse_script
from iiwa_sim.robot.description import load_robot

EXAMPLE = Path(__file__).parents[2] / "examples" / "blending.txt"

LIN = "lin move : 450 100 520 0 -1.57079 0 0.5 20"
JOINTS = "0 0.5 0.2 -1 0 1.5 0"
JOINT = f"joint move : {JOINTS} 1 1 1 1 1 1 1"


def recorded(text: str, robot: str = "lbr_iiwa_7_r800", rate_hz: int = 500) -> Recording:
    return record(parse_script("moves.txt", text.encode()), load_robot(robot), rate_hz)

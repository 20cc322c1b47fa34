"""Files of commands that the tests run, and cells."""

from __future__ import annotations

import tempfile
from pathlib import Path

from iiwa_sim.cell.cell import Cell, robot_alone
from iiwa_sim.plot.motion import Motion, run

EXAMPLES = Path(__file__).parents[2] / "examples"
EXAMPLE = EXAMPLES / "blending.txt"
TABLE = EXAMPLES / "table.toml"

LIN = "lin move : 450 100 520 0 -1.57079 0 0.5 20"
JOINTS = "0 0.5 0.2 -1 0 1.5 0"
JOINT = f"joint move : {JOINTS} 1 1 1 1 1 1 1"
KRC4_MOVES = """protocol krc4
Cmd I1=10 R0=445 R1=20 R2=800 R3=170 R4=10 R5=170
<Cmd I1="100"/>
wait stopped
Cmd I1=25 R1=-90 R2=90 R4=90 # home
"""


def moved(text: str, robot: str = "lbr_iiwa_7_r800", rate_hz: int = 500, cell: Cell | None = None) -> Motion:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "moves.txt")
        path.write_text(text)
        return run(path, cell or robot_alone(robot), rate_hz)

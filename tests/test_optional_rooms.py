"""Optional packages and libraries are loaded on demand; a missing one is reported in one line."""

from __future__ import annotations

import sys

from tests.processes import ended

LOADED = """
import sys
import iiwa_sim.cli.serve
from iiwa_sim.cli import main
from iiwa_sim.simulator import Simulator
with Simulator(clock="stepped") as simulator:
    simulator.advance(0.02)
optional = ("iiwa_sim.ros", "iiwa_sim.recordings", "mcap", "mujoco", "matplotlib", "viser")
print(*(name for name in sys.modules if name.startswith(optional)), flush=True)
sys.modules["mcap"] = None
sys.exit(main(["plot", "a.mcap", "-o", "a.png"]))
"""


def test_rooms_and_libraries_are_loaded_only_for_a_robot_that_has_them() -> None:
    done = ended([sys.executable, "-c", LOADED])
    assert done.stdout == "\n"
    assert done.returncode == 2
    assert done.stderr == f"iiwa-sim: this needs mcap: {sys.executable} -m pip install 'iiwa-sim[record]'\n"

"""What is optional costs nothing where nobody asks for it: it is not even loaded."""

from __future__ import annotations

import subprocess
import sys

LOADED = """
import sys
import iiwa_sim.cli.serve
from iiwa_sim.simulator import Simulator
Simulator()
print(*(name for name in sys.modules if name.startswith(("iiwa_sim.ros", "iiwa_sim.recordings", "mcap"))))
"""


def test_rooms_of_ros_and_recordings_are_loaded_only_for_a_robot_that_has_them() -> None:
    told = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, check=True)
    assert set(told.stdout.split()) == {"iiwa_sim.recordings", "iiwa_sim.recordings.recordings"}

"""What is optional costs nothing where nobody asks for it: it is not even loaded."""

from __future__ import annotations

import subprocess
import sys
from functools import cache

LOADED = """
import sys
import iiwa_sim.cli.serve
from iiwa_sim.simulator import Simulator
Simulator(**{options})
print(*(name for name in sys.modules if name.startswith(("iiwa_sim.ros", "iiwa_sim.recordings", "mcap"))))
"""


@cache
def rooms_loaded(**options: object) -> set[str]:
    text = LOADED.format(options=options)
    told = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    return set(told.stdout.split())


def test_the_ros_room_is_loaded_only_for_a_robot_on_ros() -> None:
    loaded = {name for name in rooms_loaded() if name.startswith("iiwa_sim.ros")}
    assert loaded == set()
    assert "iiwa_sim.ros.rosbridge_server" in rooms_loaded(rosbridge_port=0)


def test_the_room_of_recordings_and_its_library_are_loaded_only_for_a_robot_that_is_recorded() -> None:
    loaded = {name for name in rooms_loaded() if not name.startswith("iiwa_sim.ros")}
    # Which recordings there are, and where a missing mcap is told.
    assert loaded == {f"iiwa_sim.recordings{module}" for module in ("", ".recordings", ".fault")}

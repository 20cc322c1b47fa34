"""Examples 01 to 14 of the tutorial, run like a reader runs them, each short enough to be read."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import pytest

from iiwa_sim import Simulator
from tests.peers import program
from tests.processes import succeeds

EXAMPLES = Path(__file__).parent.parent / "examples"
OUTPUT = {
    "02_client.py": ["there  y = 100.0 mm", "turned A7 = 0.67 rad"],
    "04_blending.py": ["with a stop in each corner "],
    "05_errors.py": [
        "refused: 3021 the TCP at 2000.0 0.0 520.0 mm",
        "stopped: 3030 emergency stop",
        "y = 200.0 mm",
    ],
    "06_table.py": ["the table is at 300.0"],
    "07_lost_reply.py": ["no reply in time: connecting anew", "joints 0.0 0.52"],
    "08_pick.py": ["table at 299.", "gripped: True", "put down at 324."],
    "09_two_robots.py": ["handed over: held at 630 0 460"],
    "10_recorded_failure.py": [
        "farther than the arm reaches by ",
        "lbr_iiwa_7_r800: 0 answered otherwise",
        "lbr_iiwa_14_r820: 2 answered otherwise",
    ],
    "11_peg.py": ["sinks in at 60", " places", "at the bottom: 209."],
    "12_hand_over.py": ["5 N: gave way 5.0 mm, holds on: True", "20 N: gave way 20.0 mm, holds on: False"],
    "14_door.py": ["back at 620 mm", "the sphere round the TCP touches body 'door'"],
}
"""Lines of the output of each example."""


@pytest.mark.parametrize("name", OUTPUT)
def test_a_program(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(EXAMPLES / name), run_name="__main__")
    output = capsys.readouterr().out
    for words in OUTPUT[name]:
        assert words in output


def test_the_protocol_by_hand() -> None:
    with Simulator(clock="fast") as simulator:
        done = succeeds([program("bash"), EXAMPLES / "01_telnet.sh", "127.0.0.1", str(simulator.port)])
    lines = done.splitlines()
    assert lines[:2] == ["> hello", "< hello"]
    assert lines[-4:] == ["> get tool frame", "< 450.0 100.0 520.0 0.0 -1.57079 0.0", "> bye", "< bye"]


@pytest.mark.slow
def test_the_tests_of_a_driver() -> None:
    alone = ("-p", "no:cacheprovider", "-c", "/dev/null")
    command = [sys.executable, "-m", "pytest", "-q", *alone, "03_test_a_driver.py"]
    assert "3 passed" in succeeds(command, cwd=EXAMPLES)

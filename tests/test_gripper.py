"""A gripper in a cell, as a driver works it."""

from __future__ import annotations

from pathlib import Path

from iiwa_sim import Iiwa, Simulator
from tests.states import on_the_status_port

CELL = """
[gripper]
stroke_mm = 80
speed_mm_per_s = 100
grip_force_n = 40
close_output = 3
open_input = 1
closed_input = 2
"""


def test_a_driver_closes_and_opens_the_gripper_and_the_backdoor_breaks_it(tmp_path: Path) -> None:
    (tmp_path / "cell.toml").write_text(CELL)
    with (
        Simulator(cell=tmp_path / "cell.toml", clock="stepped", status_port=0) as simulator,
        Iiwa("127.0.0.1", simulator.port) as robot,
    ):
        assert (robot.get_input(1), robot.get_input(2)) == (True, False)
        robot.set_output(3, True)
        simulator.advance(0.4)
        assert (robot.get_input(1), robot.get_input(2)) == (False, False)
        line = on_the_status_port(simulator)
        assert line["gripper"]["state"] == "between"
        assert 25.0 < line["gripper"]["opening_mm"] < 45.0
        simulator.advance(0.5)
        assert (robot.get_input(1), robot.get_input(2)) == (False, True)
        simulator.backdoor.save_state("closed")
        simulator.backdoor.restore_state("start")
        assert (robot.get_input(1), robot.get_output(3)) == (True, False)
        simulator.backdoor.restore_state("closed")
        assert (robot.get_input(2), robot.get_output(3)) == (True, True)
        simulator.backdoor.stick_jaws(stuck=True)
        simulator.backdoor.wrong_sensor("open", True)
        robot.set_output(3, False)
        simulator.advance(2.0)
        assert (robot.get_input(1), robot.get_input(2)) == (True, True)
        simulator.backdoor.clear_faults()
        assert (robot.get_input(1), robot.get_input(2)) == (False, True)
        simulator.advance(0.9)
        assert (robot.get_input(1), robot.get_input(2)) == (True, False)


def test_a_fast_clock_runs_through_its_stroke(tmp_path: Path) -> None:
    """It closes for 10 s of simulated time, which pass at once on a fast clock."""
    (tmp_path / "cell.toml").write_text(CELL.replace("= 100\n", "= 8\n"))
    with (
        Simulator(cell=tmp_path / "cell.toml", clock="fast") as simulator,
        Iiwa("127.0.0.1", simulator.port) as robot,
    ):
        robot.set_output(3, True)
        assert any(robot.get_input(2) for _ in range(100_000))
        assert simulator.state().time_s >= 10.0

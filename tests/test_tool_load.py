"""A tool in a cell, as a driver feels it."""

from __future__ import annotations

from pathlib import Path

import pytest

from iiwa_sim import Iiwa, Simulator
from tests.states import on_the_status_port

CELL = """
[tool]
mass_kg = 2
centre_mm = [0, 0, 80]
"""


def test_a_driver_sets_the_load_and_reads_the_remaining_wrench(tmp_path: Path) -> None:
    (tmp_path / "cell.toml").write_text(CELL)
    with (
        Simulator(cell=tmp_path / "cell.toml", clock="stepped", status_port=0) as simulator,
        Iiwa("127.0.0.1", simulator.port) as robot,
    ):
        assert robot.command("get tool load") == "2.0 0.0 0.0 80.0"
        assert robot.get_cartesian_force() == (0.0,) * 6
        robot.set_tool_load(1.5, (0.0, 0.0, 80.0))
        force = robot.get_cartesian_force()
        assert sum(each**2 for each in force[:3]) ** 0.5 == pytest.approx(0.5 * 9.81)
        assert robot.get_joint_torque() != (0.0,) * 7
        line = on_the_status_port(simulator)
        assert line["tool_load"] == [1.5, 0.0, 0.0, 80.0]
        assert line["cartesian_force"] == pytest.approx(force, abs=1e-3)
        simulator.backdoor.save_state("lighter")
        robot.set_tool_load(2.0, (0.0, 0.0, 80.0))
        assert robot.get_cartesian_force() == (0.0,) * 6
        simulator.backdoor.restore_state("lighter")
        assert robot.command("get tool load") == "1.5 0.0 0.0 80.0"
        assert robot.get_cartesian_force() == pytest.approx(force)

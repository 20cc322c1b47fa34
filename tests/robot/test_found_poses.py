"""What was found in a URDF before is what Pinocchio finds now, and counts for that URDF only."""

from __future__ import annotations

import shutil
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from iiwa_sim.robot.description import built_in_robots, load_robot
from iiwa_sim.robot.fixed_poses import read_fixed_poses
from iiwa_sim.robot.found_poses import POSES_FILE, poses_checksum
from iiwa_sim.robot.model import Model


def numbers(poses: object) -> np.ndarray:
    assert isinstance(poses, tuple)
    return np.array([[*pose.rotation, *pose.translation] for pose in poses])


@pytest.mark.parametrize("name", built_in_robots())
def test_they_are_those_of_pinocchio(name: str) -> None:
    """To rounding, which may be another on another processor; `python -m tools.fixed_poses` writes them."""
    robot = load_robot(name)
    assert robot.found_poses is not None
    poses = robot.found_poses.poses
    assert robot.found_poses.of == poses_checksum(robot.urdf, robot.joints, robot.flange, poses)
    assert numbers(robot.found_poses.poses) == pytest.approx(numbers(read_fixed_poses(robot)), abs=1e-12)
    assert Model(robot).fixed_poses == robot.found_poses.poses


@pytest.mark.parametrize("text", ["", "of = 1", "of = 1\nposes = [[]]", "of = 1\nposes = 7", "[", "\0", None])
def test_a_file_that_says_nothing_counts_as_none(tmp_path: Path, text: str | None) -> None:
    folder = tmp_path / "robot"
    shutil.copytree(str(files("iiwa_sim.robots") / "lbr_iiwa_7_r800"), folder)
    (folder / POSES_FILE).unlink()
    if text is not None:
        (folder / POSES_FILE).write_text(text)
    own, built_in = load_robot(folder), load_robot()
    assert own.found_poses is None or own.found_poses.of == 1
    assert numbers(Model(own).fixed_poses) == pytest.approx(numbers(Model(built_in).fixed_poses), abs=1e-12)


def test_a_robot_that_comes_along_does_without_pinocchio() -> None:
    text = "import sys, iiwa_sim.simulator as s; s.Simulator(); print('pinocchio' in sys.modules)"
    told = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert told.stdout == "False\n"

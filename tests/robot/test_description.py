"""Folders of robots: the built-in ones, and a user's own."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from iiwa_sim.frames import IDENTITY, Frame, Transform
from iiwa_sim.robot.description import RobotFault, built_in_robots, load_robot
from iiwa_sim.robot.model import Model
from tests.robot.arms import BUILT_IN, IIWAS, SIX_AXES, copy_of_robot, edit, use


def test_the_built_in_arms() -> None:
    assert set(built_in_robots()) == set(BUILT_IN)
    assert load_robot() == load_robot("lbr_iiwa_7_r800")


SEVEN_AXES = (170, 120, 170, 120, 170, 120, 175)
AT_HOME = (0, 30, 0, -60, 0, 90, 0)
ON_MEDIA_FLANGE = Frame(150.0, 0.0, 40.0, 0.0, 1.5708, 0.0).to_transform()


@pytest.mark.requirement("FRO001")
@pytest.mark.parametrize(
    ("robot", "lower_deg", "upper_deg", "deg_per_s", "home_deg", "tool"),
    [
        (
            IIWAS[0],
            np.negative(SEVEN_AXES),
            SEVEN_AXES,
            (98, 98, 100, 130, 140, 180, 180),
            AT_HOME,
            ON_MEDIA_FLANGE,
        ),
        (
            IIWAS[1],
            np.negative(SEVEN_AXES),
            SEVEN_AXES,
            (85, 85, 100, 75, 130, 135, 135),
            AT_HOME,
            ON_MEDIA_FLANGE,
        ),
        (
            SIX_AXES,
            (-170, -190, -120, -185, -120, -350),
            (170, 45, 156, 185, 120, 350),
            (360, 300, 360, 381, 388, 615),
            (0, -90, 90, 0, 90, 0),
            IDENTITY,
        ),
    ],
)
def test_published_limits_home_and_tool(
    robot: str,
    lower_deg: Sequence[float],
    upper_deg: Sequence[float],
    deg_per_s: Sequence[float],
    home_deg: Sequence[float],
    tool: Transform,
) -> None:
    d = load_robot(robot)
    assert np.degrees(d.position_min) == pytest.approx(lower_deg)
    assert np.degrees(d.position_max) == pytest.approx(upper_deg)
    assert np.degrees(d.velocity) == pytest.approx(deg_per_s)
    assert np.degrees(d.home) == pytest.approx(home_deg)
    assert d.tool_in_flange == tool


def test_published_torques_and_accelerations() -> None:
    seven, fourteen, six = (load_robot(name) for name in (*IIWAS, SIX_AXES))
    assert seven.torque == (176, 176, 110, 110, 110, 40, 40)
    assert fourteen.torque == (320, 320, 176, 176, 110, 40, 40)
    assert np.divide(seven.acceleration, seven.velocity) == pytest.approx([5.0] * 7)
    assert six.acceleration == pytest.approx((21.67, 6.89, 31.42, 133.06, 135.56, 268.38), abs=0.002)
    assert six.direct_acceleration == pytest.approx(2.0 * np.array(six.acceleration))


def test_a_users_own_folder(tmp_path: Path) -> None:
    folder = copy_of_robot(tmp_path / "mine")
    edit(folder / "robot.toml", 'flange = "flange_media_126"', 'flange = "flange_touch_152"')
    edit(folder / "robot.toml", 'name = "LBR iiwa 7 R800"', 'name = "mine"')
    mine = use(folder)
    assert (mine.name, mine.flange) == ("mine", "flange_touch_152")
    assert Model(mine).flange([0.0] * 7).translation == pytest.approx((0.0, 0.0, 1.292))


def test_six_joints_are_no_srs_arm(tmp_path: Path) -> None:
    folder = copy_of_robot(tmp_path / "six")
    text = (folder / "robot.toml").read_text().replace(', "A7"', "")
    (folder / "robot.toml").write_text(re.sub(r", -?\d+\](?= *(#|\n))", "]", text))
    edit(folder / "robot.urdf", 'name="A7" type="revolute"', 'name="A7" type="fixed"')
    six = load_robot(folder)
    assert Model(six).tcp_of_flange.jacobian(six.home).shape == (6, 6)
    with pytest.raises(RobotFault, match=r"robot.toml: joints = .*: expected 7 joints for kinematics 'srs'"):
        use(folder)

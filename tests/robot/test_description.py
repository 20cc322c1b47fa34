"""A robot's folder: what comes along, and a user's own."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from iiwa_sim.frames import IDENTITY, Frame
from iiwa_sim.robot.description import RobotFault, built_in_robots, load_robot
from iiwa_sim.robot.model import Model
from tests.robot.arms import BUILT_IN, IIWAS, SIX_AXES, Arm, copy_of_robot, edit, use


def test_the_arms_that_come_along() -> None:
    assert set(built_in_robots()) == set(BUILT_IN)
    assert load_robot() == load_robot("lbr_iiwa_7_r800")


@pytest.mark.requirement("FRO001")
@pytest.mark.parametrize(
    ("robot", "velocity_deg_per_s", "torque_nm"),
    [
        ("lbr_iiwa_7_r800", (98, 98, 100, 130, 140, 180, 180), (176, 176, 110, 110, 110, 40, 40)),
        ("lbr_iiwa_14_r820", (85, 85, 100, 75, 130, 135, 135), (320, 320, 176, 176, 110, 40, 40)),
    ],
)
def test_published_limits(
    robot: str, velocity_deg_per_s: tuple[float, ...], torque_nm: tuple[float, ...]
) -> None:
    d = load_robot(robot)
    position_deg = (170, 120, 170, 120, 170, 120, 175)
    assert np.degrees(d.position_max) == pytest.approx(position_deg)
    assert np.degrees(d.position_min) == pytest.approx(np.negative(position_deg))
    assert np.degrees(d.velocity) == pytest.approx(velocity_deg_per_s)
    assert d.torque == torque_nm
    assert np.divide(d.acceleration, d.velocity) == pytest.approx([5.0] * 7)


def test_published_limits_of_the_six_axis_arm() -> None:
    d = load_robot(SIX_AXES)
    assert np.degrees(d.position_min) == pytest.approx((-170, -190, -120, -185, -120, -350))
    assert np.degrees(d.position_max) == pytest.approx((170, 45, 156, 185, 120, 350))
    assert np.degrees(d.velocity) == pytest.approx((360, 300, 360, 381, 388, 615))
    assert d.acceleration == pytest.approx((21.67, 6.89, 31.42, 133.06, 135.56, 268.38), abs=0.002)


def test_limits_that_follow_from_others(arm: Arm) -> None:
    d = arm.description
    velocity, acceleration, jerk = map(np.array, (d.velocity, d.acceleration, d.jerk))
    stiffer, stiffer_jerk = map(np.array, (d.direct_acceleration, d.direct_jerk))
    assert jerk == pytest.approx(25.0 * acceleration)
    assert stiffer == pytest.approx(2.0 * acceleration)
    assert stiffer_jerk == pytest.approx(50.0 * stiffer)
    assert d.stop_acceleration == pytest.approx(acceleration + 15.0 * velocity)
    assert d.stop_jerk == pytest.approx(jerk + 45.0 * acceleration + 600.0 * velocity)


@pytest.mark.parametrize("robot", IIWAS)
def test_home_and_tool(robot: str) -> None:
    d = load_robot(robot)
    assert np.degrees(d.home) == pytest.approx((0, 30, 0, -60, 0, 90, 0))
    assert d.tool_in_flange == Frame(150.0, 0.0, 40.0, 0.0, 1.5708, 0.0).to_transform()


def test_home_and_tool_of_the_six_axis_arm() -> None:
    d = load_robot(SIX_AXES)
    assert np.degrees(d.home) == pytest.approx((0, -90, 90, 0, 90, 0))
    assert d.tool_in_flange == IDENTITY


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
    assert Model(six).jacobian(six.home).shape == (6, 6)
    with pytest.raises(RobotFault, match=r"robot.toml: joints = .*: expected 7 joints for kinematics 'srs'"):
        use(folder)

"""Files for MoveIt and ros2_control of the built-in robots: robots/NAME/moveit/."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
import yaml

from iiwa_sim.robot.description import load_robot
from iiwa_sim.ros.joint_interface import ACTION, COMMANDS, STATES
from tests.stepped import ALL_ROBOTS

ROBOTS = Path(__file__).parents[2] / "robots"


@pytest.mark.parametrize("name", ALL_ROBOTS)
def test_the_files_name_joints_links_limits_and_topics_of_the_robot(name: str) -> None:
    robot, folder = load_robot(name), ROBOTS / name / "moveit"
    urdf, srdf = ET.fromstring(robot.urdf), ET.parse(folder / "robot.srdf").getroot()
    links = {each.get("name") for each in urdf.findall("link")}
    assert srdf.get("name") == urdf.get("name")
    home = {str(each.get("name")): float(each.get("value", "")) for each in srdf.iter("joint")}
    assert home == pytest.approx(dict(zip(robot.joints, robot.home, strict=True)))
    named = [value for each in srdf.iter() for key, value in each.items() if "link" in key]
    assert robot.flange in named
    assert set(named) <= links

    text = (folder / "joint_limits.yaml").read_text()
    assert all("." in number for number in re.findall(r": (\d\S*)$", text, re.MULTILINE)), "MoveIt's doubles"
    limits = yaml.safe_load(text)["joint_limits"]
    assert tuple(limits) == robot.joints
    for given, velocity, acceleration in zip(
        limits.values(), robot.velocity, robot.direct_acceleration, strict=True
    ):
        assert 0.5 * velocity <= given["max_velocity"] <= velocity
        assert given["max_acceleration"] == pytest.approx(acceleration)

    manager = yaml.safe_load((folder / "moveit_controllers.yaml").read_text())[
        "moveit_simple_controller_manager"
    ]
    (controller,) = manager["controller_names"]
    assert f"/{controller}/{manager[controller]['action_ns']}" == ACTION
    assert tuple(manager[controller]["joints"]) == robot.joints
    assert "arm" in yaml.safe_load((folder / "kinematics.yaml").read_text())

    control = ET.parse(folder / "ros2_control.xml").getroot()
    topics = [each.text for each in control.iter("param")]
    assert topics == [f"/robot{COMMANDS}", f"/robot{STATES}"]
    assert tuple(str(each.get("name")) for each in control.findall("joint")) == robot.joints
    given = yaml.safe_load((folder / "ros2_controllers.yaml").read_text())
    assert tuple(given["joint_trajectory_controller"]["ros__parameters"]["joints"]) == robot.joints

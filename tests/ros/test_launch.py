"""The launch files for ROS 2, as far as they can be run without a distribution: with stand-ins for `launch`
and `launch_ros`, they find the files of a robot, and say what they would start."""

from __future__ import annotations

import runpy
import sys
import types
from pathlib import Path
from typing import Any

import pytest

from iiwa_sim.robot.description import load_robot
from tests.processes import robots

ROOT = Path(__file__).parents[2]
LAUNCH = ROOT / "examples" / "ros2"
ROBOT = ROOT / "robots" / "lbr_iiwa_7_r800"


class Said:
    """What an action of launch is told, as it is told."""

    def __init__(self, *told: Any, **named: Any) -> None:
        self.told, self.named = told, named

    def perform(self, context: dict[str, str]) -> str:
        """Of a LaunchConfiguration."""
        return context[self.told[0]]


@pytest.fixture(autouse=True)
def stand_ins(monkeypatch: pytest.MonkeyPatch) -> None:
    names = {
        "launch": ("LaunchDescription",),
        "launch.actions": ("DeclareLaunchArgument", "ExecuteProcess", "OpaqueFunction", "Shutdown"),
        "launch.substitutions": ("LaunchConfiguration",),
        "launch_ros": (),
        "launch_ros.actions": ("Node",),
    }
    for module, classes in names.items():
        made = types.ModuleType(module)
        for name in classes:
            setattr(made, name, type(name, (Said,), {}))
        monkeypatch.setitem(sys.modules, module, made)


def started_by(name: str) -> list[Said]:
    """Every process that the launch file starts."""
    (actions,) = runpy.run_path(str(LAUNCH / name))["generate_launch_description"]().told
    found = []
    for action in actions:
        is_function = type(action).__name__ == "OpaqueFunction"
        found += action.named["function"]({"robot": str(ROBOT)}) if is_function else [action]
    return [each for each in found if type(each).__name__ in ("ExecuteProcess", "Node")]


@pytest.mark.parametrize("name", sorted(path.name for path in LAUNCH.glob("*.launch.py")))
def test_each_starts_a_robot_with_options_that_it_has(name: str) -> None:
    (robot,) = [each for each in started_by(name) if type(each).__name__ == "ExecuteProcess"]
    program, *given = robot.named["cmd"]
    assert program == "iiwa-sim"
    words = [each if isinstance(each, str) else "cell" for each in given]
    assert robots(*words)[""].ros2


def test_moveit_is_told_the_robot_and_where_its_action_is() -> None:
    nodes = {each.named.get("executable"): each.named for each in started_by("moveit.launch.py")}
    told: dict[str, Any] = {}
    for each in nodes["move_group"]["parameters"]:
        told |= each
    assert told["robot_description"] == load_robot().urdf
    assert "<group_state" in told["robot_description_semantic"]
    assert told["moveit_simple_controller_manager"]["controller_names"] == ["joint_trajectory_controller"]
    assert set(told["robot_description_planning"]["joint_limits"]) == set(load_robot().joints)

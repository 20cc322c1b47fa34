"""The launch files for ROS 2 with stand-ins for `launch` and `launch_ros`: files, and processes to start."""

from __future__ import annotations

import re
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


class LaunchAction:
    """An action of launch, which keeps its arguments."""

    def __init__(self, *args: Any, **named: Any) -> None:
        self.args, self.named = args, named

    def perform(self, context: dict[str, str]) -> str:
        """Return the value of a LaunchConfiguration."""
        return context[self.args[0]]


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
            setattr(made, name, type(name, (LaunchAction,), {}))
        monkeypatch.setitem(sys.modules, module, made)


LINES = re.findall(r"^ros2 launch (\S+)(.*)$", (ROOT / "docs" / "howto.md").read_text(), re.MULTILINE)
"""Files and arguments of the commands in the documentation."""


def started_by(file: str, arguments: str) -> list[LaunchAction]:
    """Return every process that a command starts; the file has to declare the arguments, which are paths."""
    actions = runpy.run_path(str(ROOT / file))["generate_launch_description"]().args[0]
    given = dict(each.split(":=") for each in arguments.split())
    declared = [each for each in actions if type(each).__name__ == "DeclareLaunchArgument"]
    assert set(given) <= {each.args[0] for each in declared}
    assert set(given) >= {each.args[0] for each in declared if "default_value" not in each.named}
    context = {name: str(ROOT / value) for name, value in given.items()}
    found = []
    for action in actions:
        is_function = type(action).__name__ == "OpaqueFunction"
        found += action.named["function"](context) if is_function else [action]
    return [each for each in found if type(each).__name__ in ("ExecuteProcess", "Node")]


def test_the_documentation_has_a_command_for_each_file() -> None:
    assert {ROOT / file for file, _ in LINES} == set(LAUNCH.glob("*.launch.py"))


@pytest.mark.parametrize(("file", "arguments"), LINES)
def test_each_command_starts_a_robot_with_options_that_it_has(file: str, arguments: str) -> None:
    (robot,) = [each for each in started_by(file, arguments) if type(each).__name__ == "ExecuteProcess"]
    program, *given = robot.named["cmd"]
    assert program == "iiwa-sim"
    words = [each if isinstance(each, str) else "cell" for each in given]
    assert robots(*words)[""].ros2


def test_moveit_gets_the_robot_and_the_name_of_its_action() -> None:
    (line,) = [each for each in LINES if "moveit" in each[0]]
    nodes = {each.named.get("executable"): each.named for each in started_by(*line)}
    given: dict[str, Any] = {}
    for each in nodes["move_group"]["parameters"]:
        given |= each
    assert given["robot_description"] == load_robot().urdf
    assert "<group_state" in given["robot_description_semantic"]
    assert given["moveit_simple_controller_manager"]["controller_names"] == ["joint_trajectory_controller"]
    assert set(given["robot_description_planning"]["joint_limits"]) == set(load_robot().joints)

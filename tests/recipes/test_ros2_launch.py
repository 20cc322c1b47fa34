"""The launch files for ROS 2, as far as they can be run without a distribution: with stand-ins for `launch`
and `launch_ros`, they find the files that `iiwa-sim moveit-config` writes, and say what they would start."""

from __future__ import annotations

import runpy
import sys
import types
from pathlib import Path
from typing import Any

import pytest

from iiwa_sim.cli.server_options import server_parser
from iiwa_sim.moveit.files import files
from iiwa_sim.robot.description import load_robot

LAUNCH = Path(__file__).parent.parent.parent / "examples" / "ros2"


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


def started_by(name: str, config: Path) -> list[Said]:
    """Every process that the launch file starts."""
    (actions,) = runpy.run_path(str(LAUNCH / name))["generate_launch_description"]().told
    found = []
    for action in actions:
        is_function = type(action).__name__ == "OpaqueFunction"
        found += action.named["function"]({"config": str(config)}) if is_function else [action]
    return [each for each in found if type(each).__name__ in ("ExecuteProcess", "Node")]


@pytest.fixture
def config(tmp_path: Path) -> Path:
    for name, text in files(load_robot(), []).items():
        (tmp_path / name).write_text(text)
    return tmp_path


@pytest.mark.parametrize("name", sorted(path.name for path in LAUNCH.glob("*.launch.py")))
def test_each_starts_a_robot_with_options_that_it_has(name: str, config: Path) -> None:
    (robot,) = [each for each in started_by(name, config) if type(each).__name__ == "ExecuteProcess"]
    program, *given = robot.named["cmd"]
    assert program == "iiwa-sim"
    words = [each if isinstance(each, str) else "cell" for each in given]
    parser = server_parser()
    assert parser.parse_args(words).ros2 is True


def test_moveit_is_told_the_robot_and_where_its_action_is(config: Path) -> None:
    nodes = {each.named.get("executable"): each.named for each in started_by("moveit.launch.py", config)}
    told: dict[str, Any] = {}
    for each in nodes["move_group"]["parameters"]:
        told |= each
    assert told["robot_description"] == load_robot().urdf
    assert "<group_state" in told["robot_description_semantic"]
    assert told["moveit_simple_controller_manager"]["controller_names"] == ["joint_trajectory_controller"]
    assert set(told["robot_description_planning"]["joint_limits"]) == set(load_robot().joints)


def test_ros2_control_is_told_its_controllers(config: Path) -> None:
    nodes = {
        each.named.get("executable"): each.named for each in started_by("ros2_control.launch.py", config)
    }
    (settings,) = nodes["ros2_control_node"]["parameters"]
    assert Path(settings).read_text() == files(load_robot(), [])["ros2_controllers.yaml"]
    assert nodes["spawner"]["arguments"] == ["joint_state_broadcaster", "joint_trajectory_controller"]

"""The files for MoveIt and ros2_control, as what reads them would."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

import pinocchio as pin
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.cli import main
from iiwa_sim.controller.trajectory_request import TrajectoryPoint
from iiwa_sim.moveit.files import files
from iiwa_sim.moveit.pairs import ADJACENT, NEVER, Pair
from iiwa_sim.robot.description import RobotDescription, load_robot
from iiwa_sim.ros.arm.joint_level import ACTION, COMMANDS, STATES
from tests.controller.test_trajectories import Following
from tests.stepped import ARMS

PAIRS = [Pair("iiwa_link_0", "iiwa_link_1", ADJACENT), Pair("iiwa_link_0", "iiwa_link_2", NEVER)]


@pytest.fixture(params=ARMS)
def robot(request: pytest.FixtureRequest) -> RobotDescription:
    return load_robot(request.param)


def test_moveit_reads_a_group_with_all_joints_its_home_and_the_pairs(robot: RobotDescription) -> None:
    texts = files(robot, PAIRS)
    urdf, srdf = ET.fromstring(texts["robot.urdf"]), ET.fromstring(texts["robot.srdf"])
    assert srdf.get("name") == urdf.get("name")
    chain = srdf.find("group/chain")
    assert chain is not None
    parents = {_link(joint, "child"): joint for joint in urdf.findall("joint")}
    link, joints = chain.get("tip_link"), []
    while link != chain.get("base_link"):
        joint = parents[str(link)]
        joints += [joint.get("name")] if joint.get("type") != "fixed" else []
        link = _link(joint, "parent")
    assert tuple(reversed(joints)) == robot.joints
    home = {each.get("name"): float(each.get("value", "")) for each in srdf.findall("group_state/joint")}
    assert home == pytest.approx(dict(zip(robot.joints, robot.home, strict=True)))
    told = [Pair(*(each.get(name, "") for name in ("link1", "link2", "reason"))) for each in _pairs(srdf)]
    assert told == PAIRS


def test_pinocchio_takes_the_pairs_out(tmp_path: Path) -> None:
    robot = load_robot()
    path = tmp_path / "robot.srdf"
    path.write_text(files(robot, PAIRS)["robot.srdf"])
    model = pin.buildModelFromXML(robot.urdf)
    shapes = pin.buildGeomFromUrdfString(model, robot.urdf, pin.GeometryType.COLLISION)
    shapes.addAllCollisionPairs()
    before = len(shapes.collisionPairs)
    pin.removeCollisionPairs(model, shapes, str(path))
    assert len(shapes.collisionPairs) < before


def test_limits_are_told_for_all_joints(robot: RobotDescription) -> None:
    limits = yaml.safe_load(files(robot, [])["joint_limits.yaml"])["joint_limits"]
    assert tuple(limits) == robot.joints
    for name, kind in (("velocity", robot.velocity), ("acceleration", robot.direct_acceleration)):
        for told, greatest in zip(limits.values(), kind, strict=True):
            assert 0.5 * greatest <= told[f"max_{name}"] <= greatest * (1.0 + 1e-8)
            assert told[f"has_{name}_limits"] is True


@pytest.mark.parametrize("name", ARMS)
@given(length=st.floats(0.01, 0.45), data=st.data(), share=st.sampled_from([1.0, 0.5, 0.1]))
def test_what_moveits_timing_makes_within_these_limits_is_followed(
    name: str, length: float, data: st.DataObject, share: float
) -> None:
    follower = Following(name)
    robot = follower.robot.description
    told = yaml.safe_load(files(robot, [])["joint_limits.yaml"])["joint_limits"].values()
    way = [data.draw(st.floats(-length, length)) for _ in robot.joints]
    speed = min(each["max_velocity"] / max(abs(part), 1e-9) for each, part in zip(told, way, strict=True))
    change = share * min(
        each["max_acceleration"] / max(abs(part), 1e-9) for each, part in zip(told, way, strict=True)
    )
    points = [
        TrajectoryPoint(
            time_s,
            [at + place * part for at, part in zip(robot.home, way, strict=True)],
            [velocity * part for part in way],
            [acceleration * part for part in way],
        )
        for time_s, place, velocity, acceleration in trapezoid(speed, change)
    ]
    follower.sends(points)  # raises where it is rejected; limits of positions are 0.52 rad away


def trapezoid(speed: float, change: float, apart_s: float = 0.1) -> Iterator[tuple[float, ...]]:
    """From 0 to 1 in the least time at a greatest speed and change of it: time (s), place and derivatives."""
    speed = min(speed, math.sqrt(change))
    rises_s = speed / change
    over_s = rises_s + 1.0 / speed
    for number in range(math.ceil(over_s / apart_s - 0.01)):
        time_s = number * apart_s
        left_s = over_s - time_s
        if time_s < rises_s:
            yield time_s, 0.5 * change * time_s**2, change * time_s, change
        elif left_s > rises_s:
            yield time_s, speed * (time_s - 0.5 * rises_s), speed, 0.0
        else:
            yield time_s, 1.0 - 0.5 * change * left_s**2, change * left_s, -change
    yield over_s, 1.0, 0.0, -change


def test_moveit_finds_the_action(robot: RobotDescription) -> None:
    told = yaml.safe_load(files(robot, [])["moveit_controllers.yaml"])["moveit_simple_controller_manager"]
    (name,) = told["controller_names"]
    assert f"/{name}/{told[name]['action_ns']}" == ACTION
    assert told[name]["type"] == "FollowJointTrajectory"
    assert tuple(told[name]["joints"]) == robot.joints


def test_ros2_control_finds_the_topics_of_a_robot_under_its_namespace(robot: RobotDescription) -> None:
    texts = files(robot, [])
    system = ET.fromstring(texts["ros2_control.urdf"]).find("ros2_control")
    assert system is not None
    parameters = {each.get("name"): each.text for each in system.findall("hardware/param")}
    assert parameters == {
        "joint_commands_topic": f"/robot{COMMANDS}",
        "joint_states_topic": f"/robot{STATES}",
    }
    assert tuple(str(each.get("name")) for each in system.findall("joint")) == robot.joints
    told = yaml.safe_load(texts["ros2_controllers.yaml"])
    assert tuple(told["joint_trajectory_controller"]["ros__parameters"]["joints"]) == robot.joints


def test_the_command_writes_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "new" / "config"
    assert main(["moveit-config", str(folder), "--robot", ARMS[1]]) == 0
    named = capsys.readouterr().out.splitlines()
    assert named == [str(folder / name) for name in files(load_robot(ARMS[1]), [])]
    assert 'reason="Adjacent"' in (folder / "robot.srdf").read_text()


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").touch()
    assert main(["moveit-config", str(tmp_path / "file")]) == 2
    assert capsys.readouterr().err.endswith("file cannot be written: File exists\n")


def _link(joint: ET.Element, end: str) -> str:
    found = joint.find(end)
    assert found is not None
    return str(found.get("link"))


def _pairs(srdf: ET.Element) -> list[ET.Element]:
    return srdf.findall("disable_collisions")

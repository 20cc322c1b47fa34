"""Robots on the graph of ROS 2, and users who send what is good, what is bad, and too much of it."""

from __future__ import annotations

import asyncio
from math import cos, nan, sin
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from iiwa_sim.client import Iiwa
from iiwa_sim.ros.arm.joint_level import COMMANDS, TRAJECTORY
from iiwa_sim.simulator import Simulator
from tests.ros.ros2.users import AWAY, HERE, NAMES, User, duration, trajectory, user
from tests.samples import some
from tests.talking import until

JOINT_STATE, POINTS = "sensor_msgs/msg/JointState", "trajectory_msgs/msg/JointTrajectory"
MOST_STATES = 2_000
ALWAYS_BEHIND_S = 0.1
"""The longest delay behind a curve, told in docs/ros2.md."""


@pytest.mark.slow
def test_two_robots_in_one_graph_are_told_apart(whole_python: Path) -> None:
    options: dict[str, Any] = {"ros2": True, "ros2_python": whole_python}
    with (
        Simulator(ros_namespace="left", **options) as left,
        Simulator(ros_namespace="right", **options) as right,
        user(whole_python, "left") as one,
        user(whole_python, "right") as other,
    ):
        assert one.sends("there", [(1.0, AWAY)])
        assert one.asks("result", name="there")["status"] == 4
        assert other.calls("set_output_1", "std_srvs/srv/SetBool", data=True)["success"]
        for someone, place in ((one, AWAY), (other, HERE)):
            assert someone.hears("joint_states", JOINT_STATE, 1)[-1]["position"] == pytest.approx(
                place, abs=1e-6
            )
        assert left.joints == pytest.approx(AWAY, abs=1e-6)
        assert right.joints == pytest.approx(HERE, abs=1e-6)
        assert (left.controller.io.outputs[0], right.controller.io.outputs[0]) == (False, True)


async def test_a_robot_at_rest_whose_node_nobody_hears_does_not_tick(
    whole_python: Path, cell: tuple[Simulator, User]
) -> None:
    ros = cell[0]._ros
    assert ros is not None
    await until(lambda: not ros.watching)
    with user(whole_python) as someone:
        await asyncio.to_thread(someone.asks, "hear", topic="joint_states", kind=JOINT_STATE)
        await until(lambda: ros.watching)
    await until(lambda: not ros.watching)


def test_transforms_and_the_description_are_told(cell: tuple[Simulator, User]) -> None:
    _, someone = cell
    kind = "tf2_msgs/msg/TFMessage"
    moving = someone.hears("tf", kind, 1)[-1]["transforms"]
    assert [each["child_frame_id"] for each in moving][-1] == "tool"
    assert len(moving) == len(NAMES) + 1
    (fixed,) = someone.hears("tf_static", kind, 1, latched=True)
    assert fixed["transforms"]
    (description,) = someone.hears("robot_description", "std_msgs/msg/String", 1, latched=True)
    assert description["data"].startswith("<?xml") or "<robot" in description["data"]


@st.composite
def curves(draw: st.DrawFn) -> list[dict[str, Any]]:
    """2 to 200 points of waves that begin and end at rest where the robot is, with or without velocities."""
    count = draw(st.integers(2, 200))
    step_s = draw(st.floats(0.02, 0.1))
    sizes = draw(st.lists(st.floats(-0.08, 0.08), min_size=7, max_size=7))
    cubic = draw(st.booleans())
    turns = 2.0 * 3.141592653589793 / max(count * step_s, 1.0)
    points = []
    for number in range(1, count + 1):
        time_s = number * max(count * step_s, 1.0) / count
        wave, speed = 1.0 - cos(turns * time_s), turns * sin(turns * time_s)
        point: dict[str, Any] = {
            "positions": [here + size * wave for here, size in zip(HERE, sizes, strict=True)],
            "time_from_start": duration(time_s),
        }
        if cubic:
            point["velocities"] = [size * speed if number < count else 0.0 for size in sizes]
        points.append(point)
    return points


@settings(max_examples=some(20), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(points=curves())
def test_trajectories_of_2_to_200_points_are_followed(
    cell: tuple[Simulator, User], points: list[dict[str, Any]]
) -> None:
    robot, someone = cell
    assert someone.follows("curve", {"trajectory": {"joint_names": NAMES, "points": points}})
    end = someone.asks("result", name="curve")
    assert (end["status"], end["result"]["error_string"]) == (4, "")
    assert robot.joints == pytest.approx(points[-1]["positions"], abs=1e-6)
    velocity = robot.controller.description.velocity
    for told in end["feedback"]:
        off = [abs(each) for each in told["error"]["positions"]]
        fast = [abs(each) for each in told["actual"]["velocities"]]
        # The waves are no faster than 0.6 rad/s.
        assert max(off) <= 0.6 * ALWAYS_BEHIND_S
        assert all(each <= limit * 1.001 for each, limit in zip(fast, velocity, strict=True))


def test_what_is_bad_comes_to_nothing_however_much_of_it_there_is(
    cell: tuple[Simulator, User], caplog: pytest.LogCaptureFixture
) -> None:
    robot, someone = cell
    before = robot.joints
    bad_points = [
        trajectory([(1.0, [nan] * 7)]),
        trajectory([(1.0, [0.0] * 3)]),
        trajectory([(1.0, HERE)], joint_names=["A1", "A2", "A3", "A4", "A5", "A6", "elbow"]),
        trajectory([(2.0, HERE), (1.0, HERE)]),
        trajectory([]),
    ]
    flood = {
        (TRAJECTORY, POINTS): bad_points * some(200),
        (COMMANDS, JOINT_STATE): [{"name": NAMES, "position": [nan] * 7}] * some(250),
    }
    with Iiwa("127.0.0.1", robot.port) as telnet:
        for (topic, kind), messages in flood.items():
            asked = {"topic": topic.strip("/"), "kind": kind, "messages": messages}
            someone.asks("publish", **asked, acknowledged=False)
            assert telnet.get_status() == "stopped"
            assert telnet.get_joint_position() == pytest.approx(before, abs=1e-6)
        long = trajectory([(0.001 * k, HERE) for k in range(1, 10_001)])
        topic = TRAJECTORY.strip("/")
        someone.asks("publish", topic=topic, kind=POINTS, messages=[long])
        assert telnet.get_status() == "stopped"
    assert someone.sends("then", [(0.1, before)]), "it is taken behind all of that"
    assert someone.asks("result", name="then")["status"] == 4
    assert robot.joints == pytest.approx(before, abs=1e-6)
    assert "not finite" in caplog.text

"""Robots on the graph of ROS 2, and users who send what is good, what is bad, and too much of it."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pytest

from iiwa_sim.simulator import Simulator
from tests.ros.ros2.users import AWAY, HERE, NAMES, User, user
from tests.talking import until

JOINT_STATE, POINTS = "sensor_msgs/msg/JointState", "trajectory_msgs/msg/JointTrajectory"
MOST_STATES = 2_000
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


@pytest.mark.slow
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

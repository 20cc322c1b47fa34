"""The robot as a node of ROS 2, with rclpy in processes and an environment of their own."""

from __future__ import annotations

import asyncio
import signal
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from iiwa_sim.ros.ros2.environment import default_folder, found_python, python_in
from iiwa_sim.simulator import Simulator
from tests.processes import refused, running, succeeds
from tests.ros.ros2.users import CELL
from tests.talking import Client, until

EXAMPLE = Path(__file__).parents[3] / "examples" / "ros2_rclpy.py"
ROS2 = ("--port", "0", "--ros2")
NODE = f"ROS 2 node /{CELL}/iiwa_sim\n"
LISTENER = """
import sys
import time

import rclpy
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState

PATIENCE_S = 50.0
COUNT = 50

rclpy.init()
node = rclpy.create_node("listener", namespace=sys.argv[1])
clocks, states = [], []
best_effort = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
node.create_subscription(Clock, "/clock", clocks.append, best_effort)
node.create_subscription(JointState, "joint_states", states.append, best_effort)
end_s = time.monotonic() + PATIENCE_S
while not (clocks and len(states) >= COUNT):
    if time.monotonic() > end_s:
        sys.exit(f"{len(clocks)} of /clock, {len(states)} joint states")
    rclpy.spin_once(node, timeout_sec=0.1)
print("clock", clocks[-1].clock.sec * 10**9 + clocks[-1].clock.nanosec)
print(*(state.header.stamp.sec * 10**9 + state.header.stamp.nanosec for state in states), flush=True)
node.destroy_node()
rclpy.shutdown()
"""
"""Of a user: prints the time of /clock, then the stamps of 50 joint states, in ns."""
"""A robot's node with an executor that fails."""


@pytest.mark.slow
def test_a_users_node_sees_the_robot_and_sends_a_trajectory(python: Path) -> None:
    with running("--ros2", "--ros2-python", str(python), "--ros-namespace", CELL) as process:
        assert process.line() == NODE
        lines = succeeds([python, EXAMPLE, CELL]).splitlines()
        code, log = process.ends(signal.SIGTERM)
    assert lines == ["joints A1 A2 A3 A4 A5 A6 A7", "there", "stop True"]
    assert code == 0, log


@pytest.mark.slow
async def test_states_come_100_times_in_a_second_of_simulated_time(python: Path) -> None:
    options: dict[str, Any] = {"ros2": True, "ros2_python": python, "ros_stamps": "simulated"}
    async with Simulator(clock="stepped", ros_namespace=CELL, **options) as simulator:
        assert simulator.ros2_node == f"/{CELL}/iiwa_sim"
        listening = asyncio.create_task(asyncio.to_thread(succeeds, [python, "-c", LISTENER, CELL]))
        while not listening.done():  # time passes in steps until it has heard enough
            await simulator.clock.advance(0.1)
            await asyncio.wait([listening], timeout=0.05)
        told, stamps = (await listening).splitlines()
        now_ns = round(1e9 * simulator.controller.tick * simulator.clock.tick_s)
    times = [int(each) for each in stamps.split()]
    apart = {later - earlier for earlier, later in pairwise(times)}
    assert all(each > 0 and each % 10_000_000 == 0 for each in apart), "one each 10 ms, but for those lost"
    assert 0 < int(told.split()[1]) <= now_ns
    assert times[-1] <= now_ns


@pytest.mark.slow
async def test_a_node_whose_process_ends_is_there_again(python: Path) -> None:
    async with Simulator(ros2=True, ros2_python=python) as simulator:
        assert simulator._ros is not None
        node = simulator._ros._ros2
        assert node is not None
        first = node._process
        assert first is not None
        assert first._process.stdin is not None
        first._process.stdin.close()  # killed it would leave segments of shared memory
        await until(lambda: node._process not in (None, first))
        client = await Client.connect(simulator.port)
        assert await client.ask("get status") == "stopped"
        await client.leaves()
        second = node._process
    assert second is not None
    assert second._process.returncode == 0, "it ends with the robot"
    assert len(asyncio.all_tasks()) == 1, "nothing watches over it any more"


def test_a_namespace_that_is_none_is_told(python: Path) -> None:
    said = refused(*ROS2, "--ros2-python", str(python), "--ros-namespace", "a b")
    assert said.startswith("iiwa-sim: ROS 2: no node: Invalid namespace: ")


def test_without_rclpy_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    said = refused(*ROS2, "--ros2-python", sys.executable)
    assert "has no rclpy that works" in said
    assert said.endswith("iiwa-sim ros2-env makes an environment that has it\n")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    said = refused(*ROS2)
    assert said.startswith("iiwa-sim: --ros2 needs a Python that has rclpy: make one by iiwa-sim ros2-env")


def test_an_interpreter_is_found_where_a_distribution_is_sourced(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("AMENT_PREFIX_PATH", "/opt/ros/kilted")
    assert found_python() == Path("/usr/bin/python3")
    made = python_in(default_folder())
    made.parent.mkdir(parents=True)
    made.touch()
    assert found_python() == made


def test_a_fleet_needs_a_namespace_for_each() -> None:
    said = refused(*ROS2, "--count", "2")
    assert "--ros-namespace: expected a different one for each robot on ROS 2" in said

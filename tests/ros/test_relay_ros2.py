"""The robot as a node of ROS 2, with rclpy in processes and an environment of their own."""

from __future__ import annotations

import json
import os
import signal
import socket
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import connect

from iiwa_sim.ros import relay
from iiwa_sim.ros.ros2_env import default_folder
from iiwa_sim.ros.rosbridge_session import CANCEL_SERVICE
from iiwa_sim.simulator import Simulator
from tests.line_client import DEADLINE_S, wait_until
from tests.peers import lacks
from tests.processes import refused, running, started, succeeds

EXAMPLE = Path(__file__).parents[2] / "examples" / "ros2_rclpy.py"
USER = Path(__file__).parent / "rclpy_user.py"
RELAYS = Path(relay.__file__).parent
ROS2 = ("--port", "0", "--ros2")
CELL = f"cell_{os.getpid()}"
"""A namespace."""
DOMAINS = range(1, 40)
FIRST_LOCK = 23_400
"""A domain of DDS is whose process has bound the port of 127.0.0.1 that is so much more."""


@pytest.fixture(scope="module")
def python() -> Iterator[Path]:
    """An interpreter that has rclpy, and a domain of DDS that no other worker or run on this machine is in.

    In one domain robots of the same name are one, and all have one /clock.
    """
    found = default_folder() / "bin" / "python"
    if not found.exists():
        lacks("an environment of iiwa-sim ros2-env")
    for number in DOMAINS:
        with socket.socket() as lock, pytest.MonkeyPatch.context() as monkeypatch:
            try:
                lock.bind(("127.0.0.1", FIRST_LOCK + number))
            except OSError:
                continue
            monkeypatch.setenv("ROS_DOMAIN_ID", str(number))
            monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
            monkeypatch.setattr(relay, "END_S", DEADLINE_S)  # a machine may be slow
            yield found
            return
    raise AssertionError("all domains are in use")


@pytest.fixture(scope="module")
def shared(python: Path) -> Iterator[Simulator]:
    """A robot whose time runs ten times as fast.

    It ends with its file: robots that others start in this domain would share its /clock.
    """
    with Simulator(clock="10x", ros2=True, ros2_python=python, ros_namespace=CELL, rosbridge_port=0) as robot:
        yield robot


@pytest.fixture
def robot(shared: Simulator) -> Simulator:
    """Return the robot at its start: the test before may have left it in motion."""

    def begins() -> bool:
        if shared.controller.moving:
            shared.controller.stop()
            return False
        shared.backdoor.restore_state("start")
        return True

    wait_until(lambda: shared.call(begins))
    return shared


def user(python: Path, scenario: str) -> list[str | Path]:
    """Return the command of a user's node in a process."""
    return [python, USER, RELAYS, CELL, scenario]


# Robots of their own come first: the shared one has the same namespace, and all have one /clock.


@pytest.mark.slow
def test_a_users_node_sees_the_robot_and_sends_a_trajectory(python: Path) -> None:
    with running("--ros2", "--ros2-python", str(python), "--ros-namespace", CELL) as process:
        assert process.line() == f"ROS 2 node /{CELL}/iiwa_sim\n"
        lines = succeeds([python, EXAMPLE, CELL]).splitlines()
        code, log = process.ends(signal.SIGTERM)
    assert lines == ["joints A1 A2 A3 A4 A5 A6 A7", "there", "stop True"]
    assert code == 0, log


@pytest.mark.slow
def test_a_wrong_namespace_is_reported(python: Path) -> None:
    line = refused(*ROS2, "--ros2-python", str(python), "--ros-namespace", "a b")
    assert line.startswith("iiwa-sim: ROS 2: no node: Invalid namespace: ")


def test_without_rclpy_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    line = refused(*ROS2, "--ros2-python", sys.executable)
    assert "has no rclpy that works" in line
    assert line.endswith("iiwa-sim ros2-env makes an environment that has it\n")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    line = refused(*ROS2)
    assert line.startswith("iiwa-sim: --ros2 needs a Python that has rclpy: make one by iiwa-sim ros2-env")


def test_commands_end_with_results_services_answer_and_states_are_published(
    python: Path, robot: Simulator
) -> None:
    printed: dict[str, Any] = json.loads(succeeds(user(python, "commands")))
    results = [(each["command_id"], each["result_code"]) for each in printed["results"]]
    assert results == [(1, 0), (2, 3023), (3, 3000)]
    assert "finite" in printed["results"][2]["additional_information"]
    assert [round(each, 6) for each in robot.joints] == [0.2, 0.7, 0.2, -0.9, 0.2, 1.2, 0.2]
    assert (printed["status"]["drives_powered"], printed["status"]["in_error"]) == ({"val": 1}, {"val": 0})
    assert printed["set_io"] == {"error": 0}
    assert {"group_id": "DO", "pin_number": 2} in printed["on"]
    assert robot.controller.override == 1.0
    moving = printed["tf"]["transforms"]
    assert moving[-1]["child_frame_id"] == "tool"
    assert len(moving) == len(robot.joints) + 1
    assert printed["tf_static"]["transforms"]
    assert "<robot" in printed["description"]["data"]


@pytest.mark.slow
def test_goals_end_as_those_of_joint_trajectory_controller(python: Path, robot: Simulator) -> None:
    printed: dict[str, Any] = json.loads(succeeds(user(python, "goals")))
    reached, cancelled, preempted, stopped = printed["ends"]
    assert reached == [4, 0, ""]
    # Feedback is 20 times in a second of simulated time; what is not read in time is left out.
    assert 1 <= len(printed["feedback"]) <= 81
    first = printed["feedback"][0]
    assert first["joint_names"] == [f"A{k}" for k in range(1, 8)]
    there = zip(first["desired"]["positions"], first["actual"]["positions"], strict=True)
    assert [a - b for a, b in there] == pytest.approx(first["error"]["positions"], abs=1e-12)
    assert cancelled[:2] == [5, 0]
    assert printed["cancelled"] == [1, 0], "the second time it has ended"
    assert preempted == [6, -1, "preempted by a newer trajectory"]
    assert printed["stopped"]
    assert stopped[1] == -1
    assert not robot.controller.moving


@pytest.mark.slow
def test_a_goal_that_another_client_cancels_is_aborted(python: Path, robot: Simulator) -> None:
    with started(*user(python, "cancelled_by_another")) as client:
        assert json.loads(client.line()) == "sent"
        with connect(f"ws://127.0.0.1:{robot.rosbridge_port}") as other:
            other.send(json.dumps({"op": "call_service", "service": CANCEL_SERVICE}))
            other.recv(DEADLINE_S)
        assert json.loads(client.line()) == [6, -1, "cancelled"]
        client.process.wait(DEADLINE_S)

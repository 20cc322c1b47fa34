"""The robot as a node of ROS 2, with rclpy in processes and an environment of their own."""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Iterator
from math import nan
from pathlib import Path

import pytest
from websockets.sync.client import connect

from iiwa_sim.ros.rosbridge_session import CANCEL_SERVICE
from iiwa_sim.simulator import Simulator
from tests.processes import refused, running, succeeds
from tests.ros.users import AWAY, CELL, HERE, NAMES, User, compiled, rclpy_python, user
from tests.ros_robot import command, ptp
from tests.talking import DEADLINE_S, wait_until

EXAMPLE = Path(__file__).parents[2] / "examples" / "ros2_rclpy.py"
ROS2 = ("--port", "0", "--ros2")
NODE = f"ROS 2 node /{CELL}/iiwa_sim\n"
"""Of a user: prints the time of /clock, then the stamps of 50 joint states, in ns."""
RMI = "robot_movement_interface"
JOINT_STATE = "sensor_msgs/msg/JointState"


@pytest.fixture(scope="module")
def python() -> Iterator[Path]:
    """An interpreter that has rclpy."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        yield rclpy_python(monkeypatch)


@pytest.fixture(scope="module")
def whole_python(python: Path) -> Path:
    """One that has the types that no wheel has, too."""
    compiled(python)
    return python


@pytest.fixture(scope="module")
def shared(whole_python: Path) -> Iterator[tuple[Simulator, User]]:
    """A robot whose time runs ten times as fast, and a user.

    It ends with its file: robots that others start in this domain would share its /clock.
    """
    with (
        Simulator(
            clock="10x", ros2=True, ros2_python=whole_python, ros_namespace=CELL, rosbridge_port=0
        ) as robot,
        user(whole_python) as someone,
    ):
        yield robot, someone


@pytest.fixture
def cell(shared: tuple[Simulator, User]) -> tuple[Simulator, User]:
    """These two, with the robot as it was at its start: the test before may have left it on its way."""
    robot, _ = shared

    def begins() -> bool:
        if robot.controller.moving:
            robot.controller.stop()
            return False
        robot.backdoor.restore_state("start")
        return True

    wait_until(lambda: robot.call(begins))
    return shared


# Robots of their own come first: the shared one has the same namespace, and all have one /clock.


@pytest.mark.slow
def test_a_users_node_sees_the_robot_and_sends_a_trajectory(python: Path) -> None:
    with running("--ros2", "--ros2-python", str(python), "--ros-namespace", CELL) as process:
        assert process.line() == NODE
        lines = succeeds([python, EXAMPLE, CELL]).splitlines()
        code, log = process.ends(signal.SIGTERM)
    assert lines == ["joints A1 A2 A3 A4 A5 A6 A7", "there", "stop True"]
    assert code == 0, log


@pytest.mark.slow
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


@pytest.mark.slow
def test_goals_end_as_those_of_joint_trajectory_controller(cell: tuple[Simulator, User]) -> None:
    robot, someone = cell
    assert someone.sends("reached", [(2.0, AWAY), (4.0, HERE)])
    end = someone.asks("result", name="reached")
    assert (end["status"], end["result"]) == (4, {"error_code": 0, "error_string": ""})
    assert [round(each, 6) for each in robot.joints] == [round(each, 6) for each in HERE]
    # Feedback is 20 times in a second of simulated time; what is not read in time is left out.
    assert 1 <= len(end["feedback"]) <= 81
    first = end["feedback"][0]
    assert first["joint_names"] == [f"A{k}" for k in range(1, 8)]
    there = zip(first["desired"]["positions"], first["actual"]["positions"], strict=True)
    assert [a - b for a, b in there] == pytest.approx(first["error"]["positions"], abs=1e-12)

    # Cancelled: an hour's way, so that no slow machine is at its end before.
    assert someone.sends("cancelled", [(3600.0, AWAY)])
    someone.asks("feedback", name="cancelled", count=1)
    assert someone.asks("cancel", name="cancelled") == {"code": 0, "canceling": 1}
    end = someone.asks("result", name="cancelled")
    assert (end["status"], end["result"]["error_code"]) == (5, 0)
    assert someone.asks("cancel", name="cancelled")["canceling"] == 0, "it has ended"

    # Preempted by a newer one, and that by the service.
    assert someone.sends("old", [(3600.0, AWAY)])
    assert someone.sends("new", [(3600.0, AWAY)])
    end = someone.asks("result", name="old")
    assert (end["status"], end["result"]["error_code"]) == (6, -1)
    assert end["result"]["error_string"] == "preempted by a newer trajectory"
    assert someone.calls("stop", "std_srvs/srv/Trigger")["success"]
    assert someone.asks("result", name="new")["result"]["error_code"] == -1


@pytest.mark.slow
def test_a_goal_that_another_client_cancels_is_aborted(cell: tuple[Simulator, User]) -> None:
    robot, someone = cell
    assert someone.sends("mine", [(3600.0, AWAY)])
    with connect(f"ws://127.0.0.1:{robot.rosbridge_port}") as other:
        other.send(json.dumps({"op": "call_service", "service": CANCEL_SERVICE}))
        other.recv(DEADLINE_S)
    end = someone.asks("result", name="mine")
    assert (end["status"], end["result"]) == (6, {"error_code": -1, "error_string": "cancelled"})


def test_commands_end_with_their_results_and_services_answer(cell: tuple[Simulator, User]) -> None:
    robot, someone = cell
    someone.asks("hear", topic="command_result", kind=f"{RMI}/msg/Result")
    results = {}
    for asked in (ptp(1, AWAY), ptp(2, [99.0] * 7), command(3, "PTP", "JOINTS", [nan] * 7)):
        listed = {"commands": [asked], "replace_previous_commands": True}
        someone.asks("publish", topic="command_list", kind=f"{RMI}/msg/CommandList", messages=[listed])
        (told,) = someone.asks("wait", topic="command_result", count=1)["messages"]
        results[told["command_id"]] = (told["result_code"], told["additional_information"])
    assert results[1] == (0, "")
    assert results[2][0] == 3023
    assert results[3][0] == 3000
    assert "finite" in results[3][1]
    assert [round(each, 6) for each in robot.joints] == list(AWAY)
    status = someone.hears("robot_status", "industrial_msgs/msg/RobotStatus", 1)[-1]
    assert (status["drives_powered"], status["in_error"]) == ({"val": 1}, {"val": 0})
    assert someone.calls("set_io", f"{RMI}/srv/SetIO", number=2, value=True) == {"error": 0}
    states = someone.calls("robot/get_digital_ios", f"{RMI}/srv/GetDigitalIOs", ios=[])
    assert {"group_id": "DO", "pin_number": 2} in [each["id"] for each in states["ios"] if each["value"]]
    # A call that fails is answered, since ROS 2 has no other way; the robot goes on as before.
    someone.calls("scale_speed", f"{RMI}/srv/SetFloat", value=nan)
    assert robot.controller.override == 1.0


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

"""A client of rosbridge with messages of ROS 2, on the stepped core."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from iiwa_sim.controller.modes import Mode
from iiwa_sim.ros.joint_interface import ACTION, ACTION_TYPE, COMMANDS, STATES, TRAJECTORY
from iiwa_sim.ros.messages import BadMessage
from tests.ros_robot import NOW_NS, RosClient, RosRobot, command
from tests.stepped import assert_within_limits

HERE = [0.0, 0.523599, 0.0, -1.047198, 0.0, 1.570796, 0.0]
AWAY = [0.2, 0.7, 0.2, -0.9, 0.2, 1.2, 0.2]
NOW = {"sec": NOW_NS // 10**9, "nanosec": NOW_NS % 10**9}


class Client(RosClient):
    """A client that sends goals."""

    def goal(self, identifier: str, points: Sequence[Any], **fields: Any) -> list[dict[str, Any]]:
        args = {"trajectory": trajectory(points), **fields.pop("args", {})}
        goal = {"action": ACTION, "action_type": ACTION_TYPE, "args": args, "feedback": True, **fields}
        return self.performs("send_action_goal", id=identifier, **goal)

    def runs(self) -> list[dict[str, Any]]:
        messages = []
        for _ in range(20_000):
            self.robot.step()
            messages += self.receives()
            if not self.robot.controller.moving:
                self.robot.step(2)
                return messages + self.receives()
        raise AssertionError("still moving")


def trajectory(points: Sequence[tuple[float, Sequence[float]]], **fields: Any) -> dict[str, Any]:
    rows = [
        {"positions": list(place), "time_from_start": {"sec": int(t), "nanosec": round(t % 1 * 10**9)}}
        for t, place in points
    ]
    return {"joint_names": [f"A{k}" for k in range(1, 8)], "points": rows, **fields}


@pytest.fixture
def client(robot: RosRobot) -> Client:
    return Client(robot)


def test_a_goal_is_followed_with_feedback_and_succeeds(client: Client, robot: RosRobot) -> None:
    assert client.goal("send_action_goal:1", [(1.0, AWAY)]) == []
    messages = client.runs()
    (result,) = [each for each in messages if each["op"] == "action_result"]
    assert result == {
        "op": "action_result",
        "action": ACTION,
        "values": {"error_code": 0, "error_string": ""},
        "status": 4,
        "result": True,
        "id": "send_action_goal:1",
    }
    feedback = [each["values"] for each in messages if each["op"] == "action_feedback"]
    assert len(feedback) == pytest.approx(20, abs=3)
    assert feedback[0]["joint_names"] == list(robot.description.joints)
    assert feedback[0]["header"] == {"stamp": NOW, "frame_id": ""}
    for each in feedback:
        for wanted, there, off in zip(
            each["desired"]["positions"], each["actual"]["positions"], each["error"]["positions"], strict=True
        ):
            assert off == pytest.approx(wanted - there, abs=1e-12)
    assert robot.controller.joints == tuple(AWAY)
    assert robot.controller.mode is Mode.TRAJECTORY


def test_a_goal_replaces_a_servo_of_the_command_list(client: Client, robot: RosRobot) -> None:
    robot.gets(command(1, "SMART", "JOINTS", AWAY))
    robot.step(100)
    assert client.goal("1", [(2.0, AWAY)]) == []
    assert client.runs()[-1]["status"] == 4
    assert robot.results == [(1, 3060)]


def test_a_newer_goal_aborts_the_one_before(client: Client, robot: RosRobot) -> None:
    client.goal("one", [(2.0, AWAY)])
    robot.step(300)
    messages = client.goal("two", [(2.0, HERE)])
    (result,) = [each for each in messages if each["op"] == "action_result"]
    assert (result["id"], result["status"], result["values"]["error_code"]) == ("one", 6, -1)
    assert result["values"]["error_string"] == "preempted by a newer trajectory"
    (last,) = [each for each in client.runs() if each["op"] == "action_result"]
    assert (last["id"], last["status"]) == ("two", 4)


@pytest.mark.parametrize(
    ("args", "status", "code"),
    [
        ({"path_tolerance": [{"name": "A3", "position": 1e-4}]}, 6, -4),
        (
            {
                "goal_tolerance": [{"name": "A3", "position": 1e-9}],
                "goal_time_tolerance": {"nanosec": 1_000_000},
            },
            6,
            -5,
        ),
        ({"path_tolerance": [{"name": "A3", "position": -1.0, "velocity": 1e-9}]}, 4, 0),
    ],
)
def test_tolerances_have_the_codes_of_joint_trajectory_controller(
    client: Client, args: dict[str, Any], status: int, code: int
) -> None:
    client.goal("one", [(0.5, AWAY), (1.0, HERE)], args=args)
    (result,) = [each for each in client.runs() if each["op"] == "action_result"]
    assert (result["status"], result["values"]["error_code"], result["result"]) == (status, code, True)


def test_points_and_ends_are_accepted_as_by_joint_trajectory_controller(
    client: Client, robot: RosRobot
) -> None:
    """Times rise by as little as 1 ns, and the last velocity is 0 in a float32."""
    rows = trajectory([(1.0, AWAY), (1.000000001, AWAY), (2.0, HERE)])
    rows["points"][-1]["velocities"] = [1.1e-7, -1.1e-7, *[0.0] * 5]
    assert client.goal("one", [], args={"trajectory": rows}) == []
    (result,) = [each for each in client.runs() if each["op"] == "action_result"]
    assert (result["status"], result["values"]["error_code"]) == (4, 0)
    assert robot.controller.joints == tuple(HERE)
    rows["points"][-1]["velocities"][0] = 1.3e-7
    (result,) = client.goal("two", [], args={"trajectory": rows})
    assert "the last one, has a velocity other than 0" in result["values"]


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"args": {"trajectory": trajectory([(1.0, AWAY[:6])])}}, "6 positions"),
        (
            {"args": {"trajectory": trajectory([(1.0, AWAY)]) | {"joint_names": list("ABCDEFG")}}},
            "joint_names 'A'",
        ),
        ({"args": {"trajectory": trajectory([(2.0, AWAY), (1.0, HERE)])}}, "is not later than"),
        ({"args": {"trajectory": trajectory([(1e-3, AWAY)])}}, "faster"),
        ({"args": {"speed": 1}}, "unknown field `speed`"),
        ({"args": {"multi_dof_trajectory": {"joint_names": ["x"]}}}, "multi_dof_trajectory"),
        ({"args": {"trajectory": trajectory([(1.0, AWAY)]) | {"header": {"stamp": {"sec": 5}}}}}, "stamp"),
        ({"action": "/other"}, "there is no action /other"),
    ],
)
def test_a_rejected_goal_has_a_reason_and_moves_nothing(
    client: Client, robot: RosRobot, fields: dict[str, Any], words: str
) -> None:
    goal = {"action": ACTION, "action_type": ACTION_TYPE, "args": {"trajectory": trajectory([(1.0, AWAY)])}}
    (result,) = client.performs("send_action_goal", id="one", **(goal | fields))
    assert (result["op"], result["id"], result["status"], result["result"]) == (
        "action_result",
        "one",
        0,
        False,
    )
    assert words in result["values"]
    assert not robot.controller.moving


def test_a_goal_while_the_emergency_stop_is_pressed_and_after_a_reset(
    client: Client, robot: RosRobot
) -> None:
    client.goal("one", [(2.0, AWAY)], feedback=False)
    robot.step(300)
    result, response = client.performs("call_service", service="/emergency_stop", args={"data": True})
    assert (result["status"], result["values"]) == (6, {"error_code": -1, "error_string": "emergency stop"})
    assert response["values"] == {"success": True, "message": ""}
    client.runs()
    assert client.goal("two", [(2.0, AWAY)])[0]["result"] is False
    (refused,) = client.performs("call_service", service="/reset_error")
    assert refused["values"] == {"success": False, "message": "the emergency stop has to be released first"}
    client.performs("call_service", service="/emergency_stop", args={"data": False})
    assert client.performs("call_service", service="/reset_error")[0]["values"]["success"] is True
    client.goal("three", [(2.0, AWAY)])
    robot.step(300)
    responses = {each["op"]: each for each in client.performs("call_service", service="/stop")}
    assert responses["service_response"]["values"]["success"] is True
    assert responses["action_result"]["values"] == {"error_code": -1, "error_string": "stopped"}


def test_trajectories_come_by_topic_and_a_bad_one_is_reported(client: Client, robot: RosRobot) -> None:
    kind = "trajectory_msgs/msg/JointTrajectory"
    assert client.performs("advertise", topic=TRAJECTORY, type=kind) == []
    assert client.performs("publish", topic=TRAJECTORY, msg=trajectory([(1.0, AWAY)])) == []
    robot.step(100)
    (status,) = client.performs("publish", topic=TRAJECTORY, msg=trajectory([(1.0, AWAY[:3])]), id="x")
    assert (status["op"], status["id"]) == ("status", "x")
    assert "3 positions" in status["msg"]
    client.runs()
    assert robot.controller.joints == tuple(AWAY)


def test_ros2_control_drives_the_robot_by_the_topics_of_its_hardware_interface(
    client: Client, robot: RosRobot
) -> None:
    client.performs("subscribe", topic=STATES, type="sensor_msgs/msg/JointState", queue_length=1000)
    names = list(reversed(robot.description.joints))
    home = np.array(robot.controller.joints)
    wanted = home
    for k in range(300):
        wanted = home + 0.2 * (1.0 - np.cos(0.02 * k))
        message = {"name": names, "position": wanted[::-1].tolist()}
        assert {each["op"] for each in client.performs("publish", topic=COMMANDS, msg=message)} <= {"publish"}
        robot.notice_mode()
        robot.step(5)
        off = np.abs(np.subtract(robot.controller.joints, wanted)).max()
        assert off < 0.05, "it does not follow"
    robot.runs_until_stopped()
    assert robot.controller.joints == pytest.approx(wanted, abs=1e-9)
    assert robot.controller.mode is Mode.DIRECT
    assert_within_limits(robot)
    states = [each["msg"] for each in client.receives()]
    assert states[-1]["name"] == list(robot.description.joints)


def test_the_speed_scale_and_each_output_have_std_types(client: Client, robot: RosRobot) -> None:
    robot.graph.receive("/set_speed_scale", {"data": 0.5})
    assert robot.controller.override == 0.5
    for wrong in (-0.1, 1.1, float("nan"), 1e-9):
        with pytest.raises(BadMessage, match="expected 0, or"):
            robot.graph.receive("/set_speed_scale", {"data": wrong})
    (answer,) = client.performs("call_service", service="/set_output_3", args={"data": True})
    assert answer["values"] == {"success": True, "message": ""}
    assert robot.controller.io.outputs[2]
    (answer,) = client.performs("call_service", service="/set_output_99", args={"data": True})
    assert not answer["result"]

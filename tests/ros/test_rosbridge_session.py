"""A client of rosbridge, message by message, on the stepped core."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.ros.joint_interface import ACTION
from tests.ros_robot import RosClient as Client
from tests.ros_robot import RosRobot, ptp
from tests.samples import some

A = (0.3, 0.3, 0.0, -1.2, 0.0, 1.0, 0.0)


@pytest.fixture
def client(robot: RosRobot) -> Client:
    return Client(robot)


def test_a_published_list_moves_the_robot_and_its_results_come(client: Client, robot: RosRobot) -> None:
    kind = "robot_movement_interface/CommandList"
    assert client.performs("advertise", topic="/command_list", type=kind, id="advertise:1") == []
    assert client.performs("subscribe", topic="command_result", type="robot_movement_interface/Result") == []
    assert client.performs("publish", topic="/command_list", msg={"commands": [ptp(3, A)]}) == []
    robot.runs_until_results(1)
    (result,) = client.receives()
    assert (result["op"], result["topic"]) == ("publish", "command_result"), "named as the client names it"
    assert result["msg"]["command_id"] == 3
    assert result["msg"]["result_code"] == 0
    assert client.performs("unadvertise", topic="/command_list") == []


def test_throttle_and_queue_of_several_subscriptions(client: Client, robot: RosRobot) -> None:
    def heard_in_a_second() -> int:
        count = 0
        for _ in range(500):
            robot.step()
            count += len(client.receives())
        return count

    client.performs("subscribe", topic="/joint_states", id="1", throttle_rate=200)
    assert heard_in_a_second() == 5
    client.performs("subscribe", topic="/joint_states", id="2", throttle_rate=50, queue_length=1)
    assert heard_in_a_second() == pytest.approx(20, abs=1)
    client.performs("unsubscribe", topic="/joint_states", id="2")
    client.performs("subscribe", topic="/joint_states", id="3", compression="cbor")
    assert heard_in_a_second() == pytest.approx(100, abs=3)
    client.performs("unsubscribe", topic="/joint_states")
    assert heard_in_a_second() == 0


@pytest.mark.parametrize(
    ("service", "args", "words"),
    [
        ("/nothing", None, "there is no /nothing"),
        ("/scale_speed", {"value": "x"}, "Expected `float`"),
        ("/scale_speed", [1, 2], "Expected `object`"),
    ],
)
def test_a_call_that_fails_answers_false_and_a_string(
    client: Client, robot: RosRobot, service: str, args: Any, words: str
) -> None:
    response = client.calls(service, args, id=7)
    assert response["result"] is False
    assert words in response["values"]
    assert response["id"] == 7
    assert robot.controller.override == 1.0


def test_questions_of_tools_that_connect_are_answered(client: Client) -> None:
    assert client.calls("/rosapi/action_servers")["values"] == {"action_servers": [ACTION]}
    assert client.calls("/rosapi/topic_type", {"topic": "joint_states"})["values"] == {
        "type": "sensor_msgs/JointState"
    }
    for _ in range(2):  # a name with two slashes is no type of ROS 2
        answer = client.calls("/rosapi/service_type", {"service": "/robot/get_digital_ios"})
        assert answer["values"] == {"type": "robot_movement_interface/GetDigitalIOs"}
    assert client.calls("/rosapi/topics_for_type", {"type": "sensor_msgs/msg/JointState"})["values"] == {
        "topics": ["/joint_states", "/robot_joint_states", "/robot_joint_commands"]
    }


@pytest.mark.parametrize(
    ("operation", "fields", "words"),
    [
        ("publish", {"topic": "/joint_states", "msg": {}}, "no subscriber of /joint_states"),
        ("publish", {"topic": "/command_list", "msg": {"commands": [{"pose": [None]}]}}, "commands[0].pose"),
        ("advertise", {"topic": "/command_list", "type": "std_msgs/String"}, "not std_msgs/String"),
        ("subscribe", {"topic": "/chatter"}, "no publisher of /chatter"),
        ("unsubscribe", {"topic": "/joint_states"}, "is not subscribed to"),
        ("send_action_goal", {"feedback": 1}, "`$.feedback`"),
        ("dance", {}, "op dance: expected advertise"),
    ],
)
def test_misuse_is_answered_with_its_id_and_changes_nothing(
    client: Client, robot: RosRobot, operation: str, fields: dict[str, Any], words: str
) -> None:
    assert words in client.error_of(operation, id="mine", **fields)
    assert words in client.error_of(operation, **fields)
    assert not robot.controller.moving
    assert not robot.graph.watching
    assert robot.log.refusals[-1][2] == 3040


_json = st.sampled_from([None, True, -1, 7, 1e308, "", "/x", "a/b/C", [], [{}], ["x", [2]], {}, {"name": {}}])
_fields = st.fixed_dictionaries(
    {},
    optional={
        "topic": st.sampled_from(["/command_list", "/joint_states"]) | _json,
        "service": st.sampled_from(["/get_io", "/rosapi/topic_type", "/rosapi/get_time"]) | _json,
        **dict.fromkeys(("msg", "args", "id", "type", "level", "throttle_rate", "queue_length"), _json),
    },
)
_operations = st.sampled_from(
    ["publish", "subscribe", "unsubscribe", "advertise", "call_service", "auth", "set_level", "status"]
)
ROBOT = RosRobot()


@settings(max_examples=some(30))
@given(st.lists(st.tuples(_operations | st.text("a/ {\x00\u00e9", max_size=5), _fields), max_size=5))
def test_the_session_continues_after_any_input(messages: list[tuple[str, dict[str, Any]]]) -> None:
    client = Client(ROBOT)  # its log raises what is a fault of ours
    for operation, fields in messages:
        client.performs(operation, **fields)
    assert client.calls("/rosapi/nodes")["result"] is True
    client.session.end()
    assert not ROBOT.graph.watching

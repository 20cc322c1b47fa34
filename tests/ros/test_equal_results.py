"""Every command gets one result, in order, and the same one in the words of ROS 1 and of ROS 2."""

from __future__ import annotations

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from tests.ros_robot import RosClient, RosRobot, command, ptp

A, B = [0.3, 0.3, 0.0, -1.2, 0.0, 1.0, 0.0], [0.0, 0.6, 0.0, -1.1, 0.0, 1.5, 0.0]
POSE = [0.5, 0.1, 0.4, 0.0, 1.5, 0.0]
RESULTS, LISTS = "/command_result", "/command_list"
COMMANDS = [
    ptp(0, A),
    ptp(0, B, blending_type="%", blending=[0.25]),
    ptp(0, A, velocity_type="RAD/S", acceleration_type="%", acceleration=[0.5]),
    command(0, "LIN", "EULER_INTRINSIC_ZYX", POSE, velocity_type="M/S", velocity=[0.25]),
    command(0, "LIN", "JOINTS", B, pose_reference="/tool", pose_reference_frame={"x": 0.125}),
    command(0, "PTP", "EULER_INTRINSIC_ZYX", POSE, pose_reference="t", pose_reference_frame={"x": 0.125}),
    command(0, "SMART", "JOINTS", A),
    command(0, "SMART", "JOINTS", B),
    command(0, "LINFORCE", "EULER_INTRINSIC_ZYX", POSE, effort_type="N", effort=[5.0] * 3),
    command(0, "CIRC", "JOINTS", A),
    ptp(0, [3.5] * 7),
    ptp(0, A, velocity=[]),
]
CALLS = [
    ("/scale_speed", {"value": 0.5}),
    ("/scale_speed", {"value": 0.0}),
    ("/scale_speed", {"value": 1.0}),
    ("/stop_robot_right_now", {}),
    ("/set_io", {"number": 3, "value": True}),
    ("/robot/set_digital_ios", {"ios": [{"id": {"group_id": "DO", "pin_number": 2}, "value": True}]}),
    ("/robot/get_digital_ios", {"ios": [{"group_id": "DO", "pin_number": 2}, {"group_id": "XX"}]}),
]
lists = st.tuples(st.lists(st.sampled_from(COMMANDS), max_size=4), st.booleans())
events = st.tuples(lists | st.sampled_from(CALLS), st.integers(0, 200))


def plays(dialogue: list[Any], words: str) -> tuple[list[Any], list[tuple[float, ...]]]:
    """What a client hears, and where the robot is after each tick; `words` is "" or "msg/"."""
    robot, heard, sent = RosRobot(), list[Any](), list[int]()
    client = RosClient(robot)
    client.says("subscribe", topic=RESULTS, type=f"robot_movement_interface/{words}Result")
    client.says("advertise", topic=LISTS, type=f"robot_movement_interface/{words}CommandList")
    for (what, how), ticks in [*dialogue, (("/scale_speed", {"value": 1.0}), 0)]:  # at 0 nothing would end
        robot.notice_mode()
        if isinstance(what, str):
            heard += client.says("call_service", service=what, args=how)
        else:
            told = [{**each, "command_id": len(sent) + k} for k, each in enumerate(what)]
            sent += range(len(sent), len(sent) + len(what))
            content = {"commands": told, "replace_previous_commands": how}
            heard += client.says("publish", topic=LISTS, msg=content)
        for _ in range(ticks):
            robot.step()
            heard += client.hears()
    for _ in range(60_000):
        if robot.appendix_a.is_idle:
            break
        robot.step()
        heard += client.hears()
    results = [each["msg"] for each in heard if each.get("topic") == RESULTS]
    assert [each["command_id"] for each in results] == sent
    assert all(("seq" in each["header"]) is (words == "") for each in results)
    for each in results:
        del each["header"]
    for values in (each["values"] for each in heard if each["op"] == "service_response"):
        for pin in values.get("ios", []):
            pin["stamp"] = list(pin["stamp"].values())
    return heard, robot.joints


@given(st.lists(events, min_size=1, max_size=4))
def test_results_and_motion_are_the_same_in_both_words(dialogue: list[Any]) -> None:
    """Tick by tick, to the last bit."""
    assert plays(dialogue, "") == plays(dialogue, "msg/")

"""Definitions of messages, and messages that fit them."""

from __future__ import annotations

import re
from array import array
from pathlib import Path
from typing import Any

import pytest

from iiwa_sim.ros.messages import (
    BadMessage,
    checked,
    from_ros1,
    to_ros1,
)
from iiwa_sim.ros.relays.pipe import shortest

LIST = "robot_movement_interface/msg/CommandList"
RMI = Path(__file__).parents[2] / "protocol" / "rmi"


def test_packages_for_ros_2_have_the_fields_and_constants_of_ros_1s() -> None:
    paths = [path for path in RMI.glob("*/msg/*.msg") if (RMI / "ros2" / path.relative_to(RMI)).exists()]
    assert {path.parts[-3] for path in paths} == {"industrial_msgs", "robot_movement_interface"}
    for path in paths:
        one, two = (file.read_text() for file in (path, RMI / "ros2" / path.relative_to(RMI)))
        for named, short in (("builtin_interfaces/Time", "time"), ("std_msgs/Header", "Header")):
            two = re.sub(rf"^{named}\b", short, two, flags=re.MULTILINE)
        assert [_without_comment(line) for line in one.splitlines() if _without_comment(line)] == [
            _without_comment(line) for line in two.splitlines() if _without_comment(line)
        ]


def _without_comment(line: str) -> str:
    return " ".join(line.partition("#")[0].split())


def test_fields_that_are_not_given_have_the_defaults_of_ros() -> None:
    (command,) = checked({"commands": [{}]}, LIST).commands
    assert (command.header.stamp.sec, command.command_type, command.pose) == (0, "", [])
    assert command.pose_reference_frame.gamma == 0.0


@pytest.mark.parametrize(
    ("fields", "where"),
    [
        ({"command_id": 2**32}, "commands[0].command_id"),
        ({"command_id": 1.5}, "commands[0].command_id"),
        ({"pose": [0.0, "1"]}, "commands[0].pose[1]"),
        ({"poses": []}, "`poses` - at `$.commands[0]"),
    ],
)
def test_a_wrong_field_is_rejected_with_its_place(fields: dict[str, Any], where: str) -> None:
    with pytest.raises(BadMessage) as refused:
        checked({"commands": [fields]}, LIST)
    assert where in str(refused.value)


def test_a_message_of_ros_1_is_one_of_ros_2_and_back() -> None:
    header = {"stamp": {"sec": 3, "nanosec": 4}, "frame_id": "x"}
    two = {"header": header, "ios": [{"stamp": {"sec": 1, "nanosec": 2}}]}
    one = to_ros1(two)
    assert one["header"] == {"seq": 0, "stamp": {"secs": 3, "nsecs": 4}, "frame_id": "x"}
    assert one["ios"] == [{"stamp": {"secs": 1, "nsecs": 2}}]
    assert from_ros1(one) == two
    assert from_ros1({"header": {"seq": 1}}) == {"header": {}}


@pytest.mark.parametrize("value", [0.1, -2.96706, 1e-7])
def test_a_float32_is_the_decimal_that_was_meant(value: float) -> None:
    assert shortest(array("f", [value])[0]) == value
    assert str(shortest(float("nan"))) == "nan"

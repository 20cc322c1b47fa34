"""Definitions of messages, beside those that ROS 2 has itself and those that its parsers read."""

from __future__ import annotations

import json
import struct
from array import array
from pathlib import Path
from typing import Any

import pytest

from iiwa_sim.ros.joint_interface import ACTION_TYPE
from iiwa_sim.ros.messages import (
    BadMessage,
    Definition,
    checked,
    from_ros1,
    interface,
    serialized,
    to_ros1,
)
from iiwa_sim.ros.relays.pipe import shortest
from iiwa_sim.ros.ros2_env import default_folder, python_in
from tests.needed import lacks
from tests.processes import succeeds
from tests.ros_robot import RosRobot

LIST = "robot_movement_interface/msg/CommandList"
RMI = Path(__file__).parents[2] / "protocol" / "rmi"
KNOWN = """
import importlib, json, sys

found = {}
for name in sys.argv[1:]:
    package, kind, own = name.split("/")
    try:
        made = getattr(importlib.import_module(f"{package}.{kind}"), own)
    except ImportError:
        continue
    parts = {"srv": ("Request", "Response"), "action": ("Goal", "Result", "Feedback")}.get(kind)
    parts = [getattr(made, part) for part in parts] if parts else [made]
    found[name] = [dict(part.get_fields_and_field_types()) for part in parts]
print(json.dumps(found))
"""
"""Tells what the environment's Python knows of some interfaces."""


def environment() -> Path:
    python = python_in(default_folder())
    if not python.exists():
        lacks("an environment of iiwa-sim ros2-env")
    return python


@pytest.mark.requirement("FRA002")
def test_they_are_those_that_ros_2_generates_from() -> None:
    graph = RosRobot().graph
    names = [each.kind for each in (*graph.published.values(), *graph.subscribed.values())]
    names += [each.kind for each in graph.services.values()]
    waiting, every = [*names, ACTION_TYPE], list[str]()
    while waiting:
        name = waiting.pop()
        if name not in every:
            every.append(name)
            fields = (field.type for part in interface(name, name.split("/")[1]) for field in part.fields)
            waiting += [each.replace("/", "/msg/") for each in fields if "/" in each]
    known = json.loads(succeeds([environment(), "-c", KNOWN, *every]))
    assert {"trajectory_msgs/msg/JointTrajectoryPoint", "std_srvs/srv/Trigger"} <= known.keys()
    for name, parts in known.items():
        there = [{n: t for n, t in part.items() if not n.startswith("structure_needs")} for part in parts]
        assert [_in_python(part) for part in interface(name, name.split("/")[1])] == there, name


def _in_python(part: Definition) -> dict[str, str]:
    told, own = {}, part.details[0]
    for name, kind, length in zip(own["fieldnames"], own["fieldtypes"], own["fieldarraylen"], strict=True):
        told[name] = {-1: kind, 0: f"sequence<{kind}>"}.get(length, f"{kind}[{length}]")
    return told


def test_packages_for_ros_2_have_the_fields_and_constants_of_ros_1s() -> None:
    paths = [
        path
        for package in ("industrial_msgs", "robot_movement_interface")
        for path in (RMI / package).glob("*/*.msg")
    ]
    assert paths
    for path in paths:
        name = f"{path.parts[-3]}/{path.stem}"
        ((one,), (two,)) = (interface(name, "msg", ros2=ros2) for ros2 in (False, True))
        types = [each.type.replace("builtin_interfaces/Time", "time") for each in two.fields]
        assert [each.type for each in one.fields] == types
        assert one.constants == two.constants


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
def test_what_does_not_fit_is_refused_with_its_place(fields: dict[str, Any], where: str) -> None:
    with pytest.raises(BadMessage) as refused:
        checked({"commands": [fields]}, LIST)
    assert where in str(refused.value)


@pytest.mark.parametrize("name", ["", "std_msgs/Nothing", "../rmi/std_msgs", "std_msgs/srv/String"])
def test_a_name_that_is_none(name: str) -> None:
    with pytest.raises(KeyError):
        interface(name, "msg")


def test_a_message_of_ros_1_is_one_of_ros_2_and_back() -> None:
    header = {"stamp": {"sec": 3, "nanosec": 4}, "frame_id": "x"}
    two = {"header": header, "ios": [{"stamp": {"sec": 1, "nanosec": 2}}]}
    one = to_ros1(two, 7)
    assert one["header"] == {"seq": 7, "stamp": {"secs": 3, "nsecs": 4}, "frame_id": "x"}
    assert one["ios"] == [{"stamp": {"secs": 1, "nsecs": 2}}]
    assert from_ros1(one) == two
    assert from_ros1({"header": {"seq": 1}}) == {"header": {}}


def test_bytes_of_ros_1_have_numbers_of_their_types() -> None:
    (definition,) = interface("industrial_msgs/RobotStatus", "msg", ros2=False)
    values: dict[str, Any] = {each.name: {"val": -1} for each in definition.fields}
    values |= {"header": {"seq": 1, "stamp": {"secs": 2, "nsecs": 3}, "frame_id": "é"}, "error_code": -5}
    header = struct.pack("<IIII", 1, 2, 3, 2) + "é".encode()
    assert serialized(definition, values) == header + 6 * b"\xff" + struct.pack("<i", -5)


@pytest.mark.parametrize("value", [0.1, -2.96706, 1e-7, 16777216.0, 1.1754944e-38])
def test_a_float32_is_the_decimal_that_was_meant(value: float) -> None:
    assert shortest(array("f", [value])[0]) == value
    assert str(shortest(float("nan"))) == "nan"

"""Message and service definitions: sums equal to the published ones, types that check."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from iiwa_sim.ros.rmi.definitions import (
    definition_md5,
    message,
    message_md5,
    result_message,
    service,
    service_md5,
    type_of,
)

# What rosmsg and rossrv tell: all of it for ROS's own packages, the beginnings for the others.
MESSAGES = {
    "std_msgs/Header": "2176decaecbce78abc3b96ef049fabed",
    "std_msgs/Float32": "73fcbf46b49191e672908e50842a83d4",
    "sensor_msgs/JointState": "3066dcd76a6cfaef579bd0f34173e9fd",
    "industrial_msgs/RobotStatus": "b733cb45",
    "robot_movement_interface/EulerFrame": "a80a1671",
    "robot_movement_interface/Command": "9eb58a21",
    "robot_movement_interface/CommandList": "d584975b",
    "robot_movement_interface/IOState": "3809c2a3",
    "robot_movement_interface/IOStates": "9760d0cf",
    "robot_movement_interface/Result": "c42e143b65ad82ebad12c76fe9d39bb7",
    "robot_movement_interface/IOID": "92467fce",
    "robot_movement_interface/DigitalIOValue": "1531ef54",
    "robot_movement_interface/IOError": "1c077537",
}
SERVICES = {
    "std_srvs/Trigger": "937c9679a518e3a18d831e57125ea522",
    "robot_movement_interface/SetFloat": "0aca93dc",
    "robot_movement_interface/GetIO": "554345d0",
    "robot_movement_interface/SetIO": "ecf42524",
    "robot_movement_interface/GetDigitalIOs": "cbb85a79",
    "robot_movement_interface/SetDigitalIOs": "de845eb3",
}
RESULT_SUMS = {2016: "aae92300", 2021: "308eda94", 2023: "ebd62c31", 2024: "c42e143b"}
COMMAND_LIST = type_of(message("robot_movement_interface/CommandList"))


@pytest.mark.requirement("FRA002")
@pytest.mark.parametrize(("name", "published"), MESSAGES.items())
def test_messages_have_the_published_sums(name: str, published: str) -> None:
    assert message_md5(name).startswith(published)


@pytest.mark.requirement("FRA002")
@pytest.mark.parametrize(("year", "published"), RESULT_SUMS.items())
def test_results_have_the_sum_of_their_year(year: int, published: str) -> None:
    assert definition_md5(result_message(year)).startswith(published)


@pytest.mark.requirement("FRA002")
@pytest.mark.parametrize(("name", "published"), SERVICES.items())
def test_services_have_the_published_sums(name: str, published: str) -> None:
    assert service_md5(name).startswith(published)


def test_fields_that_are_not_given_have_the_defaults_of_ros() -> None:
    empty = msgspec.to_builtins(msgspec.convert({"commands": [{}]}, COMMAND_LIST))
    header = {"seq": 0, "stamp": {"secs": 0, "nsecs": 0}, "frame_id": ""}
    assert empty["header"] == header
    assert empty["replace_previous_commands"] is False
    (command,) = empty["commands"]
    assert command["header"] == header
    assert command["command_type"] == ""
    assert command["pose_reference_frame"] == dict.fromkeys(("x", "y", "z", "alpha", "beta", "gamma"), 0.0)
    assert command["pose"] == []


@pytest.mark.parametrize(
    ("command", "where"),
    [
        ({"command_id": 2**32}, "commands[0].command_id"),
        ({"command_id": 1.5}, "commands[0].command_id"),
        ({"pose": [0.0, "1"]}, "commands[0].pose[1]"),
        ({"pose": 1.0}, "commands[0].pose"),
        ({"poses": []}, "`poses` - at `$.commands[0]"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_place(command: dict[str, Any], where: str) -> None:
    with pytest.raises(msgspec.ValidationError) as refused:
        msgspec.convert({"commands": [command]}, COMMAND_LIST)
    assert where in str(refused.value)


@pytest.mark.parametrize("name", ["", "std_msgs/Nothing", "../rmi/std_msgs"])
def test_a_name_that_is_none(name: str) -> None:
    for look_up in (message, service):
        with pytest.raises(KeyError):
            look_up(name)

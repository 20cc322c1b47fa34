"""The bytes of ROS 1 that we write without ROS."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.ros.rmi.definitions import message, type_of
from iiwa_sim.ros.rmi.message_text import SINGLE, Definition, Field
from iiwa_sim.ros.rmi.serialized import NoSuchMessage, deserialized, serialized
from tests.ros_messages import MESSAGES, VALUES, Rosbags, contents
from tests.samples import some


@pytest.fixture(scope="module")
def rosbags() -> Rosbags:
    return Rosbags()


@pytest.mark.parametrize("name", MESSAGES)
@settings(max_examples=some(20))
@given(data=st.data())
def test_rosbags_reads_what_we_write(rosbags: Rosbags, name: str, data: st.DataObject) -> None:
    content = data.draw(contents(message(name)))
    assert rosbags.reads(name, serialized(message(name), content)) == content


def read(name: str, data: bytes) -> tuple[dict[str, Any], int]:
    """A message, and in how many steps it was read."""
    steps = deserialized(message(name), data)
    count = 1
    while True:
        try:
            next(steps)
            count += 1
        except StopIteration as end:
            return end.value, count


@pytest.mark.parametrize("name", MESSAGES)
@settings(max_examples=some(20))
@given(data=st.data())
def test_there_and_back(name: str, data: st.DataObject) -> None:
    content = data.draw(contents(message(name)))
    back, _ = read(name, serialized(message(name), content))
    assert _as_float32(message(name), back) == _as_float32(message(name), content)
    msgspec.convert(back, type_of(message(name)))


def test_a_float32_is_the_number_that_was_meant() -> None:
    name = "robot_movement_interface/Command"
    content = msgspec.to_builtins(type_of(message(name))())
    content |= {"pose": [0.1, -2.96706, 1e-7], "velocity": [float("nan"), float("inf")]}
    back, _ = read(name, serialized(message(name), content))
    assert back["pose"] == content["pose"]
    assert str(back["velocity"]) == "[nan, inf]"


def test_a_long_list_is_read_in_as_many_steps() -> None:
    one = msgspec.to_builtins(type_of(message("robot_movement_interface/Command"))())
    content = {"header": one["header"], "commands": [one] * 300, "replace_previous_commands": True}
    name = "robot_movement_interface/CommandList"
    back, steps = read(name, serialized(message(name), content))
    assert len(back["commands"]) == 300
    assert steps == 301


@given(data=st.binary(max_size=200))
def test_bytes_that_are_no_message_are_refused(data: bytes) -> None:
    """Random bytes raise NoSuchMessage or happen to be a message; no list is allocated for a false length."""
    try:
        content, _ = read("robot_movement_interface/CommandList", data)
    except NoSuchMessage:
        return
    assert serialized(message("robot_movement_interface/CommandList"), content)


def _as_float32(definition: Definition, content: dict[str, Any]) -> Any:
    def value(field: Field, told: Any) -> Any:
        if field.is_list:
            one = field._replace(length=SINGLE)
            return [value(one, each) for each in told]
        if field.type == "float32":
            return np.float32(told)
        return told if field.type in VALUES else _as_float32(message(field.type), told)

    return {field.name: value(field, content[field.name]) for field in definition.fields}

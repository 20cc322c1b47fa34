"""Messages of ROS 1: what we serialise is what others read, and what others serialise is what we read."""

from __future__ import annotations

from importlib import import_module
from io import BytesIO
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.dialect.rmi.definitions import Definition, Field, message, message_md5, service, type_of
from tests.ros1_tools import needs_ros, see_system_packages
from tests.ros_messages import MESSAGES, VALUES, Rosbags, contents

if TYPE_CHECKING:
    from iiwa_sim.serve.ros1_types import Types

SERVICE = "robot_movement_interface/GetDigitalIOs"


@pytest.fixture(scope="module")
def module() -> Any:
    """What needs genpy."""
    needs_ros()
    see_system_packages()
    return import_module("iiwa_sim.serve.ros1_types")


@pytest.fixture(scope="module")
def types(module: Any) -> Types:
    made: Types = module.Types(map(message, MESSAGES), [SERVICE])
    return made


@pytest.fixture(scope="module")
def rosbags() -> Rosbags:
    return Rosbags()


@pytest.mark.requirement("FRA002")
@pytest.mark.parametrize("name", MESSAGES)
@settings(max_examples=20)
@given(data=st.data())
def test_rosbags_reads_what_we_serialise(
    types: Types, rosbags: Rosbags, name: str, data: st.DataObject
) -> None:
    content = data.draw(contents(message(name)))
    assert rosbags.reads(name, _serialised(types.filled(message(name), content))) == content


@pytest.mark.parametrize("name", MESSAGES)
@settings(max_examples=20)
@given(data=st.data())
def test_there_and_back(module: Any, types: Types, name: str, data: st.DataObject) -> None:
    content = data.draw(contents(message(name)))
    heard = types.heard(name)().deserialize(_serialised(types.filled(message(name), content)))
    assert heard.fault is None
    back = module.told(message(name), heard)
    assert _as_float32(message(name), back) == _as_float32(message(name), content)
    msgspec.convert(back, type_of(message(name)))


def test_a_float32_is_the_number_that_was_meant(module: Any, types: Types) -> None:
    name = "robot_movement_interface/Command"
    content = {"pose": [0.1, -2.96706, 1e-7], "velocity": [float("nan"), float("inf")]}
    heard = types.heard(name)().deserialize(_serialised(types.filled(message(name), content)))
    back = module.told(message(name), heard)
    assert back["pose"] == content["pose"]
    assert str(back["velocity"]) == "[nan, inf]"


@given(data=st.binary(max_size=200))
def test_bytes_that_are_no_message_are_marked(types: Types, data: bytes) -> None:
    """Or they happen to be one; nothing is raised."""
    heard = types.heard("robot_movement_interface/CommandList")().deserialize(data)
    assert heard.fault in (None, "what came is no robot_movement_interface/CommandList")


@pytest.mark.parametrize("name", MESSAGES)
def test_genpy_finds_our_sums(types: Types, name: str) -> None:
    assert types.message(name)._md5sum == message_md5(name)


def test_a_service_has_its_two_halves(types: Types) -> None:
    made = types.services[SERVICE]
    assert made._type == SERVICE
    response = types.filled(service(SERVICE).response, {"success": True, "errors": []})
    assert isinstance(response, made._response_class)
    assert (response.success, response.errors, response.ios) == (True, [], [])
    assert made._request_class().ios == []


def _serialised(filled: Any) -> bytes:
    buffer = BytesIO()
    filled.serialize(buffer)
    return buffer.getvalue()


def _as_float32(definition: Definition, content: dict[str, Any]) -> Any:
    def value(field: Field, told: Any) -> Any:
        if field.is_list:
            one = field._replace(is_list=False)
            return [value(one, each) for each in told]
        if field.type == "float32":
            return np.float32(told)
        return told if field.type in VALUES else _as_float32(message(field.type), told)

    return {field.name: value(field, content[field.name]) for field in definition.fields}

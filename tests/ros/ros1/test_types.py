"""Messages of ROS 1: what we serialise is what others read, and what others serialise is what we read."""

from __future__ import annotations

from importlib import import_module
from io import BytesIO
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.ros.rmi.definitions import message, service
from tests.ros1_tools import needs_ros, see_system_packages
from tests.ros_messages import MESSAGES, Rosbags, contents
from tests.samples import some

if TYPE_CHECKING:
    from iiwa_sim.ros.ros1.types import Types

SERVICE = "robot_movement_interface/GetDigitalIOs"


@pytest.fixture(scope="module")
def module() -> Any:
    """What needs genpy."""
    needs_ros()
    see_system_packages()
    return import_module("iiwa_sim.ros.ros1.types")


@pytest.fixture(scope="module")
def types(module: Any) -> Types:
    made: Types = module.Types(map(message, MESSAGES), [SERVICE])
    return made


@pytest.fixture(scope="module")
def rosbags() -> Rosbags:
    return Rosbags()


@pytest.mark.requirement("FRA002")
@pytest.mark.parametrize("name", MESSAGES)
@settings(max_examples=some(20))
@given(data=st.data())
def test_rosbags_reads_what_we_serialise(
    types: Types, rosbags: Rosbags, name: str, data: st.DataObject
) -> None:
    content = data.draw(contents(message(name)))
    assert rosbags.reads(name, _serialised(types.filled(message(name), content))) == content


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

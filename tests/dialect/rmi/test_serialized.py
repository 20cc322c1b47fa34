"""The bytes of ROS 1 that we write without ROS."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.dialect.rmi.definitions import message
from iiwa_sim.dialect.rmi.serialized import serialized
from tests.ros_messages import MESSAGES, Rosbags, contents


@pytest.fixture(scope="module")
def rosbags() -> Rosbags:
    return Rosbags()


@pytest.mark.parametrize("name", MESSAGES)
@settings(max_examples=20)
@given(data=st.data())
def test_rosbags_reads_what_we_write(rosbags: Rosbags, name: str, data: st.DataObject) -> None:
    content = data.draw(contents(message(name)))
    assert rosbags.reads(name, serialized(message(name), content)) == content

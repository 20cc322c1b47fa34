"""Numbers of told states: as the rest of the package finds them."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.numbers_kernel import Numbers
from iiwa_sim.frames import Frame, compose, inverse, transform_from_euler
from iiwa_sim.robot.description import load_robot
from iiwa_sim.robot.model import Model

MODEL = Model(load_robot("lbr_iiwa_7_r800"))
ANGLE = st.one_of(st.floats(-pi, pi), st.sampled_from([0.0, -0.0, 0.5 * pi, -0.5 * pi, pi, -pi]))
JOINTS = st.lists(ANGLE, min_size=7, max_size=7)
TURN = st.tuples(ANGLE, ANGLE, ANGLE)


@given(joints=JOINTS, turn=TURN)
def test_flange_and_tcp_are_those_of_the_model(joints: Sequence[float], turn: Sequence[float]) -> None:
    flange = MODEL.flange(joints)
    wanted = transform_from_euler(0.1, -4.0, 0.3, *turn)  # of any turn, such as those with a gimbal lock
    tool = compose(inverse(flange), wanted)
    found = Numbers(MODEL.tcp_of_flange, True).frames(joints, tool)
    for row, pose in zip(found, (flange, wanted), strict=True):
        there = Frame(*row).to_transform()
        assert np.allclose(there.rotation, pose.rotation, atol=3e-7)
        assert np.allclose(there.translation, pose.translation, atol=1e-7)
        for value, step in zip(row, [1e4] * 3 + [1e7] * 3, strict=True):
            assert value * step == pytest.approx(round(value * step), abs=1e-3)


def test_another_tool_is_noticed() -> None:
    numbers = Numbers(MODEL.tcp_of_flange, True)
    joints = [0.1] * 7
    for length in (0.1, 0.2):
        tool = transform_from_euler(0.0, 0.0, length, 0.0, 0.0, 0.0)
        _, tcp = numbers.frames(joints, tool)
        assert tcp[:3] == pytest.approx(
            Frame.from_transform(compose(MODEL.flange(joints), tool))[:3], abs=1e-4
        )


@given(joints=JOINTS, before=JOINTS)
def test_velocities_are_differences(joints: Sequence[float], before: Sequence[float]) -> None:
    found = Numbers(MODEL.tcp_of_flange, True).velocities(joints, before, 0.002)
    assert found == pytest.approx((np.array(joints) - before) / 0.002, abs=0.51e-7, rel=1e-12)


@given(joints=JOINTS, turn=TURN)
def test_in_full_they_are_what_the_commands_tell_bit_for_bit(
    joints: Sequence[float], turn: Sequence[float]
) -> None:
    flange = MODEL.flange(joints)
    for tool in (transform_from_euler(0.1, -4.0, 0.3, *turn), inverse(flange)):
        told = [Frame.from_transform(flange), Frame.from_transform(compose(flange, tool))]
        numbers = Numbers(MODEL.tcp_of_flange, False)
        assert [struct.pack("6d", *frame) for frame in numbers.frames(joints, tool)] == [
            struct.pack("6d", *frame) for frame in told
        ]
        assert numbers.tcp(joints, tool) == list(told[1])
        assert numbers.velocities(joints, turn * 3, 0.002) == [
            (now - then) / 0.002 for now, then in zip(joints, turn * 3, strict=False)
        ]
        assert numbers.forces(turn) is turn

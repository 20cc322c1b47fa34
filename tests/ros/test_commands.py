"""Command messages: units and rejected fields. Moves themselves are in test_appendix_a.py."""

from __future__ import annotations

from math import dist, inf, nan
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.controller.requests import Kind, MoveRequest
from iiwa_sim.frames import Frame, compose, transform_from_euler
from iiwa_sim.ros.commands import read_command
from iiwa_sim.ros.messages import checked
from tests.ros_robot import RosRobot

ROBOT = RosRobot().controller
JOINTS = [0.1, 0.2, 0.3, -0.4, 0.5, 0.6, 0.7]
EULER = [0.4, 0.1, 0.5, 0.2, 3.0, -0.1]
BASE: dict[str, Any] = {
    "command_type": "LIN",
    "pose_type": "EULER_INTRINSIC_ZYX",
    "pose": EULER,
    "velocity_type": "%",
    "velocity": [0.5],
}
ON_JOINTS = {"command_type": "PTP", "pose_type": "JOINTS", "pose": JOINTS}
FORCES = {"effort_type": "N", "effort": [5.0, 6.0, 7.0]}
WAY_MM = dist(ROBOT.tool_frame()[:3], (400.0, 100.0, 500.0))
LARGEST_RAD = max(abs(a - b) for a, b in zip(ROBOT.joints, JOINTS, strict=True))
LIMITS = ROBOT.description.acceleration
NAMES = ("x", "y", "z", "alpha", "beta", "gamma")
numbers = st.floats(-3.0, 3.0)


def read(*, apply_reference: bool = True, **fields: Any) -> MoveRequest:
    message = checked({**BASE, **fields}, "robot_movement_interface/msg/Command")
    return read_command(message, ROBOT, apply_reference=apply_reference)


def refusal(**fields: Any) -> str:
    with pytest.raises(Refused) as refused:
        read(**fields)
    assert refused.value.code == EXECUTION
    return refused.value.reason


@pytest.mark.requirement("FRC004", "FRC005", "FRC008", "FRC009", "FRC010", "FRC011")
@pytest.mark.parametrize("kind", ["LIN", "PTP", "SMART", "DIRECT"])
def test_frames_are_in_m_and_rad_and_joints_in_rad(kind: str) -> None:
    move = read(command_type=kind)
    assert (move.kind.value, move.speed) == (kind, 0.5)
    assert move.target == pytest.approx(Frame(400.0, 100.0, 500.0, 0.2, 3.0, -0.1))
    assert tuple(read(**{**ON_JOINTS, "command_type": kind}).target) == tuple(JOINTS)


@pytest.mark.requirement("FRC005")
def test_a_quaternion_is_x_y_z_w() -> None:
    target = read(pose_type="QUATERNION", pose=[0.4, 0.1, 0.5, 0.0, 1.0, 0.0, 0.0]).target
    assert isinstance(target, Frame)
    turned = Frame(400.0, 100.0, 500.0, 0.0, 3.14159265, 0.0).to_transform()
    assert target.to_transform().rotation == pytest.approx(turned.rotation, abs=1e-8)


@given(st.tuples(*[numbers] * 6), st.tuples(*[numbers] * 6), st.sampled_from(["", "table", "world"]))
def test_a_pose_in_a_reference_frame(frame: tuple[float, ...], pose: tuple[float, ...], name: str) -> None:
    frame = (1.0 + abs(frame[0]), *frame[1:])
    reference = dict(zip(NAMES, frame, strict=True))
    fields = {"pose": list(pose), "pose_reference": name, "pose_reference_frame": reference}
    move = read(**fields)
    assert isinstance(move.target, Frame)
    expected = compose(transform_from_euler(*frame), transform_from_euler(*pose))
    assert move.target.to_transform().translation == pytest.approx(expected.translation, abs=1e-9)
    assert move.target.to_transform().rotation == pytest.approx(expected.rotation, abs=1e-9)
    assert read(apply_reference=False, **fields) == read(pose=list(pose))


@pytest.mark.requirement("FRC012", "FRC015")
@pytest.mark.parametrize(
    ("fields", "read_as"),
    [
        ({"velocity_type": "PERCENT", "velocity": [50]}, {"speed": 0.5}),
        ({"velocity_type": "M/S", "velocity": [2]}, {"tcp_speed_m_s": 2.0}),
        ({**ON_JOINTS, "velocity": [0.25] * 7}, {"speeds": (0.25,) * 7}),
        ({**ON_JOINTS, "velocity": [0.5] + [0.0] * 6}, {"speeds": (0.5, *[0.0] * 6)}),
        ({**ON_JOINTS, "velocity_type": "RAD/S", "velocity": [0.0]}, {"speeds": (0.0,) * 7}),
        ({}, {"blending": 0.0}),
        ({"blending_type": "M", "blending": [0.02]}, {"blending": 20.0}),
        ({"blending_type": "?", "blending": [0.0]}, {"blending": 0.0}),
        ({"blending_type": "%", "blending": [0.2]}, {"blending": pytest.approx(0.2 * WAY_MM)}),
        ({"blending_type": "PERCENT", "blending": [20.0]}, {"blending": pytest.approx(0.2 * WAY_MM)}),
        (
            {**ON_JOINTS, "blending_type": "RAD", "blending": [0.2]},
            {"blending": pytest.approx(0.2 / LARGEST_RAD)},
        ),
        ({**ON_JOINTS, "blending_type": "%", "blending": [0.2]}, {"blending": 0.2}),
        ({"command_type": "LINFORCE", **FORCES}, {"kind": Kind.LIN, "thresholds": (5.0, 6.0, 7.0)}),
        ({"command_type": "PTPFORCE", **FORCES}, {"kind": Kind.PTP, "thresholds": (5.0, 6.0, 7.0)}),
        ({"acceleration_type": "%", "acceleration": [1.0]}, {"accelerations": (1.0,)}),
        (
            {"acceleration_type": "PERCENT", "acceleration": [50]},
            {"accelerations": (0.5,)},
        ),
        (
            {**ON_JOINTS, "acceleration_type": "RAD/S^2", "acceleration": [0.25] * 7},
            {"accelerations": pytest.approx([0.25 / limit for limit in LIMITS])},
        ),
        (
            {"acceleration_type": "M/S^2", "acceleration": [0.5]},
            {"tcp_acceleration_m_s2": 0.5},
        ),
    ],
)
def test_speeds_blending_forces_and_accelerations(fields: dict[str, Any], read_as: dict[str, Any]) -> None:
    move = read(**fields)
    assert {name: getattr(move, name) for name in read_as} == read_as


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"command_type": "CIRC"}, "command_type 'CIRC': expected one of LIN, PTP, SMART, DIRECT, LINFORCE"),
        ({"pose_type": "EULER_ZYZ"}, "pose_type 'EULER_ZYZ'"),
        ({"pose": EULER[:5]}, "5 values, expected 6"),
        ({"velocity": []}, "0 values, expected 1"),
        ({"velocity": [50.0]}, "above 0, up to 1"),
        ({"velocity_type": "MM/S"}, "velocity_type 'MM/S'"),
        ({"velocity_type": "RAD/S"}, "expected one of %, PERCENT, M/S"),
        ({**ON_JOINTS, "velocity_type": "M/S"}, "expected one of %, PERCENT, RAD/S"),
        ({**ON_JOINTS, "velocity_type": "RAD/S", "velocity": [4.0] * 7}, "4 in RAD/S: expected 0 or more"),
        ({"blending_type": "RAD", "blending": [0.1]}, "expected one of M, %, PERCENT"),
        ({**ON_JOINTS, "blending_type": "M", "blending": [0.1]}, "expected one of RAD, %, PERCENT"),
        ({"blending_type": "%", "blending": [1.1]}, "up to 1"),
        ({"command_type": "SMART", "blending_type": "M", "blending": [0.1]}, "do not blend"),
        ({"acceleration_type": "PERCENT", "acceleration": [0.0]}, "above 0, up to 100"),
        ({**ON_JOINTS, "acceleration_type": "M/S^2", "acceleration": [1.0]}, "%, PERCENT, RAD/S^2"),
        ({"effort": [1.0]}, "effort: 1 values, expected 0"),
        ({"command_type": "LINFORCE"}, "effort: 0 values, expected 3"),
        ({"command_type": "LINFORCE", **FORCES, "effort_type": "NM"}, "effort_type 'NM'"),
        ({"command_type": "PTPFORCE", **FORCES, "effort": [5.0, 0.0, 5.0]}, "above 0"),
        ({**ON_JOINTS, "command_type": "PTPFORCE", **FORCES}, "pose_type"),
        ({"additional_values": [1.0]}, "additional_parameters"),
        ({"pose": [nan] * 6}, "pose: expected finite numbers"),
        ({"velocity": [inf]}, "velocity: expected finite numbers"),
    ],
)
def test_unsupported_commands_are_rejected_with_a_reason(fields: dict[str, Any], words: str) -> None:
    reason = refusal(**fields)
    assert words in reason
    assert "up to inf" not in reason

"""Command messages read: units, and what is refused."""

from __future__ import annotations

from math import inf, nan
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.acceleration import AccelerationCap, AccelerationUnit
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.frames import Frame, compose, transform_from_euler
from iiwa_sim.ros.rmi.commands import read_command
from iiwa_sim.ros.rmi.definitions import message, type_of
from iiwa_sim.ros.rmi.robot import BlendingUnit, Kind, Move, SpeedUnit

COMMAND = type_of(message("robot_movement_interface/Command"))
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
THRESHOLDS = {"effort_type": "N", "effort": [5.0, 6.0, 7.0]}

numbers = st.floats(-3.0, 3.0)


def read(**fields: Any) -> Move:
    return read_command(msgspec.convert({**BASE, **fields}, COMMAND), 7)


def refusal(**fields: Any) -> str:
    with pytest.raises(Refused) as refused:
        read(**fields)
    assert refused.value.code == EXECUTION
    return refused.value.reason


@pytest.mark.requirement("FRC005", "FRC008", "FRC009")
@pytest.mark.parametrize("kind", ["LIN", "PTP", "SMART", "DIRECT"])
def test_a_frame_is_in_m_and_rad(kind: str) -> None:
    move = read(command_type=kind)
    assert move.kind.value == kind
    assert move.target == pytest.approx(Frame(400.0, 100.0, 500.0, 0.2, 3.0, -0.1))
    assert (move.speeds, move.speed_unit) == ((0.5,), SpeedUnit.RELATIVE)


@pytest.mark.requirement("FRC004", "FRC010")
@pytest.mark.parametrize("kind", ["PTP", "SMART", "DIRECT", "LIN"])
def test_joint_positions(kind: str) -> None:
    move = read(**{**ON_JOINTS, "command_type": kind})
    assert not isinstance(move.target, Frame)
    assert move.target == tuple(JOINTS)


@pytest.mark.requirement("FRC005")
def test_a_quaternion_is_x_y_z_w() -> None:
    move = read(pose_type="QUATERNION", pose=[0.4, 0.1, 0.5, 0.0, 1.0, 0.0, 0.0])
    turned = Frame(400.0, 100.0, 500.0, 0.0, 3.14159265, 0.0)
    assert isinstance(move.target, Frame)
    assert move.target.to_transform().rotation == pytest.approx(turned.to_transform().rotation, abs=1e-8)


@given(st.tuples(*[numbers] * 6), st.tuples(*[numbers] * 6), st.sampled_from(["", "table", "world"]))
def test_a_pose_in_a_reference_frame(
    reference: tuple[float, ...], pose: tuple[float, ...], name: str
) -> None:
    names = ("x", "y", "z", "alpha", "beta", "gamma")
    move = read(
        pose=list(pose),
        pose_reference=name,
        pose_reference_frame={**dict(zip(names, reference, strict=True)), "x": 1.0 + abs(reference[0])},
    )
    assert isinstance(move.target, Frame)
    outer = transform_from_euler(1.0 + abs(reference[0]), *reference[1:])
    expected = compose(outer, transform_from_euler(*pose))
    assert move.target.to_transform().translation == pytest.approx(expected.translation, abs=1e-9)
    assert move.target.to_transform().rotation == pytest.approx(expected.rotation, abs=1e-9)


@pytest.mark.parametrize("name", ["", "world"])
def test_a_reference_frame_of_zeros_is_the_base(name: str) -> None:
    assert read(pose_reference=name) == read()


@pytest.mark.parametrize("name", ["base", "/base_link"])
def test_a_pose_that_is_in_the_base_by_name_is_not_moved_again(name: str) -> None:
    assert read(pose_reference=name, pose_reference_frame={"x": 1.0, "gamma": 2.0}) == read()


def test_what_became_of_a_named_frame_is_said_in_the_result() -> None:
    fields = {"pose_reference": "world", "pose_reference_frame": {"x": 1.0}}
    assert read(**fields).note == "pose_reference 'world' was applied"
    ignored = read_command(msgspec.convert({**BASE, **fields}, COMMAND), 7, apply_reference=False)
    assert ignored.target == read().target
    assert ignored.note == "pose_reference 'world' was taken as applied already"


@pytest.mark.parametrize(
    ("fields", "speeds", "unit"),
    [
        ({"velocity_type": "PERCENT", "velocity": [50]}, (0.5,), SpeedUnit.RELATIVE),
        ({"velocity_type": "M/S", "velocity": [2]}, (2.0,), SpeedUnit.M_S),
        ({**ON_JOINTS, "velocity": [0.25] * 7}, (0.25,) * 7, SpeedUnit.RELATIVE),
        ({**ON_JOINTS, "velocity_type": "RAD/S", "velocity": [1.5]}, (1.5,), SpeedUnit.RAD_S),
        ({**ON_JOINTS, "velocity": [0.5] + [0.0] * 6}, (0.5, *[0.0] * 6), SpeedUnit.RELATIVE),
        ({**ON_JOINTS, "velocity_type": "RAD/S", "velocity": [0.0] * 7}, (0.0,) * 7, SpeedUnit.RAD_S),
    ],
)
def test_speeds(fields: dict[str, Any], speeds: tuple[float, ...], unit: SpeedUnit) -> None:
    move = read(**fields)
    assert (move.speeds, move.speed_unit) == (speeds, unit)


@pytest.mark.requirement("FRC012", "FRC015")
@pytest.mark.parametrize(
    ("fields", "blending", "unit"),
    [
        ({}, 0.0, BlendingUnit.MM),
        ({"blending_type": "M", "blending": [0.02]}, 20.0, BlendingUnit.MM),
        ({"blending_type": "?", "blending": [0.0]}, 0.0, BlendingUnit.MM),
        ({"blending_type": "%", "blending": [0.2]}, 0.2, BlendingUnit.RELATIVE),
        ({"blending_type": "PERCENT", "blending": [20.0]}, 0.2, BlendingUnit.RELATIVE),
        ({**ON_JOINTS, "blending_type": "RAD", "blending": [0.2]}, 0.2, BlendingUnit.RAD),
        ({**ON_JOINTS, "blending_type": "%", "blending": [0.2]}, 0.2, BlendingUnit.RELATIVE),
    ],
)
def test_blending(fields: dict[str, Any], blending: float, unit: BlendingUnit) -> None:
    move = read(**fields)
    assert (move.blending, move.blending_unit) == (pytest.approx(blending), unit)


@pytest.mark.parametrize(("kind", "plain"), [("LINFORCE", Kind.LIN), ("PTPFORCE", Kind.PTP)])
def test_force_moves_have_three_thresholds(kind: str, plain: Kind) -> None:
    move = read(command_type=kind, **THRESHOLDS)
    assert (move.kind, move.thresholds_n) == (plain, (5.0, 6.0, 7.0))
    assert "got 0" in refusal(command_type=kind)
    assert "effort_type 'NM'" in refusal(command_type=kind, **{**THRESHOLDS, "effort_type": "NM"})
    assert "above 0" in refusal(command_type=kind, effort_type="N", effort=[5.0, 0.0, 5.0])
    assert "pose_type" in refusal(command_type=kind, pose_type="JOINTS", pose=JOINTS, **THRESHOLDS)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"command_type": "CIRC"}, "command_type 'CIRC': expected one of LIN, PTP, SMART, DIRECT, LINFORCE"),
        ({"pose_type": "EULER_ZYZ"}, "pose_type 'EULER_ZYZ'"),
        ({"pose": EULER[:5]}, "expected 6 values"),
        ({"velocity": []}, "expected 1 value, got 0"),
        ({"velocity": [50.0]}, "above 0 and up to 1"),
        ({"velocity_type": "MM/S"}, "velocity_type 'MM/S'"),
        ({"velocity_type": "RAD/S"}, "RAD/S: only for"),
        ({**ON_JOINTS, "velocity_type": "M/S"}, "M/S: only for LIN"),
        ({"blending_type": "RAD", "blending": [0.1]}, "RAD: only for PTP"),
        ({**ON_JOINTS, "blending_type": "M", "blending": [0.1]}, "expected RAD, % or PERCENT"),
        ({"blending_type": "%", "blending": [1.1]}, "up to 1"),
        ({"command_type": "SMART", "blending_type": "M", "blending": [0.1]}, "do not blend"),
        ({"acceleration_type": "PERCENT", "acceleration": [0.0]}, "above 0 and up to 100"),
        ({**ON_JOINTS, "acceleration_type": "M/S^2", "acceleration": [1.0]}, "M/S^2: only for LIN"),
        ({"effort": [1.0]}, "effort of LIN"),
        ({"additional_values": [1.0]}, "additional_parameters"),
    ],
)
def test_what_is_not_supported_is_refused_with_its_reason(fields: dict[str, Any], words: str) -> None:
    assert words in refusal(**fields)


@pytest.mark.parametrize("kind", ["%", "PERCENT"])
def test_full_acceleration_is_the_robots_own(kind: str) -> None:
    assert read(acceleration_type=kind, acceleration=[1.0 if kind == "%" else 100.0]) == read()


@pytest.mark.parametrize(
    ("fields", "values", "unit"),
    [
        ({"acceleration_type": "PERCENT", "acceleration": [50]}, (0.5,), AccelerationUnit.RELATIVE),
        ({"acceleration_type": "RAD/S^2", "acceleration": [1.0]}, (1.0,), AccelerationUnit.RAD_S2),
        ({"acceleration_type": "M/S^2", "acceleration": [0.5]}, (0.5,), AccelerationUnit.TCP_M_S2),
        (
            {**ON_JOINTS, "acceleration_type": "%", "acceleration": [0.25] * 7},
            (0.25,) * 7,
            AccelerationUnit.RELATIVE,
        ),
    ],
)
def test_accelerations(fields: dict[str, Any], values: tuple[float, ...], unit: AccelerationUnit) -> None:
    assert read(**fields).acceleration == AccelerationCap(values, unit)


@pytest.mark.parametrize("field", ["pose", "velocity", "acceleration", "blending", "effort"])
@pytest.mark.parametrize("number", [nan, inf])
def test_numbers_that_are_not_finite(field: str, number: float) -> None:
    assert "expected finite numbers" in refusal(**{field: [number] * len(BASE.get(field, [0]))})


def test_words_of_others_stay_on_one_short_line() -> None:
    reason = refusal(command_type="A\n\x1b[31m" + "B" * 1000)
    assert reason.isprintable()
    assert len(reason) < 200

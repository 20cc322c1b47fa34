"""The TCP's pose and Jacobian are Pinocchio's to rounding."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.frames import Transform, transform_from_euler
from iiwa_sim.robot.description import load_robot
from iiwa_sim.robot.model import Model
from tests.robot.arms import BUILT_IN

TOOL = transform_from_euler(0.01, -0.02, 0.15, 0.3, -0.8, 1.9)
MODELS = {name: Model(load_robot(name)) for name in BUILT_IN}
positions = st.lists(st.floats(-6.5, 6.5), min_size=7, max_size=7)


def by_pinocchio(model: Model, q: list[float]) -> tuple[Transform, np.ndarray]:
    reference = pin.buildModelFromXML(model.description.urdf)
    flange = reference.getFrameId(model.description.flange)
    tool = pin.SE3(np.array(TOOL.rotation).reshape(3, 3), np.array(TOOL.translation))
    on = reference.frames[flange]
    tcp = reference.addFrame(
        pin.Frame("TCP", on.parentJoint, flange, on.placement * tool, pin.FrameType.OP_FRAME)
    )
    data = reference.createData()
    jacobian = pin.computeFrameJacobian(
        reference, data, np.array(q), tcp, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    )
    pose = data.oMf[tcp]
    return Transform(tuple(pose.rotation.ravel()), tuple(pose.translation)), jacobian


@pytest.mark.parametrize("name", BUILT_IN)
@given(q=positions)
def test_pinocchio_finds_the_same(name: str, q: list[float]) -> None:
    model = MODELS[name]
    q = q[: model.joint_count]
    tcp = model.tcp(TOOL)
    pose, jacobian = by_pinocchio(model, q)
    assert tcp.pose(q).rotation == pytest.approx(pose.rotation, abs=2e-15)
    assert tcp.pose(q).translation == pytest.approx(pose.translation, abs=2e-15)
    assert np.abs(tcp.jacobian(q) - jacobian).max() <= 3e-15
    wrench = (1.0, -2.0, 3.0, 0.4, -0.5, 0.6)
    turn = np.array(pose.rotation).reshape(3, 3)
    torques = jacobian.T @ np.concatenate([turn @ wrench[:3], turn @ wrench[3:]])
    assert tcp.torques(q, wrench) == pytest.approx(torques.tolist(), abs=3e-14)


def test_joint_positions_of_another_number_are_an_error() -> None:
    with pytest.raises(ValueError, match="6 joint positions, expected 7"):
        MODELS["lbr_iiwa_7_r800"].tcp(TOOL).pose([0.0] * 6)


@pytest.mark.parametrize("name", BUILT_IN)
@given(q=positions)
def test_the_flange_is_where_it_brings_the_tcp(name: str, q: list[float]) -> None:
    model = MODELS[name]
    q = q[: model.joint_count]
    tcp = model.tcp(TOOL)
    flange = tcp.flange_at(tcp.pose(q))
    assert flange.rotation == pytest.approx(model.flange(q).rotation, abs=2e-15)
    assert flange.translation == pytest.approx(model.flange(q).translation, abs=2e-15)

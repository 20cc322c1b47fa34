"""The spring between mouse and arm: what it does to the robot is what a force at that point does."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.frames import Frame, apply, compose
from iiwa_sim.robot.description import load_robot
from iiwa_sim.robot.model import Model
from iiwa_sim.view.drawing import Drawing
from iiwa_sim.view.pushing import STRONGEST_N, joint_torques, spring_force, wrench_at_tcp

ROBOT = load_robot()
DRAWING = Drawing.of_urdf(ROBOT.urdf, ROBOT.joints, ROBOT.flange)
JOINTS = st.lists(st.floats(-2.0, 2.0), min_size=7, max_size=7)
VECTOR = st.tuples(*[st.floats(-1.0, 1.0)] * 3)


@given(JOINTS, VECTOR, VECTOR)
def test_a_force_at_the_flange_makes_the_same_torques_as_its_wrench_at_the_tcp(
    joints: Sequence[float], point: tuple[float, float, float], force: tuple[float, float, float]
) -> None:
    flange = Model(ROBOT).flange(joints)
    tcp = compose(flange, Frame(10, 20, 150, 0.3, 0.2, 0.1).to_transform())
    where = apply(flange, point)
    wrench = np.array(wrench_at_tcp(tcp, where, force))
    turned = np.array(tcp.rotation).reshape(3, 3)
    lever = np.array(flange.translation) - tcp.translation
    at_flange = np.concatenate(
        [turned @ wrench[:3], turned @ wrench[3:] - np.cross(lever, turned @ wrench[:3])]
    )
    torques = joint_torques(DRAWING, joints, DRAWING.flange, where, force)
    assert torques == pytest.approx(Model(ROBOT).jacobian(joints).T @ at_flange, abs=1e-9)


@given(JOINTS, VECTOR, VECTOR, st.integers(0, 6))
def test_joints_beyond_a_link_feel_nothing(
    joints: Sequence[float], point: tuple[float, float, float], force: tuple[float, float, float], joint: int
) -> None:
    (link,) = [place for place, each in enumerate(DRAWING.links) if each.joint == joint]
    torques = joint_torques(DRAWING, joints, link, point, force)
    assert torques[joint + 1 :] == [0.0] * (6 - joint)


@given(VECTOR, VECTOR, st.floats(50.0, 2000.0))
def test_the_spring_pulls_towards_its_end_and_not_too_hard(
    start: tuple[float, float, float], end: tuple[float, float, float], n_per_m: float
) -> None:
    force, way = np.array(spring_force(start, end, n_per_m)), np.subtract(end, start)
    assert np.linalg.norm(force) == pytest.approx(min(n_per_m * np.linalg.norm(way), STRONGEST_N))
    assert np.linalg.norm(np.cross(force, way)) <= 1e-9
    assert force @ way >= 0.0

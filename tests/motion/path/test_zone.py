"""Zones round targets: a path is inside as long as it is said to be, and no longer."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.frames import Transform, compose
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.path.line_kernel import LineJoints
from iiwa_sim.motion.path.piecewise_kernel import Polynomial
from iiwa_sim.motion.path.ptp import ptp
from iiwa_sim.motion.path.tcp_line_kernel import TcpLine
from iiwa_sim.motion.path.zone_kernel import HALF, Zone, joint_ball, sphere
from tests.robot.arms import BUILT_IN, Arm, arm_named

TOOL = Transform((1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), (0.05, 0.0, 0.2))
ARMS = st.sampled_from(BUILT_IN).map(arm_named)
SEEDS = st.integers(0, 2**32 - 1)


def anywhere(arm: Arm, seed: int, count: int) -> list[Joints]:
    return [tuple(q) for q in arm.anywhere(np.random.default_rng(seed), count).tolist()]


@given(arm=ARMS, seed=SEEDS)
def test_the_distance_of_a_sphere_is_that_of_the_tcp(arm: Arm, seed: int) -> None:
    target, *others = anywhere(arm, seed, 5)
    zone = sphere(0.1, target, arm.model.tcp(TOOL))
    there = compose(arm.model.flange(target), TOOL).translation
    for joints, distance in zip(others, map(zone.distance, others), strict=True):
        reached = compose(arm.model.flange(joints), TOOL).translation
        assert distance == pytest.approx(np.linalg.norm(np.subtract(reached, there)), abs=1e-14)


@given(arm=ARMS, seed=SEEDS, radius=st.floats(0.001, 0.5), at_end=st.booleans(), of_joints=st.booleans())
def test_a_ptp_is_inside_for_just_that_part(
    arm: Arm, seed: int, radius: float, at_end: bool, of_joints: bool
) -> None:
    target, other = anywhere(arm, seed, 2)
    path = ptp(other, target) if at_end else ptp(target, other)
    zone = joint_ball(radius, other, target) if of_joints else sphere(radius, target, arm.model.tcp(TOOL))
    part = zone.part_inside(path, at_end=at_end)
    assert_inside(zone, path, part, at_end)
    if part < HALF:
        s = 1.0 - part - 2e-9 if at_end else part + 2e-9
        assert zone.distance(path.joints(s)) > zone.radius


def assert_inside(zone: Zone, path: Polynomial, part: float, at_end: bool) -> None:
    assert 0.0 <= part <= HALF
    parts = np.linspace(0.0, part, 13)  # a path may leave a zone for a shorter way than is looked at
    s = 1.0 - parts if at_end else parts
    assert max(map(zone.distance, path.derivatives(s)[0].tolist())) <= zone.radius + 1e-12


@given(arm=ARMS, radius=st.floats(0.001, 0.3), at_end=st.booleans())
def test_a_line_is_inside_by_its_length(arm: Arm, radius: float, at_end: bool) -> None:
    home = arm.description.home
    start = arm.model.flange(home)
    x, y, z = start.translation
    goal = Transform(start.rotation, (x, y + 0.1, z - 0.1))
    line = TcpLine(start, goal, TOOL)
    path = LineJoints(arm.inverse, home, line, arm.inverse.redundancy(home)).path(arm.inverse.status(home))
    assert path is not None
    zone = sphere(radius, path.end if at_end else path.start, arm.model.tcp(TOOL))
    part = zone.part_inside(path, at_end=at_end)
    assert part == pytest.approx(min(radius / line.length_m, HALF))
    s = 1.0 - part if at_end else part
    assert zone.distance(path.joints(s)) == pytest.approx(min(radius, HALF * line.length_m), abs=1e-9)


@given(arm=ARMS, seed=SEEDS)
def test_a_zone_reaches_no_farther_than_half_of_either_path(arm: Arm, seed: int) -> None:
    start, corner, end = anywhere(arm, seed, 3)
    paths = ptp(start, corner), ptp(corner, end)
    zone = sphere(10.0, corner, arm.model.tcp(TOOL)).clipped(*paths)
    halves = zone.distance(paths[0].joints(1.0 - HALF)), zone.distance(paths[1].joints(HALF))
    assert zone.radius == pytest.approx(min(halves))
    assert sphere(0.001, corner, arm.model.tcp(TOOL)).clipped(*paths).radius == 0.001

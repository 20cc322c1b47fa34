"""Whole turns: which of the positions that give the same pose a joint takes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.robot import arm_kernel
from iiwa_sim.robot.arm_kernel import continued
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.nearest import JOINT_LIMIT, ROBOT_CONFIGURATION, Nearest, Unreachable
from tests.robot.arms import IIWAS, SIX_AXES, arm_named, distance

ARM = arm_named(SIX_AXES)
LOW, HIGH = ARM.description.position_min, ARM.description.position_max
ROUNDING = 1e-10


positions = st.tuples(*[st.floats(low, high) for low, high in zip(LOW, HIGH, strict=True)])
angles = st.tuples(*[st.floats(-math.pi, math.pi)] * 6)


def turned(
    joints: Sequence[float], present: Sequence[float], d: RobotDescription
) -> tuple[list[float], bool]:
    """The joint positions in the turns that are taken, and whether they are within the limits."""
    rows, within = np.array([joints, [math.nan] * len(joints)]), np.empty(2, dtype=np.uint8)
    limits = np.array(d.position_min), np.array(d.position_max)
    arm_kernel.turn_rows(rows, np.array(present), *limits, within)
    assert np.isnan(rows[1]).all()
    assert not within[1]
    row = np.array([joints])
    arm_kernel.turn(row, 0, np.array(present), *limits)
    assert (row[0] == rows[0]).all()
    assert arm_kernel.clip(row, 0, *limits) == within[0]
    return rows[0].tolist(), bool(within[0])


@given(angles, positions)
def test_each_joint_is_as_near_as_its_limits_allow(
    joints: tuple[float, ...], present: tuple[float, ...]
) -> None:
    there_all, inside = turned(joints, present, ARM.description)
    all_within = True
    for q, there, here, low, high in zip(joints, there_all, present, LOW, HIGH, strict=True):
        within = [p for p in (q + math.tau * turns for turns in (-2, -1, 0, 1, 2)) if low <= p <= high]
        if within:
            assert low - ROUNDING <= there <= high + ROUNDING
            assert abs(there - here) == pytest.approx(min(abs(p - here) for p in within), abs=1e-9)
        else:
            all_within = False
            assert there == pytest.approx(q) or not low <= there <= high
    if all_within:
        assert inside


@given(st.lists(st.floats(-math.pi, math.pi), min_size=7, max_size=7))
def test_an_iiwa_has_no_turns_to_choose_from(joints: list[float]) -> None:
    for name in IIWAS:
        d = arm_named(name).description
        there, inside = turned(joints, d.home, d)
        assert there == joints
        assert inside == arm_named(name).within_limits(joints)


@given(angles, positions)
def test_continued_positions_are_within_half_a_turn(
    joints: tuple[float, ...], before: tuple[float, ...]
) -> None:
    found = continued(joints, before)
    for q, there, here in zip(joints, found, before, strict=True):
        assert abs(there - here) <= math.pi + 1e-12
        assert math.remainder(there - q, math.tau) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.requirement("FRC005", "FRC006")
def test_a_target_is_found_wherever_the_joints_are() -> None:
    """A2, A4 and A6 may be beyond half a turn."""
    rule, rng, inverse = Nearest(ARM.inverse, ARM.description), np.random.default_rng(40), ARM.inverse
    beyond = 0
    for present, there in zip(ARM.anywhere(rng, 400).tolist(), ARM.anywhere(rng, 400).tolist(), strict=True):
        flange = ARM.model.flange(there)
        found = rule.find(flange, present)
        assert ARM.within_limits(found.joints)
        assert distance([ARM.model.flange(found.joints)], [flange]) <= 1e-9
        assert found.status == inverse.status(found.joints)
        assert found.changed == (found.status != inverse.status(present))
        beyond += max(map(abs, found.joints)) > math.pi
    assert beyond > 40


@pytest.mark.requirement("FRC005", "FRC006")
def test_where_the_robot_is_it_stays() -> None:
    rule = Nearest(ARM.inverse, ARM.description)
    for present in ARM.anywhere(np.random.default_rng(41), 100).tolist():
        found = rule.find(ARM.model.flange(present), present, keep_status=True)
        assert found.joints == pytest.approx(present, abs=1e-6)
        assert not found.changed


def test_a2_beyond_half_a_turn_is_reached_and_kept_to_its_limit() -> None:
    rule = Nearest(ARM.inverse, ARM.description)
    overhead = [math.radians(value) for value in (20, -188, 60, 10, 50, 200)]
    assert rule.find(ARM.model.flange(overhead), overhead).joints == pytest.approx(overhead)
    too_far = [math.radians(value) for value in (20, -195, 20, 10, 50, 200)]
    with pytest.raises(Unreachable) as refusal:
        rule.find(ARM.model.flange(too_far), overhead, keep_status=True)
    assert refusal.value.code in {JOINT_LIMIT, ROBOT_CONFIGURATION}

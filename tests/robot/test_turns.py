"""Whole turns: which of the positions that give the same pose a joint takes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from iiwa_sim.robot.nearest import JOINT_LIMIT, ROBOT_CONFIGURATION, Nearest, Unreachable
from tests.robot.arms import SIX_AXES, arm_named, distance

ARM = arm_named(SIX_AXES)
LOW, HIGH = ARM.description.position_min, ARM.description.position_max
ROUNDING = 1e-10


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

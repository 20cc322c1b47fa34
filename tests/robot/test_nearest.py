"""The rule for targets that leave redundancy and branch open."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from iiwa_sim.frames import IDENTITY, Frame, Transform
from iiwa_sim.robot import nearest
from iiwa_sim.robot.nearest import JOINT_LIMIT, OUT_OF_REACH, ROBOT_CONFIGURATION, Nearest, Unreachable
from tests.robot.arms import BUILT_IN, IIWAS, SIX_AXES, Arm, arm_named, branches_of, distance


@pytest.fixture
def arm() -> Arm:
    """An arm with a redundancy."""
    return arm_named(IIWAS[0])


def rule(arm: Arm) -> Nearest:
    return Nearest(arm.inverse, arm.description)


def assert_good(arm: Arm, found: nearest.Solution, flange: Transform) -> None:
    assert arm.within_limits(found.joints)
    assert distance([arm.model.flange(found.joints)], [flange]) <= 1e-9
    assert found.status in arm.inverse.merging_statuses(found.joints)


def serves(arm: Arm, flange: Transform, redundancy: float, status: int, seed: list[float]) -> bool:
    joints = arm.inverse.joints(flange, redundancy, status, seed)
    return joints is not None and arm.within_limits(joints)


def pairs(arm: Arm, seed: int, count: int) -> list[tuple[list[float], list[float]]]:
    """Return present joints, and joints whose flange is the target."""
    rng = np.random.default_rng(seed)
    return list(zip(arm.anywhere(rng, count).tolist(), arm.anywhere(rng, count).tolist(), strict=True))


@pytest.mark.requirement("FRC005", "FRC006")
def test_redundancy_and_status_are_kept_if_the_target_is_then_in_reach(arm: Arm) -> None:
    kept = 0
    for present, there in pairs(arm, 30, 100):
        flange = arm.model.flange(there)
        status = arm.inverse.status(present)
        found = rule(arm).find(flange, present)
        assert_good(arm, found, flange)
        can_keep = serves(arm, flange, present[2], status, present)
        assert found.changed == (not can_keep)
        if can_keep:
            kept += 1
            assert (found.joints[2], found.status) == (present[2], status)
    assert 12 < kept < 88


@pytest.mark.requirement("FRC006")
def test_otherwise_the_nearest_redundancy_on_the_same_branch(arm: Arm) -> None:
    searched = 0
    for present, there in pairs(arm, 31, 30):
        flange = arm.model.flange(there)
        found = rule(arm).find(flange, present)
        status = arm.inverse.status(present)
        if not found.changed or found.status != status:
            continue
        searched += 1
        off = abs(found.joints[2] - present[2])
        # a degree nearer on the side taken it no longer serves
        nearer = present[2] + math.copysign(off - math.radians(1.0), found.joints[2] - present[2])
        assert off < math.radians(1.0) or not serves(arm, flange, nearer, status, present)
    assert searched > 5


@pytest.mark.requirement("FRC006")
def test_otherwise_another_branch_unless_the_status_is_to_be_kept(arm: Arm) -> None:
    elsewhere = 0
    for present, there in pairs(arm, 45, 120):
        flange = arm.model.flange(there)
        found = rule(arm).find(flange, present)
        if found.status in arm.inverse.merging_statuses(present):
            continue
        elsewhere += 1
        assert_good(arm, found, flange)
        assert found.changed
        with pytest.raises(Unreachable) as refusal:
            rule(arm).find(flange, present, keep_status=True)
        assert refusal.value.code == ROBOT_CONFIGURATION
        assert str(refusal.value) == refusal.value.reason
    assert elsewhere > 1


@pytest.mark.requirement("FRC005")
def test_a_given_redundancy_is_used_exactly(arm: Arm) -> None:
    kept = changed = 0
    for present, there in pairs(arm, 34, 60):
        flange = arm.model.flange(there)
        found = rule(arm).find(flange, present, redundancy=there[2])
        assert_good(arm, found, flange)
        assert found.joints[2] == there[2]
        status = arm.inverse.status(present)
        if serves(arm, flange, there[2], status, present):
            kept += 1
            assert (found.status, found.changed) == (status, False)
            continue
        changed += 1
        assert found.changed
        others = [q for _, q in branches_of(arm, flange, there[2], present).items() if arm.within_limits(q)]
        nearest = min(math.dist(q, present) for q in others)
        assert math.dist(found.joints, present) == pytest.approx(nearest, abs=1e-9)
    assert kept > 4
    assert changed > 4


def test_where_branches_meet_the_nearest_of_them_is_the_present_one(arm: Arm) -> None:
    transport = [0.0, math.radians(25), 0.0, math.radians(90), 0.0, 0.0, 0.0]
    for a6 in (0.4, -0.4, 1e-9, 0.0):
        there = [*transport[:5], a6, 0.0]
        flange = arm.model.flange(there)
        found = rule(arm).find(flange, transport, keep_status=True)
        assert found.joints == pytest.approx(there, abs=1e-8)
        assert not found.changed
    upright = [0.0] * 7
    assert rule(arm).find(arm.model.flange(upright), upright).joints == pytest.approx(upright, abs=1e-9)


def test_a_joint_on_its_limit_stays_there_despite_rounding(arm: Arm) -> None:
    d = arm.description
    for sign, limit in ((1, d.position_max), (-1, d.position_min)):
        present = [value if joint in (0, 1, 4, 6) else sign * 0.5 for joint, value in enumerate(limit)]
        found = rule(arm).find(arm.model.flange(present), present)
        assert found.joints == pytest.approx(present, abs=1e-9)
        assert not found.changed
        assert arm.within_limits(found.joints)
    own = [[0, 20, 0, -60, 170, 90, 0], [0, 20, 0, 0, 0, 60, 0], [25, 20, 0, -90, 0, 0, 0]]
    pairs_deg = [*zip(own, own, strict=True), ([9, 9, 0, -80, 0, 9, 9], [0, 20, 0, -60, 0, 0, 20])]
    for start, there in np.radians(pairs_deg).tolist():
        reply = Frame(*(round(each, 9) for each in Frame.from_transform(arm.model.flange(there))))
        found = rule(arm).find(reply.to_transform(), start)
        assert found.joints == pytest.approx(there, abs=1e-4), "the decimals of a reply are rounding, too"


def refusal(
    arm: Arm, flange: Transform, present: list[float], redundancy: float | None = None
) -> tuple[int, str]:
    with pytest.raises(Unreachable) as refused:
        rule(arm).find(flange, present, redundancy)
    assert "\n" not in refused.value.reason
    return refused.value.code, refused.value.reason


def test_a_joint_limit_names_the_joint(arm: Arm) -> None:
    """The one on the present branch, where A4 is negative."""
    folded = [0.2, 0.3, 0.0, math.radians(130), 0.1, 0.8, 0.0]
    code, reason = refusal(arm, arm.model.flange(folded), list(arm.description.home))
    assert code == JOINT_LIMIT
    assert reason == "A4 would have to be at -2.268928 rad, its limits are -2.094395 and 2.094395 rad"


@pytest.mark.requirement("FRC005", "FRC006")
def test_six_axes_find_a_target_wherever_the_joints_are() -> None:
    """A2, A4 and A6 may be beyond half a turn."""
    six = arm_named(SIX_AXES)
    rng, beyond = np.random.default_rng(40), 0
    for present, there in zip(six.anywhere(rng, 200).tolist(), six.anywhere(rng, 200).tolist(), strict=True):
        flange = six.model.flange(there)
        found = rule(six).find(flange, present)
        assert_good(six, found, flange)
        assert found.changed == (found.status != six.inverse.status(present))
        beyond += max(map(abs, found.joints)) > math.pi
    assert beyond > 20
    overhead = [math.radians(value) for value in (20, -188, 60, 10, 50, 200)]
    assert rule(six).find(six.model.flange(overhead), overhead).joints == pytest.approx(overhead)
    too_far = [math.radians(value) for value in (20, -195, 20, 10, 50, 200)]
    with pytest.raises(Unreachable) as refused:
        rule(six).find(six.model.flange(too_far), overhead, keep_status=True)
    assert refused.value.code in {JOINT_LIMIT, ROBOT_CONFIGURATION}


@pytest.mark.parametrize("name", BUILT_IN)
def test_a_target_out_of_reach_says_how_far(name: str) -> None:
    far = Transform(IDENTITY.rotation, (1.0, 0.9, 0.3))
    code, reason = refusal(arm_named(name), far, list(arm_named(name).description.home))
    assert code == OUT_OF_REACH
    assert re.search(r"1000\.0 900\.0 300\.0 mm.*farther than the arm reaches by [0-9.]+ mm", reason)

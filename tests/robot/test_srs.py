"""The closed form against forward kinematics: every branch closes, and is calm where branches meet."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.frames import Transform
from tests.robot.arms import IIWAS, Arm, arm_named, assert_batches_are_single_poses, distance

CLOSED = 1e-9  # m and rad

A2, A4, A6 = 1, 3, 5
ZEROS = [zeros for size in (1, 2, 3) for zeros in itertools.combinations((A2, A4, A6), size)]


@pytest.fixture(params=IIWAS)
def arm(request: pytest.FixtureRequest) -> Arm:
    """An arm with a redundancy."""
    return arm_named(request.param)


def singular_poses(arm: Arm, rng: np.random.Generator, count: int) -> Iterator[tuple[str, list[float]]]:
    """Joint positions of every singular family.

    A2, A4 and A6 at zero alone and together, with any A3, with A3 = 0 and with A3 = +-90 deg, where both
    solutions for A2 are one; and the wrist point on the axis of A1.
    """
    for zeros in ZEROS:
        for a3 in (None, 0.0, math.pi / 2, -math.pi / 2):
            for q in arm.anywhere(rng, count).tolist():
                for joint in zeros:
                    q[joint] = 0.0
                if a3 is not None:
                    q[2] = a3
                yield f"{[f'A{joint + 1}' for joint in zeros]} = 0, A3 = {a3}", q
    d3, d5 = forearms(arm)
    for a6 in (None, 0.0):
        for q in arm.anywhere(rng, count).tolist():
            q[2] = 0.0
            q[A2] = math.atan2(d5 * math.sin(q[A4]), d3 + d5 * math.cos(q[A4]))
            if a6 is not None:
                q[A6] = a6
            yield f"wrist point on the axis of A1, A6 = {a6}", q


def forearms(arm: Arm) -> tuple[float, float]:
    """Upper arm and forearm (m) from the joints' origins."""
    points = arm.model.arm.points
    return float(points[A4][2] - points[A2][2]), float(points[A6][2] - points[A4][2])


def assert_closes(arm: Arm, flange: Transform, joints: Sequence[float] | None, context: object = "") -> None:
    assert joints is not None, context
    assert all(-math.pi < position <= math.pi for position in joints), context
    assert distance([arm.model.flange(joints)], [flange]) <= CLOSED, context


def on_branch(arm: Arm, q: Sequence[float], status: int) -> bool:
    """Whether joint positions are on a branch, where rounding may put them on one that meets it."""
    return status in arm.inverse.merging_statuses(q)


@pytest.mark.requirement("FRC005", "FRC006")
def test_every_branch_of_random_poses_closes(arm: Arm) -> None:
    rng = np.random.default_rng(20)
    inverse, model = arm.inverse, arm.model
    wanted, reached, own_error = [], [], 0.0
    for q in arm.anywhere(rng, 400).tolist():
        flange = model.flange(q)
        branches = inverse.branches(flange, q[2], q)
        assert [status for status, _ in branches] == list(range(8))
        for status, joints in branches:
            assert inverse.status(joints) == status
            assert joints[2] == q[2]
            wanted.append(flange)
            reached.append(model.flange(joints))
        own_error = max(own_error, float(np.abs(np.subtract(branches[inverse.status(q)][1], q)).max()))
    assert distance(reached, wanted) <= CLOSED
    assert own_error <= 1e-6  # joints go with the square root of the pose near the straight arm


@pytest.mark.requirement("FRC005", "FRC006")
def test_either_branch_that_meets_at_a_singular_pose_closes(arm: Arm) -> None:
    rng = np.random.default_rng(21)
    for family, q in singular_poses(arm, rng, 5):
        flange = arm.model.flange(q)
        statuses = arm.inverse.merging_statuses(q)
        assert arm.inverse.status(q) == statuses[0]
        for status in statuses:
            for seed in (q, arm.anywhere(rng, 1)[0].tolist()):
                joints = arm.inverse.joints(flange, q[2], status, seed)
                assert_closes(arm, flange, joints, (family, q, status, seed))
                assert joints is not None
                assert on_branch(arm, joints, status), (family, q, status, seed)


@pytest.mark.requirement("FRC005", "FRC006")
def test_other_branches_at_singular_poses_close(arm: Arm) -> None:
    rng = np.random.default_rng(22)
    for family, q in singular_poses(arm, rng, 5):
        flange = arm.model.flange(q)
        for status, joints in arm.inverse.branches(flange, q[2], arm.anywhere(rng, 1)[0].tolist()):
            assert_closes(arm, flange, joints, (family, q, status))


def test_singular_poses_give_the_seed_back(arm: Arm) -> None:
    rng = np.random.default_rng(23)
    for family, q in singular_poses(arm, rng, 5):
        joints = arm.inverse.joints(arm.model.flange(q), q[2], arm.inverse.status(q), q)
        assert joints == pytest.approx(q, abs=1e-9), family


@pytest.mark.parametrize("size", [1e-12, 1e-9, 1e-6])
def test_next_to_singular_poses_joints_move_in_proportion(arm: Arm, size: float) -> None:
    """Joints moved by a tiny step: the way back from the singular pose changes none by much more."""
    rng = np.random.default_rng(24)
    for family, q in singular_poses(arm, rng, 5):
        if not well_away_from_the_rest(arm, q):
            continue
        moved = (q + size * rng.uniform(-1.0, 1.0, 7)).tolist()
        flange = arm.model.flange(moved)
        joints = arm.inverse.joints(flange, moved[2], arm.inverse.status(moved), q)
        assert_closes(arm, flange, joints, (family, q))
        assert joints is not None
        assert max(map(abs, np.subtract(joints, q))) <= 30.0 * size, (family, q)


def well_away_from_the_rest(arm: Arm, q: Sequence[float]) -> bool:
    """Each of A4, A6 and the wrist point's distance from the axis of A1 either singular or far from it."""
    d3, d5 = forearms(arm)
    x = math.sin(q[A2]) * (d3 + d5 * math.cos(q[A4])) - math.cos(q[A2]) * d5 * math.sin(q[A4]) * math.cos(
        q[2]
    )
    return all(abs(value) < 1e-12 or abs(value) > 0.1 for value in (x, q[A4], math.sin(q[A6])))


def test_free_joints_keep_the_position_of_the_seed(arm: Arm) -> None:
    inverse, model = arm.inverse, arm.model
    seed = [0.3, 0.4, 0.5, -0.6, 0.7, 0.8, 0.9]
    aligned = model.flange([0.1, 1.5, 0.5, 1.2, 0.4, 0.0, 0.3])
    joints = inverse.joints(aligned, 0.5, 0, seed)
    assert joints == pytest.approx([0.1, 1.5, 0.5, 1.2, 0.7, 0.0, 0.0], abs=1e-9)
    straight_up = model.flange([0.0] * 7)
    joints = inverse.joints(straight_up, 0.5, 0, seed)
    assert joints == pytest.approx([0.3, 0.0, 0.5, 0.0, 0.7, 0.0, -1.5], abs=1e-9)


def test_rounding_of_the_pose_moves_no_free_joint(arm: Arm) -> None:
    """The arm upright, the hand anywhere: the wrist point is on the axis of A1 but for the last bits."""
    seed = [0.3, 0.4, 0.5, -0.6, 0.7, 0.8, 0.9]
    for q in arm.anywhere(np.random.default_rng(26), 20).tolist():
        flange = arm.model.flange([q[0], 0.0, q[2], 0.0, *q[4:]])
        for a3, status in itertools.product((0.0, 0.5), range(8)):
            joints = arm.inverse.joints(flange, a3, status, seed)
            assert_closes(arm, flange, joints)
            assert joints is not None
            assert joints[:4] == pytest.approx((0.3, 0.0, a3, 0.0), abs=1e-12)


def test_a_nearly_aligned_wrist_keeps_a5_and_still_closes(arm: Arm) -> None:
    q = [0.1, 1.5, 0.5, 1.2, 0.4, 3e-10, 0.3]
    flange = arm.model.flange(q)
    seed = [*q[:4], -2.0, *q[5:]]
    for status in (0, 4):
        joints = arm.inverse.joints(flange, 0.5, status, seed)
        assert_closes(arm, flange, joints)
        assert joints is not None
        assert joints[4] == -2.0


@given(st.floats(-math.pi, math.pi), st.integers(0, 7), st.floats(1e-6, 2.0))
def test_out_of_reach_is_none(redundancy: float, status: int, beyond_m: float) -> None:
    for name in IIWAS:
        arm = arm_named(name)
        x, y, z = arm.model.flange([0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]).translation
        away = Transform(
            arm.model.flange([0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]).rotation,
            (x + beyond_m * math.sin(1.0), y, z + beyond_m * math.cos(1.0)),
        )
        assert arm.inverse.joints(away, redundancy, status, [0.0] * 7) is None
        assert arm.inverse.branches(away, redundancy, [0.0] * 7) == []


def test_a_batch_is_the_closed_form(arm: Arm) -> None:
    rng = np.random.default_rng(25)
    joints = [*arm.anywhere(rng, 100).tolist(), *(q for _, q in singular_poses(arm, rng, 1))]
    assert_batches_are_single_poses(arm, joints, rng)


def test_status_and_redundancy() -> None:
    inverse = arm_named(IIWAS[0]).inverse
    assert inverse.status([0.0, 0.5, 0.0, -1.0, 0.0, 0.5, 0.0]) == 2
    assert inverse.status([0.0, -0.5, 0.0, 1.0, 0.0, -0.5, 0.0]) == 1 | 4
    assert inverse.status([0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0]) == 4
    assert inverse.redundancy([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]) == 0.3
    assert inverse.redundancy_range == pytest.approx((-math.radians(170), math.radians(170)))


@given(st.lists(st.floats(-2.0, 2.0), min_size=7, max_size=7))
def test_status_bits_say_where_the_wrist_is(q: list[float]) -> None:
    """Bit 0 from the wrist point itself: the flange pulled back by its length, seen from A1."""
    for name in IIWAS:
        arm = arm_named(name)
        (_, _, rx, _, _, ry, _, _, _), (x, y, _) = arm.model.flange(q)
        wrist_flange = 0.126
        wrist_x = math.cos(q[0]) * (x - wrist_flange * rx) + math.sin(q[0]) * (y - wrist_flange * ry)
        status = arm.inverse.status(q)
        if abs(wrist_x) > 1e-12:
            assert bool(status & 1) == (wrist_x < 0)
        assert bool(status & 2) == (q[3] < 0)
        assert bool(status & 4) == (q[5] <= 0)

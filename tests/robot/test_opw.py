"""The six-axis arm's closed form: every branch closes, and is calm where some meet."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.frames import Transform
from iiwa_sim.robot.description import RobotFault
from tests.robot.arms import (
    SIX_AXES,
    Arm,
    arm_named,
    assert_batches_are_single_poses,
    copy_of_robot,
    distance,
    use,
)

CLOSED = 1e-9  # m and rad
STRETCHED = math.atan2(35.0, 420.0)  # A3 where the wrist is farthest from A2
UPPER_ARM, FOREARM = 0.455, math.hypot(0.42, 0.035)
SEED = [0.3, -0.9, 0.5, -0.6, 0.7, 0.8]


@pytest.fixture
def arm() -> Arm:
    return arm_named(SIX_AXES)


def on_the_axis_of_a1(q: list[float]) -> list[float]:
    """Joint positions with A2 changed to put the wrist point on the axis of A1, as far as the bend of A3
    allows."""
    bend = q[2] - STRETCHED
    x, z = UPPER_ARM + FOREARM * math.cos(bend), -FOREARM * math.sin(bend)
    return [q[0], math.atan2(z, x) - math.acos(-0.025 / math.hypot(x, z)), *q[2:]]


def singular_poses(arm: Arm, rng: np.random.Generator, count: int) -> Iterator[tuple[str, list[float]]]:
    """Joint positions of every singular family and of all that meet."""
    families: dict[str, Callable[[list[float]], list[float]]] = {
        "stretched": lambda q: [*q[:2], STRETCHED, *q[3:]],
        "on the axis of A1": on_the_axis_of_a1,
        "A5 = 0": lambda q: [*q[:4], 0.0, q[5]],
    }
    for size in (1, 2, 3):
        for names in itertools.combinations(families, size):
            for q in arm.anywhere(rng, count).tolist():
                for name in names:
                    q = families[name](q)
                yield " and ".join(names), q


def assert_closes(arm: Arm, flange: Transform, joints: Sequence[float] | None, context: object = "") -> None:
    assert joints is not None, context
    assert all(-math.pi < position <= math.pi for position in joints), context
    assert distance([arm.model.flange(joints)], [flange]) <= CLOSED, context


def same_but_for_turns(a: Sequence[float] | None, b: Sequence[float], near: float) -> bool:
    assert a is not None
    return max(abs(math.remainder(x - y, math.tau)) for x, y in zip(a, b, strict=True)) <= near


@pytest.mark.requirement("FRC005", "FRC006")
def test_every_branch_of_random_poses_closes(arm: Arm) -> None:
    rng = np.random.default_rng(20)
    inverse, model = arm.inverse, arm.model
    wanted, reached = [], []
    for q in arm.anywhere(rng, 400).tolist():
        flange = model.flange(q)
        branches = dict(inverse.branches(flange, 0.0, q))
        assert same_but_for_turns(branches[inverse.status(q)], q, 1e-6)
        assert {status ^ 2 for status in branches} == set(branches)  # the elbow and the wrist have two
        assert {status ^ 4 for status in branches} == set(branches)
        for status, joints in branches.items():
            assert inverse.status(joints) == status
            wanted.append(flange)
            reached.append(model.flange(joints))
    assert distance(reached, wanted) <= CLOSED
    assert len(reached) > 7 * 400


@pytest.mark.requirement("FRC005", "FRC006")
def test_either_branch_that_meets_at_a_singular_pose_closes(arm: Arm) -> None:
    rng = np.random.default_rng(21)
    for family, q in singular_poses(arm, rng, 10):
        flange = arm.model.flange(q)
        statuses = arm.inverse.merging_statuses(q)
        assert arm.inverse.status(q) == statuses[0]
        assert len(statuses) == 2 ** len(family.split(" and "))
        for status in statuses:
            for seed in (q, arm.anywhere(rng, 1)[0].tolist()):
                joints = arm.inverse.joints(flange, 0.0, status, seed)
                assert_closes(arm, flange, joints, (family, q, status, seed))
                assert joints is not None
                assert status in arm.inverse.merging_statuses(joints), (family, q, status, seed)


@pytest.mark.requirement("FRC005", "FRC006")
def test_other_branches_at_singular_poses_close(arm: Arm) -> None:
    rng = np.random.default_rng(22)
    for family, q in singular_poses(arm, rng, 10):
        flange = arm.model.flange(q)
        for status, joints in arm.inverse.branches(flange, 0.0, arm.anywhere(rng, 1)[0].tolist()):
            assert_closes(arm, flange, joints, (family, q, status))


def test_singular_poses_give_the_seed_back(arm: Arm) -> None:
    rng = np.random.default_rng(23)
    for family, q in singular_poses(arm, rng, 10):
        joints = arm.inverse.joints(arm.model.flange(q), 0.0, arm.inverse.status(q), q)
        assert same_but_for_turns(joints, q, 1e-9), family


@pytest.mark.parametrize("size", [1e-12, 1e-9, 1e-6])
def test_next_to_singular_poses_joints_move_in_proportion(arm: Arm, size: float) -> None:
    """Joints moved by a tiny step: the way back from the singular pose changes none by much more."""
    rng = np.random.default_rng(24)
    for family, q in singular_poses(arm, rng, 10):
        if not well_away_from_the_rest(q):
            continue
        moved = (q + size * rng.uniform(-1.0, 1.0, 6)).tolist()
        flange = arm.model.flange(moved)
        joints = arm.inverse.joints(flange, 0.0, arm.inverse.status(moved), q)
        assert_closes(arm, flange, joints, (family, q))
        assert same_but_for_turns(joints, q, 30.0 * size), (family, q)


def well_away_from_the_rest(q: Sequence[float]) -> bool:
    """Each of the bend of A3, A5 and the wrist point's distance from A1 either singular or far from it."""
    x = 0.025 + UPPER_ARM * math.cos(q[1]) + FOREARM * math.cos(q[1] + q[2] - STRETCHED)
    return all(abs(value) < 1e-12 or abs(value) > 0.1 for value in (x, q[2] - STRETCHED, q[4]))


def test_free_joints_keep_the_position_of_the_seed(arm: Arm) -> None:
    aligned = arm.model.flange([0.1, -1.2, 1.5, 0.4, 0.0, 0.3])
    joints = arm.inverse.joints(aligned, 0.0, 2, SEED)
    assert joints == pytest.approx([0.1, -1.2, 1.5, -0.6, 0.0, 1.3], abs=1e-9)
    above = on_the_axis_of_a1([0.1, 0.0, 1.5, 0.4, 0.5, 0.2])
    joints = arm.inverse.joints(arm.model.flange(above), 0.0, arm.inverse.status(above), SEED)
    assert joints is not None
    assert joints[:3] == pytest.approx([0.3, *above[1:3]], abs=1e-9)


def test_a_free_joint_beyond_half_a_turn_comes_from_the_seed_as_the_angle_it_is(arm: Arm) -> None:
    seed = [0.1, -1.2, 1.5, math.radians(184.0), 0.0, math.radians(-340.0)]
    joints = arm.inverse.joints(arm.model.flange(seed), 0.0, 2, seed)
    assert joints == pytest.approx([*seed[:3], math.radians(-176.0), 0.0, math.radians(20.0)], abs=1e-9)


@given(st.integers(0, 7), st.floats(1e-6, 2.0))
def test_out_of_reach_is_none(status: int, beyond_m: float) -> None:
    arm = arm_named(SIX_AXES)
    stretched = arm.model.flange([0.0, -1.0, STRETCHED, 0.0, 0.5, 0.0])
    upwards = (math.cos(1.0) * beyond_m, 0.0, math.sin(1.0) * beyond_m)
    away = Transform(stretched.rotation, tuple(np.add(stretched.translation, upwards).tolist()))
    assert arm.inverse.joints(away, 0.0, status, [0.0] * 6) is None
    assert arm.inverse.branches(away, 0.0, [0.0] * 6) == []


def test_a_batch_is_the_closed_form(arm: Arm) -> None:
    rng = np.random.default_rng(25)
    joints = [*arm.anywhere(rng, 100).tolist(), *(q for _, q in singular_poses(arm, rng, 5))]
    assert_batches_are_single_poses(arm, joints, rng)


@pytest.mark.parametrize(
    ("joints_deg", "status"),
    [
        ((0, -90, 90, 0, 45, 0), 0b110),  # KUKA's usual poses: S 6, and S 2 with A5 at zero or below
        ((0, -90, 90, 0, 0, 0), 0b010),
        ((0, -90, 90, 0, -45, 0), 0b010),
        ((0, -90, 4, 0, -45, 0), 0b000),  # A3 below 4.76 deg, where the arm is stretched
        ((0, -90, 5, 0, -45, 0), 0b010),
        ((0, -170, 30, 0, 45, 0), 0b111),  # overhead
        ((0, -170, -30, 0, 0, 0), 0b001),
    ],
)
def test_status_is_what_kuka_means_by_it(joints_deg: tuple[int, ...], status: int) -> None:
    assert arm_named(SIX_AXES).inverse.status([math.radians(value) for value in joints_deg]) == status


def test_there_is_no_redundancy(arm: Arm) -> None:
    assert arm.inverse.redundancy_range is None
    assert arm.inverse.redundancy(SEED) == 0.0
    flange = arm.model.flange(SEED)
    assert arm.inverse.joints(flange, 1.0, 6, SEED) == arm.inverse.joints(flange, 0.0, 6, SEED)


@given(st.lists(st.floats(-2.0, 2.0), min_size=6, max_size=6))
def test_status_bits_say_where_the_wrist_is(q: list[float]) -> None:
    """Bit 0 from the wrist point itself: the flange pulled back by its length, seen from A1."""
    arm = arm_named(SIX_AXES)
    (_, _, rx, _, _, ry, _, _, _), (x, y, _) = arm.model.flange(q)
    wrist_x = math.cos(q[0]) * (x - 0.08 * rx) - math.sin(q[0]) * (y - 0.08 * ry)
    status = arm.inverse.status(q)
    if abs(wrist_x) > 1e-12:
        assert bool(status & 1) == (wrist_x < 0)
    assert bool(status & 2) == (q[2] >= STRETCHED)
    assert bool(status & 4) == (q[4] > 0)


def test_turning_points(arm: Arm) -> None:
    above = on_the_axis_of_a1([0.1, 0.0, 1.5, 0.4, 0.5, 0.2])
    assert arm.inverse.turning_point(above) == "the wrist is on the axis of A1"
    assert arm.inverse.turning_point([0.0, -1.0, STRETCHED, 0.0, 0.5, 0.0]) == "the arm is stretched"
    assert arm.inverse.turning_point([0.1, -1.2, 1.5, 0.4, 0.0, 0.3]) is None


@pytest.mark.parametrize("axis", range(6))
def test_joints_may_turn_the_other_way(tmp_path: Path, axis: int) -> None:
    """Another arm of the kind: a joint that turns the other way, and with it its limits."""
    folder = copy_of_robot(tmp_path / "mine", SIX_AXES)
    pieces = re.split(r'(<axis xyz="[^"]*"/>)', (folder / "robot.urdf").read_text())
    direction = re.findall(r"-?\d", pieces[2 * axis + 1])
    pieces[2 * axis + 1] = '<axis xyz="{} {} {}"/>'.format(*(-int(part) for part in direction))
    (folder / "robot.urdf").write_text("".join(pieces))
    mine = arm_named(str(folder))
    rng = np.random.default_rng(26)
    for q in rng.uniform(-2.0, 2.0, (50, 6)).tolist():
        flange = mine.model.flange(q)
        branches = dict(mine.inverse.branches(flange, 0.0, q))
        assert same_but_for_turns(branches[mine.inverse.status(q)], q, 1e-6)
        for status, joints in branches.items():
            assert_closes(mine, flange, joints)
            assert mine.inverse.status(joints) == status


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            '<axis xyz="0 1 0"/>',
            '<axis xyz="1 0 0"/>',
            r"joint A2: axis = 1 0 0: .* at zero pose \+-\(0 1 0\)",
        ),
        (
            '<origin xyz="0 0 0.2"/>',
            '<origin xyz="0 0.01 0.2"/>',
            "joint A1: origin = 0 0.01 0.2 m: .*x = y = 0",
        ),
        ('"0.15 0 0.035"', '"0.15 0.01 0.035"', "joint A4: origin = .*: expected an axis in the plane y = 0"),
        (
            '"0.27 0 0"/>\n    <axis',
            '"0.27 0 0.01"/>\n    <axis',
            "joint A4: origin = .*: expected an axis that A5 crosses",
        ),
        ('"0.06 0 0"', '"0.06 0 0.01"', "joint A6: origin = .*: expected an axis that A5 crosses"),
        (
            '"0.02 0 0" rpy="0 1.57',
            '"0.02 0 0.01" rpy="0 1.57',
            "link flange: origin = .*: expected a flange on the axis of A6",
        ),
        (
            '"0.455 0 0"/>\n    <axis',
            '"0 0 0"/>\n    <axis',
            "joint A3: origin = 0 m: expected more than 0 m away from A2",
        ),
    ],
)
def test_what_is_no_such_arm_is_said_in_one_line(tmp_path: Path, old: str, new: str, message: str) -> None:
    folder = copy_of_robot(tmp_path / "mine", SIX_AXES)
    joints = (folder / "robot.urdf").read_text().split("<joint ", 1)
    assert old in joints[1]
    (folder / "robot.urdf").write_text("<joint ".join([joints[0], joints[1].replace(old, new, 1)]))
    with pytest.raises(RobotFault, match=message):
        use(folder)

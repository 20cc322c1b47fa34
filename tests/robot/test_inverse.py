"""The closed form of both kinds of arm: every branch closes, and is calm where branches meet."""

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
    BUILT_IN,
    SIX_AXES,
    Arm,
    arm_named,
    branches_of,
    copy_of_robot,
    distance,
    use,
)

CLOSED = 1e-9  # m and rad
A2, A4, A6 = 1, 3, 5
ZEROS = [zeros for size in (1, 2, 3) for zeros in itertools.combinations((A2, A4, A6), size)]
STRETCHED = math.atan2(35.0, 420.0)  # A3 of the six-axis arm where the wrist is farthest from A2
UPPER_ARM, FOREARM = 0.455, math.hypot(0.42, 0.035)
SEED = [0.3, -0.9, 0.5, -0.6, 0.7, 0.8]


def on_the_axis_of_a1(q: list[float]) -> list[float]:
    """Return joint positions with A2 changed to bring the wrist point near the axis of A1."""
    bend = q[2] - STRETCHED
    x, z = UPPER_ARM + FOREARM * math.cos(bend), -FOREARM * math.sin(bend)
    return [q[0], math.atan2(z, x) - math.acos(-0.025 / math.hypot(x, z)), *q[2:]]


def singular_poses(arm: Arm, rng: np.random.Generator, count: int) -> Iterator[tuple[str, list[float]]]:
    """Return joint positions of every singular family, and of all that meet."""
    families = _of_an_iiwa if arm.inverse.redundancy_range else _of_six_axes
    return families(arm, rng, count)


def _of_six_axes(arm: Arm, rng: np.random.Generator, count: int) -> Iterator[tuple[str, list[float]]]:
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


def _of_an_iiwa(arm: Arm, rng: np.random.Generator, count: int) -> Iterator[tuple[str, list[float]]]:
    """Yield singular positions: A2, A4 and A6 at zero alone and together, the wrist on the axis of A1.

    A3 has any position, 0, and +-90 deg, where both solutions for A2 are one.
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
    """Return upper arm and forearm (m) from the joints' origins."""
    points = arm.model.points
    return float(points[A4][2] - points[A2][2]), float(points[A6][2] - points[A4][2])


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
        branches = branches_of(arm, flange, inverse.redundancy(q), q)
        assert same_but_for_turns(branches[inverse.status(q)], q, 1e-6)
        for bit in (1, 2, 4) if inverse.redundancy_range else (2, 4):  # six axes may not reach overhead
            assert {status ^ bit for status in branches} == set(branches)
        for status, joints in branches.items():
            assert inverse.status(joints) == status
            assert inverse.redundancy(joints) == inverse.redundancy(q)
            wanted.append(flange)
            reached.append(model.flange(joints))
    assert distance(reached, wanted) <= CLOSED
    assert len(reached) > 7 * 400


@pytest.mark.requirement("FRC005", "FRC006")
def test_either_branch_that_meets_at_a_singular_pose_closes(arm: Arm) -> None:
    rng = np.random.default_rng(21)
    for family, q in singular_poses(arm, rng, 5):
        flange = arm.model.flange(q)
        statuses = arm.inverse.merging_statuses(q)
        assert arm.inverse.status(q) == statuses[0]
        for status in statuses:
            for seed in (q, arm.anywhere(rng, 1)[0].tolist()):
                joints = arm.inverse.joints(flange, arm.inverse.redundancy(q), status, seed)
                assert_closes(arm, flange, joints, (family, q, status, seed))
                assert joints is not None
                assert status in arm.inverse.merging_statuses(joints), (family, q, status, seed)


@pytest.mark.parametrize("size", [1e-12, 1e-9, 1e-6])
def test_next_to_singular_poses_joints_move_in_proportion(arm: Arm, size: float) -> None:
    """Joints moved by a tiny step: leaving the singular pose changes none by much more."""
    rng = np.random.default_rng(24)
    for family, q in singular_poses(arm, rng, 5):
        if any(1e-12 < abs(value) < 0.1 for value in arm.inverse.distances(q)):
            continue
        moved = (q + size * rng.uniform(-1.0, 1.0, len(q))).tolist()
        flange = arm.model.flange(moved)
        joints = arm.inverse.joints(flange, arm.inverse.redundancy(moved), arm.inverse.status(moved), q)
        assert_closes(arm, flange, joints, (family, q))
        assert same_but_for_turns(joints, q, 30.0 * size), (family, q)


@given(st.sampled_from(BUILT_IN), st.floats(-math.pi, math.pi), st.integers(0, 7), st.floats(1e-6, 2.0))
def test_out_of_reach_is_none(name: str, redundancy: float, status: int, beyond_m: float) -> None:
    arm = arm_named(name)
    joints, up = ([0.0, 1.0, *[0.0] * 5], 0.5 * math.pi - 1.0)
    if name == SIX_AXES:
        joints, up = [0.0, -1.0, STRETCHED, 0.0, 0.5, 0.0], 1.0
    stretched = arm.model.flange(joints)
    further = np.add(stretched.translation, (math.cos(up) * beyond_m, 0.0, math.sin(up) * beyond_m))
    away = Transform(stretched.rotation, tuple(further.tolist()))
    assert arm.inverse.beyond_reach(stretched) == pytest.approx(0.0, abs=1e-9)
    assert arm.inverse.beyond_reach(away) == pytest.approx(beyond_m, abs=1e-9)
    assert arm.inverse.joints(away, redundancy, status, joints) is None
    assert branches_of(arm, away, redundancy, joints) == {}


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
def test_status_has_kukas_meaning(joints_deg: tuple[int, ...], status: int) -> None:
    assert arm_named(SIX_AXES).inverse.status([math.radians(value) for value in joints_deg]) == status


@pytest.mark.parametrize("axis", range(6))
def test_joints_may_turn_in_the_other_direction(tmp_path: Path, axis: int) -> None:
    """Another arm of the kind, with a joint and its limits reversed."""
    folder = copy_of_robot(tmp_path / "mine", SIX_AXES)
    pieces = re.split(r'(<axis xyz="[^"]*"/>)', (folder / "robot.urdf").read_text())
    direction = re.findall(r"-?\d", pieces[2 * axis + 1])
    pieces[2 * axis + 1] = '<axis xyz="{} {} {}"/>'.format(*(-int(part) for part in direction))
    (folder / "robot.urdf").write_text("".join(pieces))
    mine = arm_named(str(folder))
    rng = np.random.default_rng(26)
    for q in rng.uniform(-2.0, 2.0, (50, 6)).tolist():
        flange = mine.model.flange(q)
        branches = branches_of(mine, flange, 0.0, q)
        assert same_but_for_turns(branches[mine.inverse.status(q)], q, 1e-6)
        for status, joints in branches.items():
            assert_closes(mine, flange, joints)
            assert mine.inverse.status(joints) == status


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('<axis xyz="0 1 0"/>', '<axis xyz="1 0 0"/>', r"joint A2: axis = 1 0 0: .* \+-\(0 1 0\)"),
        ('<origin xyz="0 0 0.2"/>', '<origin xyz="0 0.01 0.2"/>', "plane y = 0"),
        ('"0.15 0 0.035"', '"0.15 0.01 0.035"', "plane y = 0"),
        ('"0.27 0 0"/>\n    <axis', '"0.27 0 0.01"/>\n    <axis', "cross in the wrist"),
        ('"0.06 0 0"', '"0.06 0 0.01"', "cross in the wrist"),
        ('"0.02 0 0" rpy="0 1.57', '"0.02 0 0.01" rpy="0 1.57', "and the flange"),
        ('"0.455 0 0"/>\n    <axis', '"0 0 0"/>\n    <axis', "kinematics = 'opw'"),
    ],
)
def test_an_unsupported_arm_is_reported_in_one_line(tmp_path: Path, old: str, new: str, message: str) -> None:
    folder = copy_of_robot(tmp_path / "mine", SIX_AXES)
    joints = (folder / "robot.urdf").read_text().split("<joint ", 1)
    assert old in joints[1]
    (folder / "robot.urdf").write_text("<joint ".join([joints[0], joints[1].replace(old, new, 1)]))
    with pytest.raises(RobotFault, match=message):
        use(folder)

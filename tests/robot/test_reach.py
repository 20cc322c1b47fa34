"""How far beyond reach a pose is, against the inverse kinematics, which do not know that number."""

from __future__ import annotations

import numpy as np
import pytest

from iiwa_sim.frames import Transform
from iiwa_sim.robot.nearest import OUT_OF_REACH, Nearest, Unreachable, how_far
from tests.robot.arms import Arm, arm_named

POSES = 25
_STEP_M = 1e-6


def solved(arm: Arm, flange: Transform) -> bool:
    """Whether any branch reaches it with any redundancy, joint limits left aside."""
    redundancies = np.linspace(-np.pi, np.pi, 181) if arm.inverse.redundancy_range else np.zeros(1)
    every, statuses = np.tile(redundancies, 8), np.repeat(np.arange(8), len(redundancies))
    return not np.isnan(arm.inverse.joints_batch(flange, every, statuses, arm.description.home)).all()


def away(arm: Arm, flange: Transform) -> np.ndarray:
    """The direction in which the distance beyond reach grows fastest."""

    def beyond(axis: int, step_m: float) -> float:
        place = list(flange.translation)
        place[axis] += step_m
        return arm.inverse.beyond_reach(Transform(flange.rotation, (place[0], place[1], place[2])))

    return np.array([(beyond(axis, _STEP_M) - beyond(axis, -_STEP_M)) / (2 * _STEP_M) for axis in range(3)])


def moved(flange: Transform, way: np.ndarray) -> Transform:
    x, y, z = (np.array(flange.translation) + way).tolist()
    return Transform(flange.rotation, (x, y, z))


def test_a_pose_of_the_arm_is_within_reach(arm: Arm) -> None:
    for q in arm.anywhere(np.random.default_rng(1), POSES):
        assert arm.inverse.beyond_reach(arm.model.flange(q.tolist())) == 0.0


@pytest.mark.parametrize("scale_m", [0.1, 1.0, 5.0])
def test_a_pose_beyond_reach_is_reached_where_it_is_nearer_by_so_much(arm: Arm, scale_m: float) -> None:
    rng = np.random.default_rng(2)
    found = 0
    for q in arm.anywhere(rng, POSES):
        flange = moved(arm.model.flange(q.tolist()), rng.normal(size=3) * scale_m)
        beyond = arm.inverse.beyond_reach(flange)
        if abs(beyond) < 2e-3:
            continue
        found += 1
        direction = away(arm, flange)
        assert np.linalg.norm(direction) == pytest.approx(1.0, abs=1e-3)
        assert not solved(arm, moved(flange, -(beyond - np.sign(beyond) * 1e-3) * direction))
        assert solved(arm, moved(flange, -(beyond + np.sign(beyond) * 1e-3) * direction))
    assert found


def test_a_wrist_that_the_arm_does_not_fold_to_is_below_zero() -> None:
    """On the axis of A1 at the height of A2: by as much as upper arm and forearm differ, less A2's offset."""
    arm = arm_named("kr_6_r900_sixx")
    upper, fore, shoulder_x, shoulder_z, hand = 0.455, float(np.hypot(0.42, 0.035)), 0.025, 0.4, 0.08
    flange = arm.model.flange(arm.description.home)
    _, _, along_x, _, _, along_y, _, _, along_z = flange.rotation
    near = Transform(flange.rotation, (hand * along_x, hand * along_y, hand * along_z + shoulder_z))
    assert arm.inverse.beyond_reach(near) == pytest.approx(shoulder_x - abs(upper - fore))
    assert arm.inverse.beyond_reach(near) < 0.0
    assert not solved(arm, near)


def test_it_is_told_in_mm() -> None:
    assert how_far(0.12) == ": farther than the arm reaches by 120 mm"
    assert how_far(-0.0123) == ": nearer to the shoulder than the arm folds by 12.3 mm"
    assert how_far(0.0) == ""


def test_a_refusal_says_it(arm: Arm) -> None:
    away_m = Transform((1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), (1.0, 0.9, 0.3))
    with pytest.raises(Unreachable, match=r"farther than the arm reaches by [0-9.]+ mm") as refused:
        Nearest(arm.inverse, arm.description).find(away_m, arm.description.home)
    assert refused.value.code == OUT_OF_REACH

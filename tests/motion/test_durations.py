"""Durations beside the fastest possible: corners, dense paths and lines."""

from statistics import median

import numpy as np
import pytest

from benchmarks import corners
from benchmarks.dense_paths import before, joints_along
from benchmarks.figures import percentile
from benchmarks.lines import random_lines, trajectory_of
from benchmarks.time_optimal import fastest_without_jerk_limit_s
from iiwa_sim.robot.description import load_robot
from tests.stepped import ARMS, SteppedRobot, assert_within_limits

TICK_S = 0.002
SAMPLE = 23  # every one of so many dense paths; all of them are in `make bench ARGS=dense`
NAMED = (
    ("kr_6_r900_sixx", "circle of 0.5 mm lines at 1", "at once"),
    ("lbr_iiwa_14_r820", "circle of 2 mm lines at 0.02", "at once"),
    ("lbr_iiwa_7_r800", "polyline of 2 mm, 10 deg, R = L/2", "as four wait"),
)
DENSE = list(before())
both = pytest.mark.parametrize("robot", corners.ROBOTS)


@pytest.mark.slow
@pytest.mark.requirement("FRC012", "FRC015")
@both
def test_corners_are_near_their_optimum_and_never_later_than_exact_stops(robot: str) -> None:
    ratios = []
    for corner in corners.corners(robot):
        taken = corners.take(robot, corner, TICK_S)
        assert taken.blended_s <= taken.exact_s + 1.5 * TICK_S, corner.name
        ratios.append(taken.blended_s / corner.optimum_s)
    assert median(ratios) <= corners.MEDIAN
    assert percentile(ratios, 0.9) <= corners.P90
    assert max(ratios) <= corners.LARGEST


@pytest.mark.requirement("FRC012", "FRC015")
@both
def test_the_named_corners_are_passed_at_speed_near_their_optimum(robot: str) -> None:
    for corner in corners.corners(robot):
        if corner.name in corners.SLOWEST_MM_S:
            taken = corners.take(robot, corner, TICK_S)
            assert corners.slowest_mm_s(robot, corner, taken, TICK_S) >= corners.SLOWEST_MM_S[corner.name]
            assert taken.blended_s / corner.optimum_s <= corners.P90


@pytest.mark.slow
@pytest.mark.requirement("FRC015")
@pytest.mark.parametrize(
    ("robot", "path", "feed", "ticks"), [*(each for each in DENSE if each[:3] in NAMED), *DENSE[::SAMPLE]]
)
def test_a_dense_path_takes_no_longer_than_stored_and_keeps_its_limits(
    robot: str, path: str, feed: str, ticks: int
) -> None:
    joints = joints_along(robot, path, feed)
    assert len(joints) - 1 <= ticks + 1
    recorded = SteppedRobot(robot)
    recorded.joints = list(map(tuple, joints.tolist()))
    recorded.stopping = recorded.direct = [False] * len(joints)
    assert_within_limits(recorded)


@pytest.mark.slow
@pytest.mark.requirement("FRC009")
@pytest.mark.parametrize(("robot", "median", "most"), [(ARMS[0], 1.08, 1.11), (ARMS[1], 1.15, 1.3)])
def test_lines_take_little_more_than_the_time_optimal_without_jerk_limit(
    robot: str, median: float, most: float
) -> None:
    """The faster the arm, the larger the share of a line in which jerk counts."""
    description = load_robot(robot)
    ratios = [
        trajectory_of(plan).end_s / fastest_without_jerk_limit_s(plan.path, description)
        for plan in random_lines(description, count=30, seed=7)
    ]
    assert min(ratios) > 0.996  # accelerations between knots may be that far above their limits
    assert np.median(ratios) < median
    assert np.percentile(ratios, 95) < most

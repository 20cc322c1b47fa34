"""Durations beside the fastest possible: corners, dense paths and lines; their paths stay exact."""

from itertools import cycle
from statistics import median

import numpy as np
import pytest

from benchmarks import corners
from benchmarks.dense_paths import before, joints_along
from benchmarks.figures import percentile
from benchmarks.lines import random_lines, trajectory_of
from benchmarks.time_optimal import fastest_without_jerk_limit_s
from benchmarks.told import run
from iiwa_sim.controller.controller import Controller
from iiwa_sim.robot.description import load_robot
from tests.blended_path import Joints, Run, Sent
from tests.chain_checks import assert_keeps_its_paths, assert_keeps_its_speeds
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


@pytest.mark.requirement("FRC012", "FRC015")
@both
def test_paths_are_exact_outside_the_sphere_and_limits_hold_everywhere(robot: str) -> None:
    """To 1 um, at ticks of different lengths."""
    for corner, tick_s in zip(corners.corners(robot)[::24], cycle((0.001, 0.002, 0.005, 0.01)), strict=False):
        recorded = run_of(robot, corner, tick_s)
        assert_keeps_its_paths(recorded)
        assert_keeps_its_speeds(recorded)
        assert_within_limits(recorded.robot)


def run_of(robot: str, corner: corners.Corner, tick_s: float) -> Run:
    """Both moves, sent at once, as they are recorded."""
    starts = [corner.start, ends_at(robot, corner.start, corner, 1, tick_s)]
    ends = [starts[1], ends_at(robot, corner.start, corner, 2, tick_s)]
    stepped = SteppedRobot(robot, tick_s)
    stepped.controller.place(corner.start)
    joints = run(stepped.controller, corner.moves)
    stepped.joints = list(map(tuple, joints.tolist()))
    stepped.stopping = stepped.direct = [False] * len(joints)
    moves = [
        Sent(told.kind, start, end, (told.speed_rel,) * len(start), told.blending_mm, -1)
        for told, start, end in zip(corner.moves, starts, ends, strict=True)
    ]
    return Run(stepped, 0, corner.start, moves, len(joints) - 1)


def ends_at(robot: str, start: Joints, corner: corners.Corner, count: int, tick_s: float) -> Joints:
    """Where the first moves end, without blending."""
    controller = Controller(load_robot(robot), tick_s, start=start)
    return tuple(run(controller, corner.moves[:count], blending=False)[-1].tolist())


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

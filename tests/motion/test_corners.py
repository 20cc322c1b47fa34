"""Corners: two moves with a blended corner, beside the fastest they could be run, and their exact paths."""

from itertools import cycle
from statistics import median

import pytest

from benchmarks import corners
from benchmarks.figures import percentile
from benchmarks.told import run
from iiwa_sim.controller.controller import Controller
from iiwa_sim.robot.description import load_robot
from tests.blended_path import Joints, Run, Sent
from tests.chain_checks import assert_keeps_its_paths, assert_keeps_its_speeds
from tests.stepped import SteppedRobot, assert_within_limits

TICK_S = 0.002
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
def test_the_named_corners_are_passed_at_speed(robot: str) -> None:
    for corner in corners.corners(robot):
        if corner.name in corners.SLOWEST_MM_S:
            taken = corners.take(robot, corner, TICK_S)
            assert corners.slowest_mm_s(robot, corner, taken, TICK_S) >= corners.SLOWEST_MM_S[corner.name]


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

"""Trajectories as they are planned: limits between ticks, too, and durations near the optimum."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.lines import random_lines, trajectory_of
from benchmarks.time_optimal import fastest_without_jerk_limit_s
from iiwa_sim.controller.planner import Planner
from iiwa_sim.controller.requests import Kind, MoveRequest
from iiwa_sim.frames import Frame
from iiwa_sim.motion.blend import Move
from iiwa_sim.motion.trajectory import begun
from iiwa_sim.robot.description import load_robot
from iiwa_sim.robot.model import Model
from tests.asked import lin_joint_move, lin_move, ptp_move
from tests.stepped import (
    ALL_ROBOTS,
    ARMS,
    JERK_TOLERANCE,
    TOLERANCE,
    VELOCITY_TOLERANCE,
    SteppedRobot,
    assert_straight,
    assert_within_limits,
    worst_loads,
)

TICK_S = 0.002


@pytest.mark.requirement("FRC009")
@pytest.mark.parametrize("robot", ALL_ROBOTS)
@pytest.mark.parametrize("speed_rel", [1.0, pytest.param(0.3, marks=pytest.mark.slow)])
def test_lines_anywhere_keep_all_limits(robot: str, speed_rel: float) -> None:
    description = load_robot(robot)
    for plan in random_lines(description, count=20, seed=99, speed_rel=speed_rel):
        trajectory = trajectory_of(plan)
        times = np.arange(0.0, trajectory.end_s + 4 * TICK_S, TICK_S).tolist()
        q = np.array([trajectory.joints(t) for t in times])
        q = np.concatenate([q[:1]] * 3 + [q])
        limits = description.velocity, description.acceleration, description.jerk
        for order, limit in enumerate(limits, start=1):
            assert (np.abs(np.diff(q, n=order, axis=0)) / TICK_S**order / limit).max() <= TOLERANCE


@pytest.mark.parametrize("robot", ALL_ROBOTS)
def test_a_line_of_a_second_or_two_is_planned_once(robot: str) -> None:
    """It sets out with a clock that has nothing left to gain: so nothing is planned while it runs."""
    plans = random_lines(load_robot(robot), 12, seed=3)
    found = [begun(Move(1, *plan, lambda _: None)) for plan in plans]
    assert not any(trajectory.rough for trajectory in found if trajectory.end_s < 2.0)
    assert any(trajectory.end_s < 1.0 for trajectory in found)


def test_a_slow_line_sets_out_evenly_and_is_soon_as_fast_as_it_can_be() -> None:
    robot = SteppedRobot()
    target = robot.controller.tool_frame()._replace(y_mm=300.0)
    robot.controller.move(lin_move(target, 0.05, 0.0))
    robot.step()
    executor = robot.controller.motions._executor
    even = executor._queued
    assert even is not None
    assert even.rough
    robot.step(50)
    planned = executor._queued
    assert planned is not None
    assert not planned.rough
    assert planned.end_s < 0.8 * even.end_s
    robot.runs_until_stopped()
    assert_straight(robot, robot.joints, target)
    assert_within_limits(robot)


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
    assert min(ratios) > 0.996  # what accelerations between knots may be above their limits
    assert np.median(ratios) < median
    assert np.percentile(ratios, 95) < most


@pytest.mark.slow
def test_jerks_hold_on_both_sides_of_a_seam() -> None:
    """The third derivative jumps where a blend begins and ends. Once no look was taken right there."""
    start = (0.4823, 0.645, 0.3405, -1.118, -0.0469, 1.3014, -0.05)
    robot = SteppedRobot(replace(load_robot(), home=start))
    controller = robot.controller
    controller.move(ptp_move(Frame(381.6203, 316.3059, 415.6517, -1.4088, -1.3821, 2.2164), 0.3, 500.0))
    controller.move(lin_joint_move((0.6163, 0.5225, 0.4511, -1.1227, -0.1028, 1.1926, -0.1962), 0.7, 9.0))
    controller.move(lin_joint_move((0.6163, 0.7738, 0.2731, -1.2483, -0.2809, 1.3182, 0.1703), 0.5, 500.0))
    controller.move(ptp_move(Frame(266.8068, 336.5607, 260.9059, 1.7433, -0.7615, -0.9334), 0.7, 0.0))
    robot.runs_until_stopped()
    assert worst_loads(robot)["jerk"] <= JERK_TOLERANCE


@pytest.mark.slow
def test_jerks_hold_right_behind_the_border_of_a_short_piece() -> None:
    """The last of eleven pieces is a thousandth of the line. Once the look behind its border fell before it,
    and 0.09 ms of the plan had a jerk of 1.24."""
    description = load_robot("lbr_iiwa_14_r820")
    model = Model(description)
    start = (
        -1.800015657764,
        -0.133247130191,
        -1.292492716480,
        -0.791062432887,
        -0.095851787976,
        -0.890561857414,
    )
    target = Frame(
        -184.731380189442,
        230.250413829166,
        1214.220895365652,
        -2.715221344591,
        1.427065615081,
        2.377531306223,
    )
    tcp = model.tcp(description.tool_in_flange)
    plan = Planner(model).plan(MoveRequest(Kind.LIN, target, 0.461487604924), (*start, -1.928625873422), tcp)
    assert plan.path.piece_count == 11
    trajectory = trajectory_of(plan)
    derivatives, limits = trajectory.along(np.linspace(0.0, trajectory.end_s, 20_001)[:-1])
    assert (np.abs(derivatives[:, 3]) / limits[:, 2]).max() <= JERK_TOLERANCE


@pytest.mark.slow
def test_a_slow_line_keeps_its_speed_also_where_a_joint_is_fastest_between_two_samples() -> None:
    """A5 beside the stretched wrist, which was once 0.7 % too fast."""
    robot = SteppedRobot("lbr_iiwa_14_r820")
    robot.goes_to((-1.1439, 0.0708, -2.1269, 0.0425, -0.9482, -0.0904, 1.6161))
    end = robot.tcp_frame((-1.0493, 0.1581, -2.015, 0.2452, -1.1388, -0.2814, 1.6804))
    robot.controller.move(lin_move(end, 0.05, 0.0, -2.015))
    robot.runs_until_stopped()
    assert worst_loads(robot)["velocity"] <= 0.05 * VELOCITY_TOLERANCE

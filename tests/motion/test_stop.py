"""Stops: on the path, within 100 ms of simulated time, within the stop limits."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.stepped import ROBOTS, SteppedRobot, assert_within_limits, line_errors

STOP_S = 0.1
AWAY = (1.0, -0.2, -0.5, -0.2, 0.3, -0.5, -1.0)  # from home


def stops(robot: SteppedRobot) -> int:
    """Stops the robot; the ticks that took."""
    robot.stop()
    return robot.runs_until_stopped()


@pytest.mark.requirement("FRC003", "FRC013", "FRC016")
@pytest.mark.parametrize("robot_name", ROBOTS)
@pytest.mark.parametrize("rate_hz", [100, 500, 1000])
@settings(max_examples=15, deadline=None)
@given(after_s=st.floats(0.0, 1.2), speed=st.sampled_from([1.0, 0.3]))
def test_a_stop_ends_all_motion_within_100_ms(
    robot_name: str, rate_hz: int, after_s: float, speed: float
) -> None:
    robot = SteppedRobot(robot_name, 1.0 / rate_hz)
    frame, home = robot.controller.tool_frame(), robot.description.home
    robot.controller.joint_move(np.add(home, AWAY[: len(home)]).tolist(), [speed] * len(home))
    robot.controller.ptp_move(frame, 1.0, 0.0)
    robot.step(round(after_s * rate_hz))
    assert stops(robot) * robot.tick_s <= STOP_S + 1e-9
    rest = robot.controller.joints
    robot.step(100)
    assert robot.controller.joints == rest
    assert not robot.controller.moving
    assert_within_limits(robot)


@pytest.mark.requirement("FRC003")
@pytest.mark.parametrize("robot_name", ROBOTS)
@settings(max_examples=15, deadline=None)
@given(after=st.integers(1, 250))
def test_a_stopped_line_stays_on_its_line(robot_name: str, after: int) -> None:
    robot = SteppedRobot(robot_name)
    frame = robot.controller.tool_frame()
    target = frame._replace(y_mm=300.0, gamma=frame.gamma + 0.4)
    robot.controller.lin_move(target, 1.0, 0.0)
    robot.step(after)
    stops(robot)
    off_line_m, off_arc_rad = line_errors(robot, robot.joints, target)
    assert off_line_m < 1e-6
    assert off_arc_rad < 1e-6


@pytest.mark.requirement("FRC014", "FRC016")
def test_moves_sent_during_a_stop_start_where_it_ends() -> None:
    robot = SteppedRobot()
    robot.controller.joint_move([1.0, 0.5, -0.5, -1.2, 1.0, 1.0, -1.0], [1.0] * 7)
    robot.step(150)
    robot.stop()
    robot.step(10)
    robot.controller.joint_move([0.0] * 7, [0.5] * 7)
    frame = robot.tcp_frame([0.0] * 7)
    robot.runs_until_stopped()
    assert robot.controller.tool_frame() == pytest.approx(frame)
    assert_within_limits(robot)


def test_a_stop_before_the_first_tick_moves_nothing() -> None:
    robot = SteppedRobot()
    home = robot.controller.joints
    robot.controller.joint_move([0.0] * 7, [1.0] * 7)
    assert stops(robot) == 0
    robot.step(10)
    assert robot.controller.joints == home


def test_a_second_stop_changes_nothing() -> None:
    once, twice = SteppedRobot(), SteppedRobot()
    for robot in (once, twice):
        robot.controller.joint_move([0.0] * 7, [1.0] * 7)
        robot.step(200)
        robot.stop()
        robot.step(20)
    twice.controller.stop()
    once.runs_until_stopped()
    twice.runs_until_stopped()
    assert once.joints == twice.joints


def test_a_stop_near_the_end_of_a_move_never_overshoots() -> None:
    whole = SteppedRobot()
    whole.controller.joint_move([0.0] * 7, [1.0] * 7)
    ticks = whole.runs_until_stopped()
    for left in range(1, 60, 7):
        robot = SteppedRobot()
        robot.controller.joint_move([0.0] * 7, [1.0] * 7)
        robot.step(ticks - left)
        stops(robot)
        home = np.array(robot.description.home)
        assert (np.abs(robot.joints[-1]) <= np.abs(home) + 1e-12).all()
        assert (np.sign(robot.joints[-1]) * np.sign(home) >= 0.0).all()

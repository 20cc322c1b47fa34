"""Stops: on the path, within 100 ms of simulated time, within the stop limits."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.requests import joint_move, ptp_move
from tests.stepped import ALL_ROBOTS, ARMS, SteppedRobot, assert_within_limits

STOP_S = 0.1
AWAY = (1.0, -0.2, -0.5, -0.2, 0.3, -0.5, -1.0)  # from home
both = pytest.mark.parametrize("robot_name", ARMS)


def away_from_home(robot: SteppedRobot) -> list[float]:
    """Return joint positions at a distance."""
    home = robot.description.home
    away: list[float] = np.add(home, AWAY[: len(home)]).tolist()
    return away


def goes_away(robot: SteppedRobot) -> None:
    """Send the robot there at full speed."""
    to = away_from_home(robot)
    robot.controller.move(joint_move(to, [1.0] * len(to)))


def stops(robot: SteppedRobot) -> int:
    """Stop the robot; return the ticks until rest."""
    robot.stop()
    return robot.runs_until_stopped()


@pytest.mark.requirement("FRC003", "FRC013", "FRC016")
@pytest.mark.parametrize("robot_name", ALL_ROBOTS)
@given(
    rate_hz=st.sampled_from([100, 500, 1000]), after_s=st.floats(0.0, 1.2), speed=st.sampled_from([1.0, 0.3])
)
def test_a_stop_ends_all_motion_within_100_ms(
    robot_name: str, rate_hz: int, after_s: float, speed: float
) -> None:
    robot = SteppedRobot(robot_name, 1.0 / rate_hz)
    frame, away = robot.controller.tool_frame(), away_from_home(robot)
    robot.controller.move(joint_move(away, [speed] * len(away)))
    robot.controller.move(ptp_move(frame, 1.0, 0.0))
    robot.step(round(after_s * rate_hz))
    assert stops(robot) * robot.tick_s <= STOP_S + 1e-9
    rest = robot.controller.joints
    robot.step(100)
    assert robot.controller.joints == rest
    assert not robot.controller.moving
    assert_within_limits(robot)


@pytest.mark.requirement("FRC014", "FRC016")
@both
def test_moves_sent_during_a_stop_start_where_it_ends_and_a_second_stop_changes_nothing(
    robot_name: str,
) -> None:
    robot, twice = SteppedRobot(robot_name), SteppedRobot(robot_name)
    for each in (robot, twice):
        goes_away(each)
        each.step(150)
        each.stop()
        each.step(10)
    twice.controller.stop()
    twice.runs_until_stopped()
    assert robot.controller.motions.goal == twice.controller.joints
    target = [0.0] * len(robot.controller.joints)
    robot.controller.move(joint_move(target, [0.5] * len(target)))
    robot.runs_until_stopped()
    assert robot.controller.joints == tuple(target)
    assert_within_limits(robot)


@both
def test_a_stop_near_the_end_of_a_move_never_overshoots(robot_name: str) -> None:
    whole = SteppedRobot(robot_name)
    goes_away(whole)
    ticks = whole.runs_until_stopped()
    home, away = np.array(whole.joints[0]), np.array(whole.joints[-1])
    for left in range(1, 60, 7):
        robot = SteppedRobot(robot_name)
        goes_away(robot)
        robot.step(ticks - left)
        stops(robot)
        parts = (robot.joints[-1] - home) / (away - home)
        assert (parts <= 1.0 + 1e-12).all()
        assert (parts >= 0.0).all()

"""The goal: the end of the move under way, at every tick of blended chains, servos and stops."""

from __future__ import annotations

from math import dist

import numpy as np
import pytest

from tests.asked import joint_move, lin_move, smart_joint_move
from tests.stepped import SteppedRobot

FULL = [1.0] * 7
AWAY = (0.5, 0.3, -0.2, -1.0, 0.4, 1.0, -0.6)
ELSEWHERE = (-0.5, 0.6, 0.3, -1.4, 0.1, 1.2, 0.2)


def told(robot: SteppedRobot) -> tuple[float, ...]:
    """The goal, told in three ways that have to agree."""
    controller = robot.controller
    goal = controller.goal_joints
    assert controller.goal_frame() == robot.tcp_frame(goal)
    way_mm = dist(controller.tool_frame()[:3], controller.goal_frame()[:3])
    assert controller.distance_to_goal_mm() == pytest.approx(way_mm, abs=1e-9)
    return goal


@pytest.mark.requirement("FRC019")
def test_the_distance_falls_to_nothing_on_a_line() -> None:
    robot = SteppedRobot()
    frame = robot.controller.tool_frame()
    robot.controller.move(lin_move(frame._replace(y_mm=frame.y_mm + 150.0), 0.5, 0.0))
    distances = [robot.controller.distance_to_goal_mm()]
    while robot.controller.moving:
        robot.step()
        distances.append(robot.controller.distance_to_goal_mm())
    assert distances[0] == pytest.approx(150.0)
    assert (np.diff(distances) <= 1e-9).all()
    assert distances[-1] == 0.0


@pytest.mark.requirement("FRC019")
def test_of_a_servo_it_is_the_target_and_of_a_stop_its_end() -> None:
    robot = SteppedRobot()
    controller = robot.controller
    controller.move(smart_joint_move(AWAY, FULL))
    assert told(robot) == AWAY, "it has not begun to move"
    robot.step(80)
    assert told(robot) == AWAY
    controller.move(smart_joint_move(ELSEWHERE, FULL))
    assert told(robot) == ELSEWHERE
    robot.step(80)
    controller.move(joint_move(AWAY, FULL))
    rest = told(robot)
    assert rest not in (AWAY, ELSEWHERE), "first the robot stops"
    while told(robot) == rest:
        robot.step()
    assert robot.joints[-2:].count(rest) >= 1, "it has come to rest there"
    assert told(robot) == AWAY
    robot.step(80)
    controller.stop()
    rest = told(robot)
    robot.runs_until_stopped(0.1)
    assert told(robot) == rest == controller.joints

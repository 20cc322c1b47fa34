"""The goal: the end of the move under way, at every tick of blended chains, servos and stops."""

from __future__ import annotations

from math import dist

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.errors import Refused
from iiwa_sim.robot.description import load_robot
from tests.asked import joint_move, lin_move, ptp_move, smart_joint_move
from tests.chains import aimed, chains
from tests.stepped import ARMS, SteppedRobot

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
@given(data=st.data(), name=st.sampled_from(ARMS))
def test_in_a_chain_it_is_the_end_of_the_first_move_that_is_not_done(data: st.DataObject, name: str) -> None:
    chain = data.draw(chains(len(load_robot(name).joints), longest=4))
    robot = SteppedRobot(name)
    controller = robot.controller
    assert told(robot) == controller.joints
    scout = SteppedRobot(name, tick_s=0.05)  # runs each move alone, so that it rests at each target
    ends: list[tuple[int, tuple[float, ...]]] = []
    for item in chain:
        end = scout.controller.joints
        _, frame = aimed(item, scout, end, (end, end))
        straight = item.kind.startswith("lin")
        try:
            for each, blending_mm in ((scout.controller, 0.0), (controller, 30.0)):
                number = each.move((lin_move if straight else ptp_move)(frame, 1.0, blending_mm))
        except Refused:
            continue
        scout.runs_until_stopped()
        ends.append((number, scout.controller.joints))
        for _ in range(item.wait):
            pending = [end for number, end in ends if controller.is_pending(number)]
            assert told(robot) == pytest.approx(pending[0] if pending else robot.joints[-1], abs=1e-9)
            robot.step()
    while controller.moving:
        pending = [end for number, end in ends if controller.is_pending(number)]
        assert told(robot) == pytest.approx(pending[0], abs=1e-9)
        robot.step()
    assert told(robot) == controller.joints
    assert controller.distance_to_goal_mm() == 0.0


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

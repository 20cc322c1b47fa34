"""Cancelling a move and clearing the queue: ended moves, and those that follow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from iiwa_sim.controller.errors import ErrorRecord
from iiwa_sim.controller.modes import Mode
from iiwa_sim.controller.requests import MoveRequest
from iiwa_sim.robot.description import load_robot
from iiwa_sim.robot.nearest import JOINT_LIMIT
from tests.requests import direct_joint_move, joint_move, lin_joint_move, lin_move, ptp_move, smart_joint_move
from tests.sequences import ROOMY
from tests.stepped import ARMS, SteppedRobot, assert_straight, assert_within_limits

FULL = [1.0] * 7


@pytest.mark.requirement("FRC013", "FRC014")
def test_the_next_move_begins_when_the_robot_has_come_to_rest() -> None:
    robot, stopped = SteppedRobot(), SteppedRobot()
    there = [0.0, 0.5, 0.0, -1.0, 0.0, 1.0, 0.0]
    for each in (robot, stopped):
        each.controller.move(joint_move([1.0, 0.5, -0.5, -1.2, 1.0, 1.0, -1.0], FULL))
        first, second = 1, each.controller.move(joint_move(there, FULL))
        each.step(100)
    robot.cancel()
    assert not robot.controller.motions.is_pending(first)
    assert robot.controller.motions.is_pending(second)
    assert robot.controller.motions.behind == 1
    stopped.stop()
    ticks = stopped.runs_until_stopped()
    robot.step(ticks)
    assert robot.joints == stopped.joints
    stopped.controller.move(joint_move(there, FULL))
    stopped.runs_until_stopped()
    robot.runs_until_stopped()
    assert robot.joints == stopped.joints
    assert robot.controller.joints == tuple(there)


@pytest.mark.requirement("FRC013")
def test_while_the_robot_stops_or_rests_there_is_nothing_to_cancel() -> None:
    once, often = SteppedRobot(), SteppedRobot()
    often.cancel()
    often.controller.clear_queue()
    assert not often.controller.moving
    for robot in (once, often):
        for k in range(3):
            robot.controller.move(joint_move([0.3 * k, 0.5, 0.0, -1.0, 0.0, 1.0, 0.0], FULL))
        robot.step(60)
        robot.cancel()
    for _ in range(5):
        often.step(1)
        often.cancel()
    once.step(5)
    for robot in (once, often):
        robot.runs_until_stopped()
    assert once.joints == often.joints


@pytest.mark.requirement("FRC014", "FRC021")
def test_a_move_impossible_from_there_is_reported_and_dropped_with_those_behind_it() -> None:
    robot = SteppedRobot()
    mirrored = [0.0, -0.5, 0.0, 1.0, 0.0, -0.8, 0.0]
    beside = [0.1, -0.5, 0.0, 1.0, 0.0, -0.8, 0.0]
    numbers = [
        robot.controller.move(joint_move(mirrored, FULL)),
        robot.controller.move(ptp_move(robot.tcp_frame(mirrored)._replace(z_mm=700.0), 1.0, 0.0)),
        robot.controller.move(lin_joint_move(beside, 1.0, 0.0)),  # only with the arm on that branch
        robot.controller.move(joint_move([0.0] * 7, FULL)),
    ]
    robot.step(10)
    robot.cancel()
    assert robot.controller.motions.behind == 3
    assert robot.faults == []
    robot.step(2)
    assert robot.controller.motions.behind == 1
    assert [robot.controller.motions.is_pending(number) for number in numbers] == [False, True, False, False]
    ((code, reason),) = robot.faults
    assert code == JOINT_LIMIT, reason
    assert f"move {numbers[2]} and those behind it are forgotten" in reason
    assert robot.controller.errors.last == ErrorRecord(code, reason)
    robot.runs_until_stopped()
    assert robot.controller.tool_frame().z_mm == pytest.approx(700.0)
    assert len(robot.faults) == 1
    assert robot.controller.mode is Mode.NORMAL
    robot.controller.move(joint_move(mirrored, FULL))
    robot.runs_until_stopped()
    assert robot.controller.joints == tuple(mirrored)
    assert_within_limits(robot)


def test_cancelling_before_the_start_drops_a_move_that_is_impossible_from_there() -> None:
    robot = SteppedRobot()
    for bent in (0.0, 0.1):  # the second one, a line, begins on the other branch
        target = [bent, -0.5, 0.0, 1.0, 0.0, -0.8, 0.0]
        robot.controller.move(lin_joint_move(target, 1.0, 0.0) if bent else joint_move(target, FULL))
    robot.cancel()
    robot.step(2)
    assert [code for code, _ in robot.faults] == [JOINT_LIMIT]
    assert not robot.controller.moving
    assert robot.controller.errors.standing is None


@pytest.mark.requirement("FRC016")
@pytest.mark.parametrize("name", ARMS)
def test_a_running_move_that_was_blended_into_a_cleared_one_ends_exactly(name: str) -> None:
    robots = [SteppedRobot(replace(load_robot(name), home=ROOMY[name])) for _ in range(2)]
    robot, alone = robots
    here = robot.controller.tool_frame()
    side = here._replace(y_mm=here.y_mm + 200.0)
    for each, blending_mm in ((robot, 40.0), (alone, 0.0)):
        each.controller.move(lin_move(side, 1.0, blending_mm))
    robot.controller.move(lin_move(side._replace(z_mm=here.z_mm - 200.0), 1.0, 0.0))
    robot.step(100)
    assert robot.clears_queue(1)
    assert robot.controller.motions.behind == 0
    for each in robots:
        each.runs_until_stopped()
        assert_straight(each, each.joints, side)
        assert_within_limits(each)
    assert robot.controller.joints == alone.controller.joints
    assert len(robot.joints) <= 1.05 * len(alone.joints)


@pytest.mark.requirement("FRC013", "FRC016")
@pytest.mark.parametrize("move", [smart_joint_move, direct_joint_move])
def test_a_cancelled_servo_target_is_given_up_and_the_mode_stays(move: Callable[..., MoveRequest]) -> None:
    robot, stopped = SteppedRobot(), SteppedRobot()
    home = robot.controller.joints
    near = tuple(np.add(home, 0.06).tolist())
    for each in (robot, stopped):
        each.controller.move(move(near, FULL))
        each.step(20)
    mode = robot.controller.mode
    robot.cancel()
    stopped.stop()
    for each in (robot, stopped):
        each.runs_until_stopped()
    assert robot.controller.mode is mode
    assert robot.controller.joints == stopped.controller.joints != near
    robot.controller.move(move(near, FULL))
    robot.controller.clear_queue()
    robot.runs_until_stopped()
    assert robot.controller.joints == near
    assert_within_limits(robot)

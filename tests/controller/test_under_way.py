"""Whether the robot will stop by itself: then a clock in haste may run on."""

import pytest

from tests.asked import gravity_hold, joint_move, ptp_stiff_move
from tests.stepped import SteppedRobot

THERE = [0.3, 0.5, 0.0, -1.0, 0.0, 1.5, 0.0]


def test_a_move_is_under_way_until_the_robot_stops() -> None:
    robot = SteppedRobot()
    assert not robot.controller.under_way
    robot.controller.move(joint_move(THERE, [1.0] * 7))
    while robot.controller.moving:
        assert robot.controller.under_way
        robot.step()
    assert not robot.controller.under_way


def test_a_pause_is_under_way_until_the_robot_stands_and_again_when_it_ends() -> None:
    robot = SteppedRobot()
    robot.controller.move(joint_move(THERE, [0.1] * 7))
    robot.step(100)
    robot.controller.set_override(0.0)
    ticks = 0
    while robot.controller.under_way:
        robot.step()
        ticks += 1
    assert 1 < ticks < 500
    assert robot.controller.moving
    robot.controller.set_override(1.0)
    robot.step()
    assert robot.controller.under_way
    robot.runs_until_stopped()


def test_a_stiffness_move_is_under_way_and_a_gravity_hold_is_not() -> None:
    robot = SteppedRobot()
    controller = robot.controller
    frame = robot.tcp_frame(THERE)
    controller.move(ptp_stiff_move(frame, 1.0, 1000.0, [0.0] * 6))
    ticks = 0
    while controller.under_way:
        robot.step()
        ticks += 1
    assert ticks > 100
    assert robot.tcp_frame(controller.joints) == pytest.approx(frame, abs=1e-3)
    controller.move(gravity_hold(300.0))
    robot.step(100)
    assert controller.moving
    assert not controller.under_way
    controller.stop()
    robot.runs_until_stopped()
    assert not controller.under_way

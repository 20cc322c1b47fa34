"""State of a controller: goal, moves, snapshot, and `under_way`."""

from __future__ import annotations

from math import dist

import numpy as np
import pytest

from iiwa_sim.controller.errors import ErrorRecord
from iiwa_sim.controller.state import Snapshot, snapshot
from iiwa_sim.frames import Frame
from tests.requests import gravity_hold, joint_move, lin_move, lin_stiff_move, ptp_move, smart_joint_move
from tests.states import SCHEMA
from tests.stepped import SteppedRobot

FULL = [1.0] * 7
AWAY = (0.5, 0.3, -0.2, -1.0, 0.4, 1.0, -0.6)
ELSEWHERE = (-0.5, 0.6, 0.3, -1.4, 0.1, 1.2, 0.2)
READY = (0.0, 0.4, 0.0, -1.2, 0.0, 1.2, 0.0)
NO_FORCE = [0.0] * 6


def checked_goal(robot: SteppedRobot) -> tuple[float, ...]:
    """Return the goal, of which joints, frame and distance have to agree."""
    controller = robot.controller
    goal = controller.motions.goal
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
        robot.step(5)
        distances.append(robot.controller.distance_to_goal_mm())
    assert distances[0] == pytest.approx(150.0)
    assert (np.diff(distances) <= 1e-9).all()
    assert distances[-1] == 0.0


@pytest.mark.requirement("FRC019")
def test_the_goal_of_a_servo_is_its_target_and_of_a_stop_its_end() -> None:
    robot = SteppedRobot()
    controller = robot.controller
    controller.move(smart_joint_move(AWAY, FULL))
    assert checked_goal(robot) == AWAY, "it has not begun to move"
    robot.step(80)
    controller.move(smart_joint_move(ELSEWHERE, FULL))
    assert checked_goal(robot) == ELSEWHERE
    robot.step(80)
    controller.move(joint_move(AWAY, FULL))
    rest = checked_goal(robot)
    assert rest not in (AWAY, ELSEWHERE), "first the robot stops"
    while checked_goal(robot) == rest:
        robot.step()
    assert robot.joints[-2:].count(rest) >= 1, "it has come to rest there"
    assert checked_goal(robot) == AWAY
    robot.step(80)
    controller.stop()
    rest = checked_goal(robot)
    robot.runs_until_stopped(0.1)
    assert checked_goal(robot) == rest == controller.joints


def aside(robot: SteppedRobot, y_mm: float) -> Frame:
    """Beside where the queue ends."""
    there = robot.controller.tool_frame(robot.controller.end_of_queue)
    return there._replace(y_mm=there.y_mm + y_mm)


def test_moves_that_run_or_wait_are_counted() -> None:
    robot = SteppedRobot()
    controller = robot.controller
    assert controller.motions.count == 0
    controller.move(joint_move(READY, FULL))
    controller.move(lin_move(aside(robot, 100.0), 0.5, 30.0))
    controller.move(ptp_move(aside(robot, 60.0), 0.5, 0.0))
    while robot.controller.moving:
        assert controller.motions.count == controller.motions.behind + 1
        robot.step(20)
    assert controller.motions.count == 0


def test_the_schema_describes_every_field_and_no_other() -> None:
    for struct, schema in ((Snapshot, SCHEMA), (ErrorRecord, SCHEMA["properties"]["error"])):
        of_each_robot = [name for name in schema["properties"] if name != "robot"]
        assert of_each_robot == schema["required"] == [*struct.__struct_fields__]


@pytest.mark.requirement("FRA007", "FRC017", "FRC018")
def test_a_snapshot_agrees_with_the_controller() -> None:
    robot = SteppedRobot()
    controller = robot.controller
    controller.load.wrench = (1.0, 2.0, 3.0, 0.1, 0.2, 0.3)
    controller.move(joint_move(AWAY, FULL))
    while controller.moving:
        robot.step(50)
        seen = snapshot(controller)
        assert seen.tick == controller.tick
        assert seen.time_s == round(controller.tick * robot.tick_s, 3)
        assert seen.mode == "normal"
        assert seen.status == ("moving" if controller.moving else "stopped")
        assert seen.joint_position == controller.joints
        assert seen.flange_frame == controller.flange_frame()
        assert seen.tool_frame == controller.tool_frame()
        assert seen.cartesian_force == (1.0, 2.0, 3.0, 0.1, 0.2, 0.3)
        assert seen.joint_torque == controller.joint_torque()
    assert snapshot(controller).status == "stopped"


def test_under_way_is_true_if_the_robot_will_stop_without_a_command() -> None:
    robot = SteppedRobot()
    controller = robot.controller
    assert not controller.under_way
    controller.move(joint_move(AWAY, [0.1] * 7))
    robot.step(100)
    assert controller.under_way
    controller.set_override(0.0)
    robot.step(100)
    assert controller.moving
    assert not controller.under_way, "a pause"
    controller.set_override(1.0)
    robot.step()
    while controller.moving:
        assert controller.under_way
        robot.step()
    assert not controller.under_way
    frame = robot.tcp_frame(ELSEWHERE)
    controller.move(lin_stiff_move(frame, 1.0, 1000.0, NO_FORCE))
    assert controller.motions.count == 1
    while controller.under_way:
        robot.step()
    assert controller.tool_frame() == pytest.approx(frame, abs=1e-3)
    controller.move(gravity_hold(300.0))
    robot.step(100)
    assert controller.moving
    assert not controller.under_way, "a hold lasts until a command"
    assert controller.motions.count == 0
    controller.stop()
    robot.runs_until_stopped()
    assert not controller.under_way

"""Faults made on purpose, the drives, and what only a test bench does: place the robot, change its tool."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import (
    COMMUNICATION_FAILURE,
    COMPONENT_NOT_READY,
    EMERGENCY_STOP,
    ErrorRecord,
    Refused,
)
from iiwa_sim.controller.modes import Mode
from iiwa_sim.frames import Frame, compose
from tests.asked import joint_move, lin_joint_move, lin_move, smart_joint_move
from tests.stepped import ARMS, SteppedRobot, assert_within_limits

AWAY = [0.5, 0.3, -0.2, -1.0, 0.4, 1.0, -0.6]
WAYS = {
    ARMS[0]: (AWAY, [0.0, 0.6, 0.0, -1.2, 0.0, 1.4, 0.0]),
    ARMS[1]: ([0.5, -1.2, 1.3, 0.4, 1.3, -0.6], [0.0, -1.5, 1.6, 0.0, 1.4, 0.0]),
}
FULL = [1.0] * 7
REASON = "made to fail"
CODE = 4711

STOPPERS: dict[str, tuple[Callable[[Controller], None], ErrorRecord]] = {
    "fault": (lambda controller: controller.fail(CODE, REASON), ErrorRecord(CODE, REASON)),
    "drives off": (
        lambda controller: controller.switch_drives(on=False),
        ErrorRecord(COMPONENT_NOT_READY, "the drives are off"),
    ),
    "emergency stop": (Controller.emergency_stop, ErrorRecord(EMERGENCY_STOP, "emergency stop")),
}


@pytest.mark.requirement("FRC021", "FRC026")
@given(name=st.sampled_from(ARMS), how=st.sampled_from(sorted(STOPPERS)), ticks=st.integers(0, 400))
def test_the_robot_stops_on_its_path_and_what_waits_is_forgotten(name: str, how: str, ticks: int) -> None:
    robot, undisturbed = SteppedRobot(name), SteppedRobot(name)
    away, back = WAYS[name]
    for each in (robot, undisturbed):
        each.controller.move(joint_move(away, [1.0] * len(away)))
        each.controller.move(lin_joint_move(back, 1.0, 0.0))
        each.step(ticks)
    undisturbed.runs_until_stopped()
    stops, cause = STOPPERS[how]
    robot.notice_mode()
    stops(robot.controller)
    robot.runs_until_stopped(0.1)
    assert_within_limits(robot)
    way = np.array(undisturbed.joints)
    off = np.abs(way - np.array(robot.controller.joints)).max(axis=1).min()
    fastest = np.abs(np.diff(way, axis=0)).max()
    assert off <= fastest, "it rests between two places of the way it was on"
    assert robot.controller.last_error == cause
    assert robot.faults == [cause], "and the log hears of it"
    status = robot.controller.status()
    assert (status.in_error, status.error_code, status.motion_possible) == (1, cause.code, 0)
    assert status.drives_powered == (how == "fault")
    assert status.e_stopped == (how == "emergency stop")
    with pytest.raises(Refused, match="no move before reset error"):
        robot.controller.move(joint_move(away, [1.0] * len(away)))


def test_drives_have_to_be_on_again_before_a_reset() -> None:
    controller = SteppedRobot().controller
    controller.switch_drives(on=False)
    with pytest.raises(Refused, match="the drives have to be switched on first") as refused:
        controller.reset_error()
    assert refused.value.code == COMPONENT_NOT_READY
    controller.switch_drives(on=True)
    assert controller.status().drives_powered == 0, "not before the reset"
    controller.reset_error()
    assert controller.status().drives_powered == 1
    controller.move(joint_move(AWAY, FULL))


def test_the_next_move_is_refused_once_and_changes_nothing() -> None:
    robot = SteppedRobot()
    controller = robot.controller
    controller.move(joint_move(AWAY, FULL))
    robot.step(20)
    controller.errors.next_refusal = ErrorRecord(CODE, REASON)
    with pytest.raises(Refused, match=REASON) as refused:
        controller.move(smart_joint_move(AWAY, FULL))
    assert refused.value.code == CODE
    assert controller.mode is Mode.NORMAL
    assert controller.status().in_error == 0
    controller.move(joint_move([0.0, 0.5, 0.0, -1.0, 0.0, 1.5, 0.0], FULL))
    robot.runs_until_stopped()
    assert controller.joints == (0.0, 0.5, 0.0, -1.0, 0.0, 1.5, 0.0)


@pytest.mark.parametrize("timeout_s", [None, 60.0])
def test_a_servo_times_out_at_once(timeout_s: float | None) -> None:
    robot = SteppedRobot(servo_timeout_s=timeout_s)
    robot.controller.move(smart_joint_move(AWAY, FULL))
    robot.step(50)
    robot.controller.time_out_servo()
    assert robot.controller.mode is Mode.UNKNOWN
    assert robot.faults == [(COMMUNICATION_FAILURE, "no smart command in time: the robot stops")]
    assert robot.controller.status().error_code == COMMUNICATION_FAILURE
    robot.runs_until_stopped(0.1)


@pytest.mark.parametrize("before", ["nothing", "normal", "smart"])
def test_the_robot_is_placed_and_goes_on_from_there(before: str) -> None:
    robot = SteppedRobot()
    controller = robot.controller
    if before == "normal":
        controller.move(joint_move([0.0, 0.5, 0.0, -1.0, 0.0, 1.5, 0.0], FULL))
    elif before == "smart":
        controller.move(smart_joint_move([0.0, 0.5, 0.0, -1.0, 0.0, 1.5, 0.0], FULL))
    robot.runs_until_stopped()
    controller.place(AWAY)
    assert controller.joints == controller.goal_joints == tuple(AWAY)
    assert controller.joint_velocity() == (0.0,) * 7
    assert controller.mode is Mode.UNKNOWN
    controller.step()
    assert controller.joints == tuple(AWAY)
    for go in (joint_move, smart_joint_move):
        robot.joints, robot.stopping, robot.direct = [controller.joints], [False], [False]
        controller.move(go([0.1, 0.5, 0.1, -1.0, 0.1, 1.5, 0.1], FULL))
        robot.runs_until_stopped()
        assert_within_limits(robot)
        assert controller.joints == pytest.approx((0.1, 0.5, 0.1, -1.0, 0.1, 1.5, 0.1), abs=1e-9)
        controller.place(AWAY)


def test_a_robot_that_moves_is_neither_placed_nor_given_another_tool() -> None:
    robot = SteppedRobot()
    controller = robot.controller
    controller.move(joint_move(AWAY, FULL))
    robot.step(20)
    controller.stop()
    robot.step()
    tool = controller.tool_in_flange
    for change in (
        lambda: controller.place(AWAY),
        lambda: controller.set_tool(Frame(0, 0, 99, 0, 0, 0).to_transform()),
    ):
        with pytest.raises(Refused, match="the robot has to be at rest, with nothing waiting"):
            change()
    assert controller.tool_in_flange == tool
    robot.runs_until_stopped(0.1)
    assert_within_limits(robot)


def test_a_new_tool_is_where_the_tcp_is_and_what_moves_are_for() -> None:
    robot = SteppedRobot()
    controller = robot.controller
    tool = Frame(10.0, -20.0, 200.0, 0.1, 0.2, 0.3).to_transform()
    controller.set_tool(tool)
    expected = Frame.from_transform(compose(robot.model.flange(controller.joints), tool))
    assert controller.tool_frame() == pytest.approx(expected, abs=1e-9)
    target = expected._replace(y_mm=expected.y_mm + 50.0)
    controller.move(lin_move(target, 0.5, 0.0))
    robot.runs_until_stopped()
    assert controller.tool_frame() == pytest.approx(target, abs=1e-6)

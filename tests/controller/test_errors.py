"""The error state: its causes, rejected commands and reset; and faults set by the backdoor."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.endings import Ending
from iiwa_sim.controller.errors import (
    COMMUNICATION_FAILURE,
    COMPONENT_NOT_READY,
    EMERGENCY_STOP,
    EXECUTION,
    ErrorRecord,
    Refused,
)
from iiwa_sim.controller.modes import Mode
from iiwa_sim.frames import Frame, compose
from tests.protocols.fake_robot import Conversation
from tests.requests import (
    direct_cartesian_move,
    direct_joint_move,
    joint_move,
    lin_joint_move,
    lin_move,
    ptp_move,
    smart_joint_move,
)
from tests.stepped import ARMS, SteppedRobot, assert_within_limits

AWAY = [0.5, 0.3, -0.2, -1.0, 0.4, 1.0, -0.6]
BACK = [0.0, 0.6, 0.0, -1.2, 0.0, 1.4, 0.0]
WAYS = {ARMS[0]: (AWAY, BACK), ARMS[1]: ([0.5, -1.2, 1.3, 0.4, 1.3, -0.6], [0.0, -1.5, 1.6, 0.0, 1.4, 0.0])}
FULL = [1.0] * 7
REASON = "made to fail"
CODE = 4711

MOVES: list[Callable[[Controller], object]] = [
    lambda controller: controller.move(joint_move(AWAY, FULL)),
    lambda controller: controller.move(ptp_move(controller.tool_frame(), 1.0, 0.0)),
    lambda controller: controller.move(lin_move(controller.tool_frame(), 1.0, 0.0)),
    lambda controller: controller.move(lin_joint_move(controller.joints, 1.0, 0.0)),
    lambda controller: controller.move(smart_joint_move(AWAY, FULL)),
    lambda controller: controller.move(direct_joint_move(controller.joints, FULL)),
    lambda controller: controller.move(direct_cartesian_move(controller.flange_frame(), 1.0)),
]
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
def test_the_robot_stops_on_its_path_and_waiting_moves_are_dropped(name: str, how: str, ticks: int) -> None:
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
    path = np.array(undisturbed.joints)
    off = np.abs(path - np.array(robot.controller.joints)).max(axis=1).min()
    assert off <= np.abs(np.diff(path, axis=0)).max(), "it rests between two places of its path"
    assert robot.controller.errors.last == cause
    assert robot.faults == [(cause.code, cause.reason)], "and in the log"
    status = robot.controller.status()
    assert (status.in_error, status.error_code, status.motion_possible) == (1, cause.code, 0)
    assert status.drives_powered == (how == "fault")
    assert status.e_stopped == (how == "emergency stop")


def times_out(robot: SteppedRobot, _: pytest.MonkeyPatch) -> int:
    robot.controller.move(smart_joint_move(AWAY, FULL))
    robot.step(26)
    return COMMUNICATION_FAILURE


def breaks(robot: SteppedRobot, patch: pytest.MonkeyPatch) -> int:
    def broken() -> None:
        raise ZeroDivisionError

    endings: list[Ending] = []
    robot.controller.endings.listeners.append(endings.append)
    robot.controller.move(joint_move(AWAY, FULL))
    robot.controller.move(joint_move([0.0] * 7, FULL))
    robot.step(50)
    with patch.context() as broken_for_a_tick:
        broken_for_a_tick.setattr(robot.controller.motions, "step", broken)
        with pytest.raises(ZeroDivisionError):
            robot.controller.step()
    assert [(ending.move, ending.code) for ending in endings] == [(1, EXECUTION), (2, EXECUTION)]
    return EXECUTION


def is_stopped(robot: SteppedRobot, _: pytest.MonkeyPatch) -> int:
    robot.controller.move(joint_move(AWAY, FULL))
    robot.step(50)
    robot.controller.emergency_stop()
    robot.controller.emergency_stop(pressed=False)
    return EMERGENCY_STOP


@pytest.mark.requirement("FRC021", "FRC026")
@pytest.mark.parametrize("fails", [times_out, breaks, is_stopped])
def test_an_error_refuses_moves_until_it_is_reset(
    fails: Callable[[SteppedRobot, pytest.MonkeyPatch], int], monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = SteppedRobot(servo_timeout_s=0.05)
    code = fails(robot, monkeypatch)
    controller = robot.controller
    assert controller.mode is Mode.UNKNOWN
    robot.runs_until_stopped(0.1)
    rest = controller.joints
    cause = controller.errors.last
    assert cause is not None
    assert cause.code == code
    for move in MOVES:
        with pytest.raises(Refused, match="no move before reset error: ") as refused:
            move(controller)
        assert refused.value.code == code
        controller.errors.record(refused.value.code, refused.value.reason)
        assert controller.errors.last is cause, "the cause is reported as long as it lasts"
    robot.step(10)
    assert controller.joints == rest
    controller.errors.reset()
    assert controller.errors.last is None
    assert controller.status() == (2, 0, 1, 1, 0, 0, 0)
    for move in MOVES:
        move(controller)
        robot.step(20)
        controller.stop()
        robot.step(60)


@pytest.mark.requirement("FRC021", "FRC026")
def test_an_emergency_stop_has_to_be_released_before_the_reset() -> None:
    robot = SteppedRobot()
    talk = Conversation(robot.controller)
    talk.ask("joint move : 1 0.5 0 -1 0 1 0 1 1 1 1 1 1 1")
    robot.step(100)
    assert talk.ask("get robot status") == "2 0 1 1 1 0 0"
    robot.controller.emergency_stop()
    assert talk.ask("get status") == "moving"
    assert talk.ask("get robot status") == "2 1 0 0 1 1 3030"
    robot.runs_until_stopped(0.1)
    assert talk.ask("reset error") == "error"
    assert talk.ask("get error") == "3030 emergency stop"
    robot.controller.emergency_stop(pressed=False)
    assert talk.ask("get robot status") == "2 0 0 0 0 1 3030"
    assert talk.ask("lin move : 450 100 520 0 -1.57 0 1 0") == "error"
    assert talk.ask("reset error") == "done"
    assert talk.ask("get robot status") == "2 0 1 1 0 0 0"
    assert talk.ask("get error") == "0 none"


def test_drives_have_to_be_on_again_before_a_reset() -> None:
    controller = SteppedRobot().controller
    controller.switch_drives(on=False)
    with pytest.raises(Refused, match="the drives have to be switched on first") as refused:
        controller.errors.reset()
    assert refused.value.code == COMPONENT_NOT_READY
    controller.switch_drives(on=True)
    assert controller.status().drives_powered == 0, "not before the reset"
    controller.errors.reset()
    assert controller.status().drives_powered == 1
    controller.move(joint_move(AWAY, FULL))


# Faults set by the backdoor


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
    controller.move(joint_move(BACK, FULL))
    robot.runs_until_stopped()
    assert controller.joints == tuple(BACK)


@pytest.mark.parametrize("go", [joint_move, smart_joint_move])
def test_a_placed_robot_moves_from_its_new_position(go: Callable[..., object]) -> None:
    robot = SteppedRobot()
    controller = robot.controller
    controller.move(go(BACK, FULL))
    robot.runs_until_stopped()
    controller.place(AWAY)
    assert controller.joints == controller.motions.goal == tuple(AWAY)
    assert controller.joint_velocity() == (0.0,) * 7
    assert controller.mode is Mode.UNKNOWN
    controller.step()
    assert controller.joints == tuple(AWAY)
    robot.joints, robot.stopping, robot.direct = [controller.joints], [False], [False]
    controller.move(go(BACK, FULL))
    robot.runs_until_stopped()
    assert_within_limits(robot)
    assert controller.joints == tuple(BACK)


def test_a_robot_that_moves_is_neither_placed_nor_given_another_tool() -> None:
    robot = SteppedRobot()
    controller = robot.controller
    controller.move(joint_move(AWAY, FULL))
    robot.step(20)
    controller.stop()
    robot.step()
    with pytest.raises(Refused, match="the robot has to be at rest, with nothing waiting"):
        controller.place(AWAY)


def test_a_new_tool_changes_the_tcp_of_frames_and_moves() -> None:
    robot = SteppedRobot()
    controller = robot.controller
    tool = Frame(10.0, -20.0, 200.0, 0.1, 0.2, 0.3).to_transform()
    controller.place(controller.joints, tool)
    expected = Frame.from_transform(compose(robot.model.flange(controller.joints), tool))
    assert controller.tool_frame() == pytest.approx(expected, abs=1e-9)
    target = expected._replace(y_mm=expected.y_mm + 50.0)
    controller.move(lin_move(target, 0.5, 0.0))
    robot.runs_until_stopped()
    assert controller.tool_frame() == pytest.approx(target, abs=1e-6)

"""The error state: what begins it, what it refuses, how it ends."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, EMERGENCY_STOP, EXECUTION, Refused
from iiwa_sim.controller.modes import Mode
from iiwa_sim.motion.executor import Executor
from iiwa_sim.robot.nearest import JOINT_LIMIT
from tests.asked import (
    direct_cartesian_move,
    direct_joint_move,
    joint_move,
    lin_joint_move,
    lin_move,
    ptp_move,
    smart_cartesian_move,
    smart_joint_move,
)
from tests.protocols.fake_robot import Conversation
from tests.stepped import SteppedRobot, assert_within_limits

AWAY = [0.5, 0.3, -0.2, -1.0, 0.4, 1.0, -0.6]
FULL = [1.0] * 7

MOVES: list[Callable[[Controller], object]] = [
    lambda controller: controller.move(joint_move(AWAY, FULL)),
    lambda controller: controller.move(ptp_move(controller.tool_frame(), 1.0, 0.0)),
    lambda controller: controller.move(lin_move(controller.tool_frame(), 1.0, 0.0)),
    lambda controller: controller.move(lin_joint_move(controller.joints, 1.0, 0.0)),
    lambda controller: controller.move(smart_joint_move(AWAY, FULL)),
    lambda controller: controller.move(smart_cartesian_move(controller.flange_frame(), 1.0)),
    lambda controller: controller.move(direct_joint_move(controller.joints, FULL)),
    lambda controller: controller.move(direct_cartesian_move(controller.flange_frame(), 1.0)),
]


def times_out(robot: SteppedRobot, _: pytest.MonkeyPatch) -> int:
    robot.controller.move(smart_joint_move(AWAY, FULL))
    robot.step(26)
    return COMMUNICATION_FAILURE


def breaks(robot: SteppedRobot, patch: pytest.MonkeyPatch) -> int:
    def broken(_: Executor) -> None:
        raise ZeroDivisionError

    robot.controller.move(joint_move(AWAY, FULL))
    robot.controller.move(joint_move([0.0] * 7, FULL))
    robot.step(50)
    with patch.context() as broken_for_a_tick:
        robot.controller.motions.executor._ahead.clear()
        broken_for_a_tick.setattr(Executor, "_advance", broken)
        with pytest.raises(ZeroDivisionError):
            robot.controller.step()
    return EXECUTION


def is_stopped(robot: SteppedRobot, _: pytest.MonkeyPatch) -> int:
    robot.controller.move(joint_move(AWAY, FULL))
    robot.controller.move(joint_move([0.0] * 7, FULL))
    robot.step(50)
    robot.controller.emergency_stop()
    robot.controller.release_emergency_stop()
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
    assert controller.last_error is not None
    cause = controller.last_error
    assert cause.code == code
    for move in MOVES:
        with pytest.raises(Refused, match="no move before reset error: ") as refused:
            move(controller)
        assert refused.value.code == code
        controller.record_error(refused.value.code, refused.value.reason)
        assert controller.last_error is cause, "the cause is told as long as it stands"
        assert not controller.moving
    robot.step(10)
    assert controller.joints == rest
    status = controller.status()
    assert (status.in_error, status.error_code, status.motion_possible) == (1, code, 0)
    controller.reset_error()
    assert controller.last_error is None
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
    assert_within_limits(robot)
    assert talk.ask("reset error") == "error"
    assert talk.ask("get error") == "3030 emergency stop"
    robot.controller.release_emergency_stop()
    assert talk.ask("get robot status") == "2 0 0 0 0 1 3030"
    assert talk.ask("lin move : 450 100 520 0 -1.57 0 1 0") == "error"
    assert talk.ask("reset error") == "done"
    assert talk.ask("get robot status") == "2 0 1 1 0 0 0"
    assert talk.ask("get error") == "0 none"
    assert talk.ask("joint move : 0 0 0 0 0 0 0 1 1 1 1 1 1 1") == "done"


@pytest.mark.requirement("FRC021")
def test_a_refused_command_is_no_state_of_error() -> None:
    robot = SteppedRobot()
    talk = Conversation(robot.controller)
    assert talk.ask("joint move : 9 0 0 0 0 0 0 1 1 1 1 1 1 1") == "error"
    assert talk.ask("get error").startswith(f"{JOINT_LIMIT} A1")
    assert talk.ask("get robot status") == "2 0 1 1 0 0 0"
    assert talk.ask("joint move : 0 0 0 0 0 0 0 1 1 1 1 1 1 1") == "done"
    assert talk.ask("get error").startswith(f"{JOINT_LIMIT} A1")
    assert talk.ask("reset error") == "done"
    assert talk.ask("get error") == "0 none"

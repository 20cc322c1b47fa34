"""What is on its way where Ruckig finds none for a while, with a stand-in for it that says so."""

from __future__ import annotations

from typing import Any

import pytest
import ruckig

from iiwa_sim.motion import courses
from tests.asked import ptp_stiff_move, smart_joint_move
from tests.stepped import ARMS, SteppedRobot, assert_within_limits

AWAY = {7: [0.6, 0.7, 0.1, -1.0, 0.5, 0.8, -0.2], 6: [0.6, -1.2, 1.3, 0.5, 1.1, -0.2]}
"""By the number of axes."""
NO_FORCE = [0.0] * 6
WAYS_OF_HOURS = ValueError("-101 is not a valid Result")
"""What its bindings raise for a result that its C++ has and they do not know: the way takes hours."""


class AtTimesNone:
    """Ruckig; while `raises` says what, it finds no way."""

    raises: Exception | None = None

    def __init__(self, axes: int) -> None:
        self._real = ruckig.Ruckig(axes)

    def calculate(self, *arguments: Any) -> ruckig.Result:
        if self.raises is not None:
            raise self.raises
        return self._real.calculate(*arguments)


@pytest.fixture
def robot(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> SteppedRobot:
    monkeypatch.setattr(AtTimesNone, "raises", None)
    monkeypatch.setattr(courses, "Ruckig", AtTimesNone)
    return SteppedRobot(request.param)


@pytest.mark.parametrize(("robot", "ticks"), [(ARMS[0], 600), (ARMS[1], 1)], indirect=["robot"])
def test_a_stiffness_move_in_mid_motion_waits_for_a_way_and_is_not_lost(
    robot: SteppedRobot, ticks: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Planning may fail for longer than the move before takes: the longer time is an example."""
    joints = robot.description.home
    home = robot.tcp_frame(list(joints))
    robot.controller.move(ptp_stiff_move(robot.tcp_frame(AWAY[len(joints)]), 0.5, 800.0, NO_FORCE))
    robot.step(100)
    monkeypatch.setattr(AtTimesNone, "raises", WAYS_OF_HOURS)
    robot.controller.move(ptp_stiff_move(home, 0.5, 800.0, NO_FORCE))
    robot.step(ticks)
    assert robot.controller.moving, "the newer one is still to be done"
    monkeypatch.setattr(AtTimesNone, "raises", None)
    robot.runs_until_stopped(20.0)
    assert robot.controller.tool_frame() == pytest.approx(home, abs=1e-6)
    assert robot.controller.last_error is None
    assert_within_limits(robot)


@pytest.mark.parametrize("robot", ARMS, indirect=True)
def test_a_smart_target_in_mid_motion_waits_for_a_way_and_is_not_lost(
    robot: SteppedRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    controller, home = robot.controller, robot.description.home
    speeds_rel = [0.5] * len(home)
    controller.move(smart_joint_move(AWAY[len(home)], speeds_rel))
    robot.step(100)
    monkeypatch.setattr(AtTimesNone, "raises", WAYS_OF_HOURS)
    controller.move(smart_joint_move(home, speeds_rel))
    robot.step(30)
    monkeypatch.setattr(AtTimesNone, "raises", None)
    robot.runs_until_stopped(20.0)
    assert controller.joints == home
    assert controller.last_error is None
    assert_within_limits(robot)

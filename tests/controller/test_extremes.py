"""Numbers at the edges: the least and largest that there are, targets at limits, ways of almost nothing."""

from __future__ import annotations

from math import nextafter

import pytest

from tests.asked import (
    direct_joint_move,
    joint_move,
    smart_joint_move,
)
from tests.protocols.fake_robot import Conversation
from tests.stepped import ALL_ROBOTS, SteppedRobot, assert_within_limits

JOINT_MOVES = {"joint": joint_move, "smart": smart_joint_move, "direct": direct_joint_move}


@pytest.mark.requirement("FRC004", "FRC010")
@pytest.mark.parametrize("kind", JOINT_MOVES)
@pytest.mark.parametrize("robot", ALL_ROBOTS)
@pytest.mark.parametrize("speed", [0.0, nextafter(1e-6, 0.0)])
def test_a_joint_near_its_target_accepts_any_speed(kind: str, robot: str, speed: float) -> None:
    """It slows no other, also where the robot was on its way."""
    slow, fast = SteppedRobot(robot), SteppedRobot(robot)
    for stepped, speeds in ((slow, speed), (fast, 1.0)):
        joints = list(stepped.controller.joints)
        first = [joints[0] + 0.07, *joints[1:]]
        then = [joints[0], joints[1] + 1e-3, joints[2] - 5e-4, *joints[3:]]
        rest = [speeds] * (len(joints) - 1)
        stepped.controller.move(JOINT_MOVES[kind](first, [0.5, *rest]))
        stepped.step(50)
        stepped.controller.move(JOINT_MOVES[kind](then, [0.5, *rest]))
    assert slow.runs_until_stopped() == fast.runs_until_stopped()
    assert slow.controller.joints == fast.controller.joints == tuple(then)
    assert_within_limits(slow)


@pytest.mark.parametrize("override", [5e-324, 1e-307, 1e-12, nextafter(1e-6, 0.0)])
def test_overrides_below_a_millionth_are_refused_but_for_the_pause(override: float) -> None:
    robot = SteppedRobot()
    conversation = Conversation(robot.controller)
    assert conversation.ask(f"set override : {override!r}") == "error"
    assert robot.controller.override == 1.0
    for legal in (0.0, 1e-6):
        assert conversation.ask(f"set override : {legal!r}") == "done"

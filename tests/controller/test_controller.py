"""The controller: accepted and rejected moves; a rejection changes nothing."""

from __future__ import annotations

from collections.abc import Callable
from math import nan
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.controller import LONGEST_QUEUE, Controller
from iiwa_sim.controller.errors import EXECUTION, TARGET_NOT_REACHABLE, Refused
from iiwa_sim.controller.requests import MoveRequest
from iiwa_sim.frames import Frame
from iiwa_sim.robot.description import load_robot
from iiwa_sim.robot.nearest import JOINT_LIMIT, OUT_OF_REACH
from tests import requests
from tests.requests import direct_joint_move, joint_move, lin_move, lin_stiff_move, ptp_move, smart_joint_move
from tests.stepped import ARMS, SteppedRobot

FULL = [1.0] * 7
AWAY = [0.5, 0.3, -0.2, -1.0, 0.4, 1.0, -0.6]

HOME = SteppedRobot().controller.tool_frame()
NO_FORCE = [0.0] * 6
FLANGE = SteppedRobot().controller.flange_frame()
SERVO = [
    (f"{mode}_{kind}", parameters, code)
    for mode in ("smart", "direct")
    for kind, parameters, code in (
        ("joint_move", ([3.0, 0, 0, 0, 0, 0, 0], FULL), JOINT_LIMIT),
        ("joint_move", ([nan, 0, 0, 0, 0, 0, 0], FULL), JOINT_LIMIT),
        ("joint_move", (AWAY, [1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 1.0]), EXECUTION),
        ("cartesian_move", (FLANGE._replace(x_mm=2000.0), 1.0), OUT_OF_REACH),
    )
]
REFUSED: list[tuple[str, tuple[Any, ...], int]] = [
    ("joint_move", ([3.0, 0, 0, 0, 0, 0, 0], FULL), JOINT_LIMIT),
    ("joint_move", ([nan, 0, 0, 0, 0, 0, 0], FULL), JOINT_LIMIT),
    ("joint_move", ([0.0] * 7, [1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0]), EXECUTION),
    ("joint_move", ([0.0] * 7, [1e-9] * 7), EXECUTION),
    ("joint_move", ([0.0] * 6, FULL), EXECUTION),
    ("ptp_move", (HOME._replace(x_mm=2000.0), 1.0, 0.0), OUT_OF_REACH),
    ("ptp_move", (HOME, 1.0, 0.0, nan), JOINT_LIMIT),
    ("ptp_move", (HOME, 1.0, 0.0, 3.0), JOINT_LIMIT),
    ("lin_move", (HOME._replace(x_mm=2000.0), 1.0, 0.0), OUT_OF_REACH),
    ("lin_joint_move", ([3.0, 0, 0, 0, 0, 0, 0], 1.0, 0.0), JOINT_LIMIT),
    *SERVO,
    ("smart_joint_move", (AWAY, [1e-12] * 7), EXECUTION),
    ("direct_joint_move", ([-2.0] * 7, FULL), TARGET_NOT_REACHABLE),
    ("direct_cartesian_move", (FLANGE._replace(y_mm=300.0), 1.0), TARGET_NOT_REACHABLE),
]


@pytest.mark.parametrize("begins", ["queue", "servo", "compliance", "stop"])
def test_refused_moves_change_nothing(begins: str) -> None:
    bothered, left_alone = SteppedRobot(), SteppedRobot()
    for robot in (bothered, left_alone):
        controller, target = robot.controller, robot.tcp_frame(AWAY)
        if begins == "compliance":
            controller.move(lin_stiff_move(target, 0.5, 1000.0, NO_FORCE))
        elif begins == "servo":
            controller.move(smart_joint_move(AWAY, FULL))
        else:
            controller.move(joint_move(AWAY, FULL))
            controller.move(lin_move(target._replace(z_mm=400.0), 0.5, 0.0))
        robot.step(50)
        if begins == "stop":
            controller.stop()
    mode, accepted = bothered.controller.mode, bothered.controller.accepted
    for command, parameters, code in REFUSED:
        with pytest.raises(Refused) as refused:
            bothered.controller.move(getattr(requests, command)(*parameters))
        assert refused.value.code == code, (command, parameters)
        assert refused.value.reason
        assert "\n" not in refused.value.reason
        assert (bothered.controller.mode, bothered.controller.accepted) == (mode, accepted)
    for robot in (bothered, left_alone):
        robot.runs_until_stopped()
    assert bothered.joints == left_alone.joints


@pytest.mark.requirement("FRC014")
def test_moves_run_one_after_the_other_in_their_order() -> None:
    robot = SteppedRobot()
    targets = [[0.1 * k, 0.5, 0.0, -1.0, 0.0, 1.0, 0.0] for k in range(1, 6)]
    numbers = [robot.controller.move(joint_move(target, FULL)) for target in targets]
    assert numbers == sorted(numbers)
    passed = []
    for number in numbers:
        while robot.controller.motions.is_pending(number):
            robot.step()
        passed.append(robot.controller.joints[0])
    # Joint moves blend: the next one has begun when one is done.
    assert passed == pytest.approx([0.1, 0.2, 0.3, 0.4, 0.5], abs=0.03)
    assert not robot.controller.moving


@pytest.mark.requirement("FRC014")
def test_the_queue_is_bounded_and_takes_moves_again_when_one_has_begun() -> None:
    controller = Controller(load_robot(), 0.002)
    targets = ([0.0] * 7, [0.01] * 7)
    for k in range(LONGEST_QUEUE):
        controller.move(joint_move(targets[k % 2], FULL))
    with pytest.raises(Refused, match="waiting"):
        controller.move(joint_move(targets[0], FULL))
    controller.step()
    controller.move(joint_move(targets[0], FULL))


@pytest.mark.requirement("FRC017", "FRC018", "FRA103")
def test_the_robot_starts_in_the_tick_after_the_command_and_reports_its_position() -> None:
    robot = SteppedRobot()
    controller = robot.controller
    controller.move(joint_move(AWAY, FULL))
    assert controller.moving
    before = controller.joints
    controller.step()
    assert controller.joints != before
    robot.runs_until_stopped()
    assert controller.joints == tuple(AWAY)
    assert controller.flange_frame() == Frame.from_transform(robot.model.flange(AWAY))
    assert controller.tool_frame() == robot.tcp_frame(AWAY)


finite = st.floats(allow_nan=False, allow_infinity=False)


@given(
    frame=st.builds(Frame, *[finite] * 6),
    speed=st.floats(1e-6, 1.0),
    blending=st.floats(0.0, 1e300),
    redundancy=finite,
)
def test_a_move_with_any_numbers_is_accepted_or_rejected(
    frame: Frame, speed: float, blending: float, redundancy: float
) -> None:
    """The numbers are those that the protocols let through."""
    controller = Controller(load_robot(), 0.002)
    for move in (ptp_move, lin_move):
        try:
            controller.move(move(frame, speed, blending, redundancy))
        except Refused:
            assert not controller.moving


@pytest.mark.requirement("FRC004", "FRC010")
@pytest.mark.parametrize("move", [joint_move, smart_joint_move, direct_joint_move])
@pytest.mark.parametrize("name", ARMS)
def test_a_joint_near_its_target_accepts_any_speed(name: str, move: Callable[..., MoveRequest]) -> None:
    """It slows no other."""
    slow, fast = SteppedRobot(name), SteppedRobot(name)
    for robot, speed in ((slow, 0.0), (fast, 1.0)):
        joints = list(robot.controller.joints)
        then = [joints[0] + 0.07, joints[1] + 1e-3, joints[2] - 5e-4, *joints[3:]]
        robot.controller.move(move(then, [0.5, *[speed] * (len(joints) - 1)]))
        assert robot.runs_until_stopped()
        assert robot.controller.joints == tuple(then)
    assert len(slow.joints) == len(fast.joints)

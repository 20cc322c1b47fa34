"""Endings of moves: each is reported once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.endings import Ending
from iiwa_sim.controller.errors import (
    COMMUNICATION_FAILURE,
    EMERGENCY_STOP,
    STOP_TRIGGERED,
    SUCCESS,
)
from iiwa_sim.robot.description import load_robot
from tests.requests import gravity_hold, joint_move, smart_joint_move
from tests.sequences import Recorder, sequences
from tests.stepped import ARMS, SteppedRobot

HOME = SteppedRobot().controller.joints
NEAR = tuple(np.add(HOME, 0.05).tolist())
FAR = tuple(np.add(HOME, 0.4).tolist())
SPEEDS = (1.0,) * 7


@pytest.fixture
def endings(robot: SteppedRobot) -> list[Ending]:
    reported: list[Ending] = []
    robot.controller.endings.listeners.append(reported.append)
    return reported


@pytest.fixture
def robot() -> SteppedRobot:
    return SteppedRobot(servo_timeout_s=0.5)


@pytest.mark.parametrize(
    ("act", "code", "words"),
    [
        (lambda robot: robot.stop(), STOP_TRIGGERED, "stopped"),
        (lambda robot: robot.controller.emergency_stop(), EMERGENCY_STOP, "emergency stop"),
        (lambda robot: robot.controller.move(smart_joint_move(NEAR, SPEEDS)), STOP_TRIGGERED, "replaced"),
        (lambda robot: robot.controller.move(gravity_hold(100.0)), STOP_TRIGGERED, "replaced"),
    ],
)
def test_endings_of_stopped_moves(
    robot: SteppedRobot, endings: list[Ending], act: Callable[[SteppedRobot], object], code: int, words: str
) -> None:
    robot.controller.move(joint_move(FAR, SPEEDS))
    robot.controller.move(joint_move(NEAR, SPEEDS))
    robot.step(50)
    act(robot)
    assert [(ending.move, ending.code) for ending in endings] == [(1, code), (2, code)]
    assert all(words in ending.reason for ending in endings)


def test_endings_of_a_cancelled_move_and_a_queue(robot: SteppedRobot, endings: list[Ending]) -> None:
    for target in (FAR, (-1.0, *NEAR[1:]), FAR, NEAR):
        robot.controller.move(joint_move(target, SPEEDS))
    robot.step(50)
    robot.cancel()
    assert [(ending.move, ending.code) for ending in endings] == [(1, STOP_TRIGGERED)]
    robot.step(100)
    robot.controller.clear_queue()
    assert [(ending.move, ending.code) for ending in endings[1:]] == [
        (3, STOP_TRIGGERED),
        (4, STOP_TRIGGERED),
    ]
    robot.runs_until_stopped()
    assert endings[3:] == [Ending(2, SUCCESS, "")]


def test_a_servo_target_is_reached_replaced_or_given_up(robot: SteppedRobot, endings: list[Ending]) -> None:
    robot.controller.move(smart_joint_move(FAR, SPEEDS))
    robot.step(20)
    robot.controller.move(smart_joint_move(NEAR, SPEEDS))
    assert [(ending.move, ending.code) for ending in endings] == [(1, STOP_TRIGGERED)]
    robot.step(200)
    assert endings[1:] == [Ending(2, SUCCESS, "")]
    robot.controller.move(smart_joint_move(HOME, [0.01] * 7))
    robot.step(300)
    reported = "no smart command for 0.5 s: the robot stops"
    assert endings[2:] == [Ending(3, COMMUNICATION_FAILURE, reported)]


def test_the_callback_of_a_move_gets_its_ending_and_no_other(robot: SteppedRobot) -> None:
    reported: dict[str, list[Ending]] = {"one": [], "other": []}
    robot.controller.move(joint_move(NEAR, SPEEDS), reported["one"].append)
    robot.controller.move(joint_move(HOME, SPEEDS))
    robot.controller.move(joint_move(FAR, SPEEDS), reported["other"].append)
    while not reported["one"]:
        assert robot.controller.motions.is_pending(1)
        robot.step()
    assert reported == {"one": [Ending(1, SUCCESS, "")], "other": []}
    robot.stop()
    assert reported["one"] == [Ending(1, SUCCESS, "")]
    assert reported["other"] == [Ending(3, STOP_TRIGGERED, "stopped")]
    assert not robot.controller.endings.pending


@given(st.data(), st.sampled_from(ARMS))
def test_every_move_of_a_program_ends_once(data: st.DataObject, name: str) -> None:
    recorder = Recorder(load_robot(name))
    robot = recorder.robot
    reported: list[Ending] = []
    robot.controller.endings.listeners.append(reported.append)
    recorder.run(data.draw(sequences(len(robot.description.joints), stops=True, longest=5)))
    assert sorted(ending.move for ending in reported) == list(range(1, robot.controller.accepted + 1))
    assert {ending.code for ending in reported} <= {SUCCESS, STOP_TRIGGERED}

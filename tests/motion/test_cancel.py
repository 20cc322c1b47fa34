"""Cancelling a move and clearing the queue: what ends, where, and what goes on from there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.errors import ErrorRecord
from iiwa_sim.controller.modes import Mode
from iiwa_sim.controller.requests import MoveRequest
from iiwa_sim.robot.nearest import JOINT_LIMIT
from tests.asked import direct_joint_move, joint_move, lin_joint_move, ptp_move, smart_joint_move
from tests.chain_checks import assert_keeps_all_promises
from tests.chains import ROOMY, Recorder, chains, in_the_open
from tests.stepped import ARMS, SteppedRobot, assert_within_limits

FULL = [1.0] * 7
both = pytest.mark.parametrize("name", ARMS)
names = st.sampled_from(ARMS)


def sent(name: str, chain: list[Any]) -> Recorder:
    """A robot to which a chain was sent."""
    recorder = in_the_open(name)
    for move in chain:
        recorder.send_move(move, 0.05)
    return recorder


waits = st.tuples(
    st.sampled_from([1.0, 1.0, 1.0, 0.4, 0.05, 0.0]), st.one_of(st.integers(0, 60), st.integers(0, 600))
)
"""An override, and the ticks that it is waited for."""


@pytest.mark.requirement("FRC013", "FRC014")
@given(data=st.data(), name=names, cancels=st.lists(waits, min_size=1, max_size=4))
def test_what_waits_is_reached_from_where_the_robot_came_to_rest(
    data: st.DataObject, name: str, cancels: list[tuple[float, int]]
) -> None:
    recorder = sent(name, data.draw(chains(len(ROOMY[name]), at_once=True)))
    for override, wait in cancels:
        if override != recorder.robot.controller.override:
            recorder.override(override)
        recorder.wait(wait)
        recorder.cancel()
    recorder.override(1.0)
    recorder.finish()
    assert_keeps_all_promises(recorder)
    assert recorder.robot.faults == []


@pytest.mark.requirement("FRC016")
@given(
    data=st.data(),
    name=names,
    wait=st.one_of(st.integers(0, 60), st.integers(0, 1000)),
    again=st.booleans(),
)
def test_a_cleared_queue_leaves_the_running_move(
    data: st.DataObject, name: str, wait: int, again: bool
) -> None:
    recorder = sent(name, data.draw(chains(len(ROOMY[name]), at_once=True)))
    recorder.wait(wait)
    recorder.clear()
    if again:
        *others, last = recorder.end
        joints = (*others, last + (0.1 if last < 0.0 else -0.1))
        assert recorder.send("joint", joints, recorder.robot.tcp_frame(joints), (0.5,) * len(joints), 0.0)
    recorder.finish()
    assert_keeps_all_promises(recorder)
    assert recorder.robot.controller.joints == recorder.end


def lines(name: str, blending_mm: float) -> tuple[Recorder, list[int]]:
    """Two sides of a square, sent at once, and their numbers."""
    recorder = sent(name, [])
    for y_mm, z_mm in ((200.0, 0.0), (0.0, -200.0)):
        recorder.lin(0.0, y_mm, z_mm, blending_mm)
    return recorder, [move.number for move in recorder.runs[-1].moves]


@pytest.mark.requirement("FRC014", "FRC021")
def test_what_cannot_be_done_from_there_is_told_and_forgotten_with_all_behind_it() -> None:
    robot = SteppedRobot()
    mirrored = [0.0, -0.5, 0.0, 1.0, 0.0, -0.8, 0.0]
    beside = [0.1, -0.5, 0.0, 1.0, 0.0, -0.8, 0.0]
    numbers = [
        robot.controller.move(joint_move(mirrored, FULL)),
        robot.controller.move(ptp_move(robot.tcp_frame(mirrored)._replace(z_mm=700.0), 1.0, 0.0)),
        robot.controller.move(lin_joint_move(beside, 1.0, 0.0)),  # only with the arm bent that way
        robot.controller.move(joint_move([0.0] * 7, FULL)),
    ]
    robot.step(10)
    robot.cancel()
    assert robot.controller.queue == 3
    assert robot.faults == []
    robot.step(2)
    assert robot.controller.queue == 1
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


@pytest.mark.requirement("FRC016")
@both
def test_a_running_move_that_was_blended_into_a_cleared_one_ends_exactly(name: str) -> None:
    recorder, (first, _) = lines(name, 40.0)
    recorder.wait(100)
    assert recorder.clear()
    recorder.finish()
    assert_keeps_all_promises(recorder)
    alone = sent(name, [])
    alone.lin(0.0, 200.0, 0.0, 0.0)
    alone.finish()
    assert recorder.robot.controller.joints == alone.robot.controller.joints
    assert recorder.tick <= 1.05 * alone.tick
    assert first == 1


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

"""Quaternion targets, relative moves, and whether a target is reachable."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, nan

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import Refused
from iiwa_sim.controller.requests import from_quaternion, shifted
from iiwa_sim.frames import Frame, quaternion_from_rotation
from iiwa_sim.robot.nearest import OUT_OF_REACH
from tests.requests import (
    joint_move,
    lin_move,
    lin_reach,
    lin_relative_move,
    ptp_move,
    ptp_relative_move,
    reach,
)
from tests.stepped import SteppedRobot, assert_straight, assert_within_limits

FULL = [1.0] * 7
AWAY = [0.5, 0.3, -0.2, -1.0, 0.4, 1.0, -0.6]
angles = st.floats(-3.0, 3.0)
mm = st.floats(-200.0, 200.0)
places = st.floats(-900.0, 900.0)
shifts = st.builds(Frame, mm, mm, mm, angles, angles, angles)


@pytest.mark.requirement("FRC005")
@given(angles, st.floats(-1.5, 1.5), angles, st.floats(0.991, 1.009), st.sampled_from([-1.0, 1.0]))
def test_a_quaternion_gives_back_its_orientation(
    alpha: float, beta: float, gamma: float, length: float, sign: float
) -> None:
    frame = Frame(10.0, -20.0, 30.0, alpha, beta, gamma)
    x, y, z, w = (sign * length * q for q in quaternion_from_rotation(frame.to_transform().rotation))
    found = from_quaternion((10.0, -20.0, 30.0), (x, y, z, w))
    assert found[:3] == frame[:3]
    np.testing.assert_allclose(found.to_transform().rotation, frame.to_transform().rotation, atol=1e-12)


@pytest.mark.requirement("FRC005")
def test_a_quaternion_that_is_not_of_unit_length_is_rejected() -> None:
    for quaternion in ((0.0,) * 4, (nan,) * 4, (inf, 0.0, 0.0, 1.0), (0.5, 0.5, 0.5, 0.4), (1e200,) * 4):
        with pytest.raises(Refused, match="a quaternion of length"):
            from_quaternion((0.0, 0.0, 0.0), quaternion)


@pytest.mark.requirement("FRC007")
@given(shifts, shifts)
def test_a_shift_turns_the_tool_in_place_and_moves_it_along_the_axes(start: Frame, shift: Frame) -> None:
    pose, by = start.to_transform(), shift.to_transform()
    r = np.reshape(pose.rotation, (3, 3))
    turn = np.reshape(by.rotation, (3, 3))
    for in_tool, moved, turned in (
        (False, np.add(pose.translation, by.translation), turn @ r),
        (True, np.add(pose.translation, r @ by.translation), r @ turn),
    ):
        found = shifted(pose, shift, in_tool=in_tool).to_transform()
        np.testing.assert_allclose(found.translation, moved, atol=1e-12)
        np.testing.assert_allclose(np.reshape(found.rotation, (3, 3)), turned, atol=1e-12)


@pytest.mark.requirement("FRC007")
def test_a_relative_line_begins_where_the_queue_ends_and_its_target_stays() -> None:
    robot = SteppedRobot()
    controller = robot.controller
    controller.move(joint_move(AWAY, FULL))
    corner = robot.tcp_frame(AWAY)
    controller.move(lin_relative_move(Frame(0.0, 80.0, 0.0, 0.0, 0.0, 0.0), 0.5, 0.0, in_tool=False))
    robot.runs_until_stopped()
    target = corner._replace(y_mm=corner.y_mm + 80.0)
    assert controller.tool_frame() == pytest.approx(target, abs=1e-6)
    begun = len(robot.joints)
    turn = Frame(0.0, 0.0, -50.0, 0.3, 0.0, 0.0)
    controller.move(lin_relative_move(turn, 0.5, 0.0, in_tool=True))
    target = shifted(robot.tcp(controller.joints), turn, in_tool=True)
    robot.runs_until_stopped()
    assert_straight(robot, robot.joints[begun - 1 :], target)
    assert_within_limits(robot)


def refusal(command: Callable[[], object]) -> tuple[int, str] | None:
    """Return code and reason, or None where it is not refused."""
    try:
        command()
    except Refused as refused:
        return refused.code, refused.reason
    return None


@pytest.mark.requirement("FRC007")
@pytest.mark.parametrize("in_tool", [False, True])
def test_a_relative_move_out_of_reach_is_rejected_with_its_target(in_tool: bool) -> None:
    controller = SteppedRobot().controller
    by = Frame(1500.0, 0.0, -20.0, 0.0, 0.0, 0.0)
    for move in (lin_relative_move, ptp_relative_move):
        refused = refusal(lambda move=move: controller.move(move(by, 0.5, 0.0, in_tool=in_tool)))
        assert refused is not None
        assert refused[0] == OUT_OF_REACH
        assert refused[1].startswith("the TCP at ")


def state(controller: Controller) -> tuple[object, ...]:
    return (
        controller.joints,
        controller.moving,
        controller.mode,
        controller.errors.last,
        controller.status(),
    )


@pytest.mark.requirement("FRC020")
@example(Frame(2000.0, 0.0, 520.0, 0.0, -1.57, 0.0), None, 0)
@example(Frame(inf, 0.0, 520.0, 0.0, -1.57, 0.0), None, 0)
@given(
    st.builds(Frame, places, places, st.floats(-200.0, 1300.0), angles, angles, angles),
    st.one_of(st.none(), st.floats(-3.2, 3.2)),
    st.integers(0, 100),
)
def test_a_move_to_a_reachable_target_is_accepted_and_the_question_changes_nothing(
    target: Frame, redundancy: float | None, ticks: int
) -> None:
    asked, silent, line, ptp = (SteppedRobot() for _ in range(4))
    for robot in (asked, silent, line, ptp):
        robot.controller.move(joint_move(AWAY, FULL))
        robot.step(ticks)
    before = state(asked.controller)
    answers = [
        refusal(lambda: asked.controller.check(lin_reach(target, redundancy))),
        refusal(lambda: asked.controller.check(reach(target, redundancy))),
    ]
    assert state(asked.controller) == before
    assert answers == [
        refusal(lambda: line.controller.move(lin_move(target, 1.0, 0.0, redundancy))),
        refusal(lambda: ptp.controller.move(ptp_move(target, 1.0, 0.0, redundancy))),
    ]
    for robot in (asked, silent):
        robot.runs_until_stopped()
    assert asked.joints == silent.joints


def test_a_joint_that_stands_on_its_limit_by_rounding_is_placed_on_it() -> None:
    robot = SteppedRobot()
    high, *others = robot.description.position_max[0], *robot.controller.joints[1:]
    robot.controller.place([high + 1e-10, *others])
    assert robot.controller.joints[0] == high
    with pytest.raises(Refused, match="is outside"):
        robot.controller.place([high + 1e-8, *others])

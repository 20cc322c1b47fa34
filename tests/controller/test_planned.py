"""What the controller tells of moves that run and wait: their numbers, their ends, and where they blend."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.requests import Kind, MoveRequest, TcpCompliance
from iiwa_sim.frames import Frame
from tests.asked import joint_move, lin_move, ptp_move
from tests.stepped import SteppedRobot

FULL = [1.0] * 7
READY = (0.0, 0.4, 0.0, -1.2, 0.0, 1.2, 0.0)


def numbers(robot: SteppedRobot) -> list[int]:
    return [each.number for each in robot.controller.motions.planned]


def aside(robot: SteppedRobot, y_mm: float) -> Frame:
    """Beside where the queue ends."""
    there = robot.controller.tcp_frame_at(robot.controller.end_of_queue)
    return there._replace(y_mm=there.y_mm + y_mm)


def test_targets_and_spheres_are_those_that_were_asked_for() -> None:
    robot = SteppedRobot()
    controller = robot.controller
    assert controller.motions.planned == []
    controller.move(joint_move(READY, FULL))
    corner, end = aside(robot, 100.0), aside(robot, 160.0)
    controller.move(lin_move(corner, 0.5, 30.0))
    controller.move(ptp_move(end, 0.5, 0.0))
    first, second, third = controller.motions.planned
    assert (first.number, first.joints) == (1, READY)
    assert [each.blending_m for each in (first, second, third)] == pytest.approx([0.0, 0.03, 0.0])
    for planned, wanted in ((second, corner), (third, end)):
        assert controller.tcp_frame_at(planned.joints)[:3] == pytest.approx(wanted[:3], abs=1e-3)
    while robot.controller.moving:
        before = numbers(robot)
        assert before == sorted(before)
        assert before[0] == controller.motions.under_way or not controller.motions.under_way
        assert len(before) == controller.queue + 1
        robot.step(20)
    assert controller.motions.planned == []


@given(st.integers(0, 1500), st.sampled_from(["stop", "cancel_move", "clear_queue"]))
def test_what_was_stopped_cancelled_or_cleared_is_told_no_more(ticks: int, how: str) -> None:
    robot = SteppedRobot()
    controller = robot.controller
    controller.move(joint_move(READY, FULL))
    for y_mm in (80.0, 80.0, -80.0):
        controller.move(lin_move(aside(robot, y_mm), 0.5, 20.0))
    robot.step(ticks)
    before = numbers(robot)
    getattr(controller, how)()
    after = numbers(robot)
    assert set(after) <= set(before)
    assert all(controller.motions.is_pending(number) for number in after)
    assert [number for number in before if controller.motions.is_pending(number)] == after
    while controller.moving:
        robot.step(10)
        assert all(controller.motions.is_pending(number) for number in numbers(robot))
    assert controller.motions.planned == []


def test_a_stiffness_move_is_told_and_a_hold_is_none() -> None:
    robot = SteppedRobot()
    controller = robot.controller
    soft = TcpCompliance(1000.0, (0.0,) * 6)
    for number, y_mm in enumerate((150.0, -150.0), 1):
        controller.move(MoveRequest(Kind.LIN, aside(robot, y_mm), 0.3, compliance=soft))
        assert numbers(robot) == [number]
        robot.step(60)
        assert numbers(robot) == [number], "also one that takes over in mid-motion"
    controller.move(MoveRequest(Kind.HOLD, hold_nm_per_rad=300.0))
    assert controller.motions.planned == []
    robot.step(600)
    assert controller.motions.planned == []

"""A gripper, wired to the controller."""

from __future__ import annotations

from dataclasses import replace

import pytest

from iiwa_sim.cell.cell import robot_alone
from iiwa_sim.controller.handling import Handling, HandlingSetup, Wiring
from iiwa_sim.world.gripper import Jaws
from tests.stepped import SteppedRobot

JAWS = Jaws(stroke_m=0.08, speed_m_per_s=0.1, force_n=40.0)
CLOSE, OPEN = 1, 2
IS_OPEN, IS_CLOSED, HOLDS = 4, 5, 6
ONE_VALVE = Wiring(CLOSE, 0, IS_OPEN, IS_CLOSED, HOLDS)
TWO_VALVES = Wiring(CLOSE, OPEN, IS_OPEN, IS_CLOSED, HOLDS)
STROKE_TICKS = 402


def gripping(wiring: Wiring = ONE_VALVE) -> SteppedRobot:
    return SteppedRobot(cell=replace(robot_alone(), handled=HandlingSetup(JAWS, wiring)))


def handling_of(robot: SteppedRobot) -> Handling:
    assert robot.controller.handling is not None
    return robot.controller.handling


def told(robot: SteppedRobot) -> tuple[bool, ...]:
    """Open, closed, holds."""
    return tuple(robot.controller.io.input(number) for number in (IS_OPEN, IS_CLOSED, HOLDS))


def test_two_outputs_and_neither_leaves_it_where_it_is() -> None:
    robot = gripping(TWO_VALVES)
    io = robot.controller.io
    io.set_output(CLOSE, on=True)
    robot.step(100)
    io.set_output(CLOSE, on=False)
    robot.step(100)
    assert handling_of(robot).state.opening_mm == pytest.approx(60.0)
    assert handling_of(robot).state.state == "between"
    io.set_output(OPEN, on=True)
    robot.step(STROKE_TICKS)
    assert told(robot) == (True, False, False)
    io.set_output(CLOSE, on=True)
    robot.step(STROKE_TICKS)
    assert told(robot) == (True, False, False)


def test_faults_of_the_gripper_and_their_end() -> None:
    robot = gripping()
    handling = handling_of(robot)
    handling.stick(True)
    robot.controller.io.set_output(CLOSE, on=True)
    robot.step(10)
    assert told(robot) == (True, False, False)
    assert handling.settled
    handling.mistake("holds", True)
    assert told(robot) == (True, False, True)
    assert handling.state.state == "open"  # as it is
    handling.repair()
    assert told(robot) == (True, False, False)
    robot.step(STROKE_TICKS)
    assert told(robot) == (False, True, False)

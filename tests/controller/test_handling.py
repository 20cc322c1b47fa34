"""A gripper, wired to the controller."""

from __future__ import annotations

from dataclasses import replace

import pytest

from iiwa_sim.cell.cell import robot_alone
from iiwa_sim.controller.handling import HandlingSetup, Wiring
from iiwa_sim.world.gripper import Jaws
from tests.stepped import SteppedRobot

JAWS = Jaws(stroke_m=0.08, speed_m_per_s=0.1, force_n=40.0)
CLOSE, OPEN = 1, 2
IS_OPEN, IS_CLOSED = 4, 5
STROKE_TICKS = 402


def test_with_both_outputs_alike_the_gripper_keeps_its_opening() -> None:
    wiring = Wiring(CLOSE, OPEN, IS_OPEN, IS_CLOSED)
    robot = SteppedRobot(cell=replace(robot_alone(), handled=HandlingSetup(JAWS, wiring)))
    io, handling = robot.controller.io, robot.controller.handling
    assert handling is not None
    io.set_output(CLOSE, on=True)
    robot.step(100)
    io.set_output(CLOSE, on=False)
    robot.step(100)
    assert handling.state.opening_mm == pytest.approx(60.0)
    assert handling.state.state == "between"
    io.set_output(OPEN, on=True)
    robot.step(STROKE_TICKS)
    assert (io.input(IS_OPEN), io.input(IS_CLOSED)) == (True, False)
    io.set_output(CLOSE, on=True)
    robot.step(STROKE_TICKS)
    assert (io.input(IS_OPEN), io.input(IS_CLOSED)) == (True, False)

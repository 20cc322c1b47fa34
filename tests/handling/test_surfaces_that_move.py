"""A surface that is moved up carries what lies on it, and what it meets in the air."""

from __future__ import annotations

import pytest

from iiwa_sim.backdoor import surfaces
from iiwa_sim.contact.shapes import Box
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Frame
from iiwa_sim.handling.falling import FALLS, LIES
from iiwa_sim.handling.part import Part
from tests.handling.heaps import above
from tests.handling.scenes import BLOCK, TABLE, TABLE_MM, Scene, at, down

MIDDLE_MM = TABLE_MM - 20.0
"""Of the table."""
SAG_M = 4e-4
"""No part here lies deeper in the table, or another part."""
LID = Part("lid", Box(0.02, 0.02, 0.01), 0.2, 0.5, 5e4)


def moves_table(scene: Scene, up_mm: float, *, y_mm: float = 0.0) -> None:
    pose = Frame(600.0, y_mm, MIDDLE_MM + up_mm, 0.0, 0.0, 0.0)
    surfaces.move(scene.controller, "table", pose)


@pytest.mark.parametrize(("up_mm", "ticks"), [(20.0, 59), (5.0, 63), (60.0, 59)])
def test_a_table_that_comes_up_past_the_bottom_of_a_falling_part_carries_it(up_mm: float, ticks: int) -> None:
    """The part fell through the table, since that was a wall in which it was."""
    scene = Scene((BLOCK, at(600.0, 0.0, TABLE_MM + 110.0)), cell=above())
    scene.robot.step(ticks)
    assert TABLE_MM < 1e3 * scene.body("block").bottom < TABLE_MM + up_mm
    moves_table(scene, up_mm)
    scene.robot.step(1)
    body = scene.body("block")
    assert (body.state, body.on) == (LIES, "table")
    assert body.pose.translation[:2] == (0.6, 0.0)
    assert body.bottom == pytest.approx(1e-3 * (TABLE_MM + up_mm), abs=SAG_M)


def test_what_is_higher_falls_on() -> None:
    scene = Scene((BLOCK, at(600.0, 0.0, TABLE_MM + 110.0)), cell=above())
    scene.robot.step(30)
    before = scene.body("block").bottom
    moves_table(scene, 20.0)
    scene.robot.step(1)
    assert scene.body("block").state == FALLS
    assert scene.body("block").bottom < before


@pytest.mark.parametrize(("down_mm", "ticks"), [(1.0, 5), (3.0, 8), (10.0, 14)])
def test_a_stack_stays_on_a_table_that_is_shaken(down_mm: float, ticks: int) -> None:
    """Down, and up again while all is in the air: that threw parts off."""
    scene = Scene(
        (BLOCK, at(600.0, 0.0, TABLE_MM + 30.0)), (LID, at(605.0, 10.0, TABLE_MM + 70.0)), cell=above()
    )
    scene.rests()
    before = scene.body("block").pose.translation, scene.body("lid").pose.translation
    moves_table(scene, -down_mm)
    scene.robot.step(ticks)
    moves_table(scene, 0.0)
    scene.rests()
    assert (scene.body("block").on, scene.body("lid").on) == ("table", "block")
    after = scene.body("block").pose.translation, scene.body("lid").pose.translation
    for one, other in zip(before, after, strict=True):
        assert other == pytest.approx(one, abs=1e-9)


def test_a_part_that_rides_up_carries_what_falls_to_it() -> None:
    scene = Scene(
        (BLOCK, at(600.0, 0.0, TABLE_MM + 30.0)), (LID, at(600.0, 0.0, TABLE_MM + 110.0)), cell=above()
    )
    scene.robot.step(40)
    assert 1e3 * scene.body("lid").bottom > TABLE_MM + 60.0
    moves_table(scene, 50.0)
    scene.robot.step(1)
    assert (scene.body("lid").on, scene.body("block").on) == ("block", "table")


@pytest.mark.parametrize(
    ("below_mm", "y_mm"), [pytest.param(10.0, 0.0, id="it was in it"), pytest.param(-5.0, 600.0, id="beside")]
)
def test_a_part_that_was_in_it_or_is_beside_is_left(below_mm: float, y_mm: float) -> None:
    """As far below the face as that (mm), or as far above it, but with its middle beside."""
    shelf = Surface("shelf", Box(0.1, 0.1, 0.02), at(600.0, y_mm, MIDDLE_MM + 300.0), 2e4, 0.0, 0.3)
    scene = Scene(
        (BLOCK, at(600.0, 0.0, TABLE_MM + 300.0 + 30.0 - below_mm)), surfaces=(TABLE, shelf), cell=above()
    )
    scene.robot.step(1)
    pose = Frame(600.0, y_mm, MIDDLE_MM + 310.0, 0.0, 0.0, 0.0)
    surfaces.move(scene.controller, "shelf", pose)
    scene.robot.step(1)
    assert scene.body("block").state == FALLS


def test_what_comes_up_against_closed_jaws_is_pressed_as_if_these_had_come_down() -> None:
    """Once the arm felt it as deep in the jaws as the table had gone, with seven times the force, until it
    was moved."""
    forces, heights = [], []
    for table_up_mm, arm_down_mm in ((6.0, 0.0), (0.0, 6.0)):
        scene = Scene((BLOCK, at(600.0, 0.0, TABLE_MM + 30.0)), cell=above())
        scene.closes()
        scene.goes(down(600.0, 0.0, TABLE_MM + 65.0))
        scene.rests()
        moves_table(scene, table_up_mm)
        scene.goes(down(600.0, 0.0, TABLE_MM + 65.0 - arm_down_mm), 0.1)
        scene.robot.step(200)
        forces.append(scene.controller.cartesian_force()[2])
        heights.append(1e3 * scene.body("block").pose.translation[2] - table_up_mm)
        assert scene.controller.resting
    assert forces[0] == pytest.approx(forces[1], abs=0.1)
    assert heights[0] == pytest.approx(heights[1], abs=0.01)
    assert forces[0] < -5.0

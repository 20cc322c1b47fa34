"""The arm feels parts where they are, also those that go by themselves."""

from __future__ import annotations

from iiwa_sim.contact.shapes import Box
from iiwa_sim.handling.falling import LIES
from iiwa_sim.handling.part import Part
from tests.asked import lin_move
from tests.handling.scenes import CLOSE, TABLE, TABLE_MM, Scene, at, down

PUCK = Part("puck", Box(0.02, 0.02, 0.03), 0.3, 0.04, 5e4)
LOW = TABLE_MM + 30.0


def assert_known(scene: Scene) -> None:
    """The parts that lie near the arm are for it where they are."""
    known = scene.controller.load.felt().parts
    for name, surface in known.items():
        body = scene.body(name)
        assert body.state != LIES or body.pose == surface.pose


def beside_the_jaws() -> Scene:
    scene = Scene((PUCK, at(600.0, 100.0, LOW)))
    scene.controller.io.set_output(CLOSE, True)
    scene.goes(down(600.0, 60.0, TABLE_MM + 200.0), straight=False)
    scene.goes(down(600.0, 60.0, LOW))
    return scene


def test_a_part_that_slides_on_is_not_felt_where_it_was_pushed_last() -> None:
    scene = beside_the_jaws()
    scene.controller.move(lin_move(down(600.0, 100.0, LOW), 0.5, 0.0))
    while scene.controller.moving or not scene.body("puck").settled:
        scene.robot.step()
        assert_known(scene)
    left_mm = 1e3 * scene.body("puck").pose.translation[1] - 20.0
    assert left_mm > 200.0, "it has slid on"
    scene.controller.move(lin_move(down(600.0, left_mm - 15.0, LOW), 0.1, 0.0))
    while scene.controller.moving:
        scene.robot.step()
        assert not scene.controller.load.link_contacts


def test_a_part_that_rides_up_with_its_table_is_known_there() -> None:
    """Once the arm felt it where it had been before."""
    scene = beside_the_jaws()
    assert "puck" in scene.controller.load.felt().parts
    x, y, z = TABLE.pose.translation
    scene.controller.load.world.move(TABLE.name, TABLE.pose._replace(translation=(x, y, z + 0.003)))
    scene.robot.step(2)
    assert scene.body("puck").pose.translation[2] > 1e-3 * LOW + 0.002
    assert_known(scene)

"""A restored state goes on to the last bit as the one did that was saved."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from iiwa_sim.backdoor.states import States
from iiwa_sim.contact.moments import GRAVITY_M_S2
from iiwa_sim.controller.handling import PartState
from iiwa_sim.wrench import NO_WRENCH, Wrench
from tests.asked import gravity_hold, lin_move, lin_stiff_move
from tests.handling.heaps import above
from tests.handling.scenes import BLOCK, CLOSE, JAWS, TABLE_MM, Scene, at, down

Told = list[tuple[tuple[float, ...], Wrench, tuple[PartState, ...]]]
GRASP_MM = TABLE_MM + 40.0


def as_saved_and_as_restored(scene: Scene, deed: Callable[[], None], ticks: int = 200) -> tuple[Told, Told]:
    """What becomes of a scene by a deed: as it was when it was saved, and restored after all that."""
    controller, states = scene.controller, States(scene.controller)
    states.save("then")

    def told() -> Told:
        deed()
        found: Told = []
        for _ in range(ticks):
            controller.step()
            found.append((controller.joints, controller.load.acting, scene.handling.parts))
        return found

    saved = told()
    controller.stop()
    scene.robot.runs_until_stopped()
    states.restore("then")
    return saved, told()


YIELDING = {
    "stiff": lambda: lin_stiff_move(down(600.0, -100.0, TABLE_MM + 60.0), 0.3, 1000.0, NO_WRENCH),
    "limp": lambda: lin_stiff_move(down(600.0, -100.0, TABLE_MM + 20.0), 0.3, 0.0, NO_WRENCH),
    "hold": lambda: gravity_hold(100.0),
}


@pytest.mark.parametrize("y_mm", [-100.0, 0.0], ids=["jaws in the table", "a jaw on a part"])
@pytest.mark.parametrize("yields", YIELDING)
def test_a_robot_that_begins_to_yield_in_contact(yields: str, y_mm: float) -> None:
    scene = Scene((BLOCK, at(600.0, 40.0, 330.0)), cell=above())
    low_mm = TABLE_MM - 4.0 if y_mm else TABLE_MM + 58.0
    scene.goes(down(600.0, y_mm, low_mm + 60.0))
    scene.goes(down(600.0, y_mm, low_mm), 0.1)
    scene.rests()
    assert scene.controller.load.link_contacts
    saved, restored = as_saved_and_as_restored(scene, lambda: scene.controller.move(YIELDING[yields]()))
    assert saved == restored


def test_links_touch_what_they_did_before_the_first_tick() -> None:
    scene = Scene(cell=above())
    scene.goes(down(600.0, 0.0, TABLE_MM - 2.0), 0.1)
    scene.rests()
    states, touches = States(scene.controller), scene.controller.load.link_contacts
    assert touches
    states.save("in the table")
    states.restore("start")
    states.restore("in the table")
    assert scene.controller.load.link_contacts == touches


def test_jaws_that_have_been_closed_and_are_open_again() -> None:
    scene = Scene((BLOCK, at(600.0, 90.0, 330.0)), cell=above())
    scene.goes(down(600.0, 0.0, TABLE_MM + 40.0))

    def pushes_and_closes() -> None:
        scene.goes(down(600.0, 35.0, TABLE_MM + 40.0), 0.1)
        scene.controller.io.set_output(CLOSE, True)

    saved, restored = as_saved_and_as_restored(scene, pushes_and_closes)
    assert saved == restored
    assert saved[0][2][0].frame.y_mm > 90.5, "the block has been pushed"


def test_a_part_from_below_which_the_table_has_just_gone() -> None:
    """The parts see that in the next tick. Once the restored one stayed in the air for good."""
    scene = Scene((BLOCK, at(600.0, 0.0, 330.0)))
    before = [each.frame.z_mm for each in scene.handling.parts]
    scene.controller.load.world.move("table", at(600.0, 0.0, TABLE_MM - 60.0))
    saved, restored = as_saved_and_as_restored(scene, lambda: None, ticks=500)
    assert saved == restored
    assert [each.frame.z_mm for each in saved[-1][2]] == pytest.approx(
        [each - 40.0 for each in before], abs=1.0
    )


def test_a_part_that_has_slid_a_little_and_is_held_now() -> None:
    """By what it weighs it began to slide; what has slid is held against more."""
    most_n = 2.0 * BLOCK.friction * JAWS.force_n
    heavy = BLOCK._replace(mass_kg=1.0005 * most_n / GRAVITY_M_S2)
    scene = Scene((heavy, at(600.0, 0.0, 330.0)), cell=above())
    scene.picks(600.0, 0.0, GRASP_MM)
    scene.goes(down(600.0, 0.0, GRASP_MM + 60.0), 0.05)
    scene.rests()
    assert scene.body("block").pose.translation[2] > 0.35
    saved, restored = as_saved_and_as_restored(scene, lambda: scene.goes(down(600.0, 0.0, GRASP_MM + 60.0)))
    assert saved == restored


def test_a_held_part_that_is_pressed_and_rubs() -> None:
    scene = Scene((BLOCK, at(600.0, 0.0, 330.0)), cell=above())
    scene.picks(600.0, 0.0, GRASP_MM)
    scene.goes(down(600.0, 0.0, GRASP_MM + 40.0))
    scene.goes(down(600.0, 130.0, GRASP_MM + 40.0))
    scene.goes(down(600.0, 130.0, GRASP_MM - 1.3), 0.05)
    scene.goes(down(604.0, 133.0, GRASP_MM - 1.3), 0.05)
    scene.rests()

    def goes_on() -> None:
        scene.controller.move(lin_move(down(612.0, 120.0, GRASP_MM - 1.5), 0.1, 0.0))

    saved, restored = as_saved_and_as_restored(scene, goes_on)
    assert saved == restored


def test_a_part_that_has_just_been_lost_is_not_gripped_again() -> None:
    scene = Scene((BLOCK, at(600.0, 0.0, 330.0)), cell=above())
    scene.picks(600.0, 0.0, GRASP_MM)
    scene.rests()
    states = States(scene.controller)
    scene.handling.lose()
    states.save("lost")
    scene.robot.step(50)
    lost = scene.handling.state, scene.handling.parts
    states.restore("lost")
    scene.robot.step(50)
    assert (scene.handling.state, scene.handling.parts) == lost
    assert scene.body("block").state == "lies"

"""What lies on a part that is pushed goes with it, and meets what stands beside."""

from __future__ import annotations

from statistics import median

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.contact.shapes import Box
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Transform
from iiwa_sim.handling.falling import LIES
from iiwa_sim.handling.part import Part
from tests.asked import lin_move
from tests.handling.books import ROUNDING_J, Books
from tests.handling.depths import deepest_mm
from tests.handling.scenes import BLOCK, CLOSE, JAWS, TABLE, TABLE_MM, Scene, at, down
from tests.samples import some

G = 9.81
LID = Part("lid", Box(0.015, 0.025, 0.01), 0.2, 0.4, 5e4)
NEXT = Part("next", Box(0.02, 0.02, 0.045), 0.3, 0.3, 5e4)
WALL = Surface("wall", Box(0.1, 0.02, 0.1), at(600.0, 170.0, TABLE_MM + 100.0), 5e4, 0.0, 0.3)
LOW = TABLE_MM + 30.0
LID_AT = at(600.0, 115.0, TABLE_MM + 70.0)  # 20 mm of it stand out over the block, towards +y
FRONT_MM = 150.0  # the lid is 10 mm from it, the block 30 mm


def pushed(
    *more: tuple[Part, Transform], surfaces: tuple[Surface, ...] = (TABLE,), way_mm: float, speed: float
) -> tuple[Scene, Books, float, list[float]]:
    """A block with a lid on it, pushed along y by closed jaws; how deep (mm) parts are in each other at most,
    and the force (N) against its way that the arm feels in each tick."""
    scene = Scene((BLOCK, at(600.0, 100.0, LOW)), (LID, LID_AT), *more, surfaces=surfaces)
    scene.controller.io.set_output(CLOSE, True)
    scene.goes(down(600.0, 60.0, TABLE_MM + 200.0), straight=False)
    scene.goes(down(600.0, 60.0, LOW))
    books, deepest, felt = Books(scene), 0.0, []
    scene.controller.move(lin_move(down(600.0, 72.0 + way_mm, LOW), speed, 0.0))
    while scene.controller.moving:
        books.step()
        deepest = max(deepest, deepest_mm(books.pieces))
        felt.append(-scene.controller.cartesian_force()[1])
    return scene, books, deepest, felt


@pytest.mark.parametrize("speed", [pytest.param(0.02, marks=pytest.mark.slow), 0.1, 0.3])
def test_what_runs_into_a_wall_slides_back_on_what_carries_it(speed: float) -> None:
    """By friction, which the arm feels besides that of both on the table."""
    scene, books, _, felt = pushed(surfaces=(TABLE, WALL), way_mm=18.0, speed=speed)
    lid, block = scene.body("lid"), scene.body("block")
    assert (lid.state, lid.on) == (LIES, "block")
    assert block.pose.translation[1] > 0.117, "the block goes on"
    assert 1e3 * (lid.pose.translation[1] + 0.025) - FRONT_MM < 0.5
    assert abs(lid.pose.translation[0] - 0.6) < 1e-3
    assert books.returned_j <= ROUNDING_J
    if speed < 0.1:  # slow enough for all to go as the jaws do
        table_n = BLOCK.friction * (BLOCK.mass_kg + LID.mass_kg) * G
        lid_n = LID.friction * LID.mass_kg * G
        n = len(felt)
        assert median(felt[3 * n // 4 : 9 * n // 10]) == pytest.approx(table_n + lid_n, rel=0.02)


@pytest.mark.parametrize("speed", [pytest.param(0.02, marks=pytest.mark.slow), 0.1, 0.3])
def test_it_pushes_a_part_that_stands_there(speed: float) -> None:
    ahead = NEXT, at(600.0, FRONT_MM + 20.0, TABLE_MM + 45.0)
    scene, books, deepest, _ = pushed(ahead, way_mm=40.0, speed=speed)
    assert scene.body("next").pose.translation[1] > 0.189
    assert deepest < 0.5
    assert books.returned_j <= ROUNDING_J


@pytest.mark.parametrize(("heavy_kg", "rises"), [(0.2, True), (5.0, False)])
def test_what_was_pressed_down_rises_with_what_is_put_on_it_if_its_spring_can_lift_both(
    heavy_kg: float, *, rises: bool
) -> None:
    """What is held presses the lower part more than 0.5 mm into the table, and is let go of there."""
    lower = Part("lower", Box(0.03, 0.03, 0.02), 0.2, 0.5, 5e4)
    upper = BLOCK._replace(mass_kg=heavy_kg, friction=2.0)
    scene = Scene(
        (upper, at(600, 100, TABLE_MM + 30.0)),
        (lower, at(600, -60, TABLE_MM + 20.0)),
        jaws=JAWS._replace(force_n=200.0),
    )
    alone_m = scene.body("lower").pose.translation[2]
    scene.picks(600, 100, TABLE_MM + 20.0)
    scene.goes(down(600, 100, TABLE_MM + 100.0))
    scene.goes(down(600, -60, TABLE_MM + 100.0))
    books = Books(scene, carried=True)
    above_mm = 1e3 * scene.body(upper.name).pose.translation[2] - 70.0 - TABLE_MM
    scene.controller.move(lin_move(down(600, -60, TABLE_MM + 100.0 - above_mm - 2.0), 0.05, 0.0))
    while scene.controller.moving:
        books.step()
    assert scene.body("lower").pose.translation[2] < alone_m - 5e-4
    pressed_m = scene.body("lower").pose.translation[2]
    scene.controller.io.set_output(CLOSE, False)
    for _ in range(500):
        books.step()
    assert scene.body(upper.name).on == "lower"
    assert scene.body("lower").pose.translation[2] == pytest.approx(alone_m if rises else pressed_m, abs=1e-5)
    assert books.returned_j <= 0.02 * books.arm_j


@settings(max_examples=some(20), deadline=None)
@given(st.lists(st.floats(-0.3, 0.3), min_size=4, max_size=4), st.floats(-6.0, 6.0), st.floats(30.0, 90.0))
def test_what_lands_on_parts_that_slide_on_each_other_brings_them_nothing(
    fast: list[float], spin: float, far_mm: float
) -> None:
    """All of them get slower, also the lower one, and the more the farther out it lands on one that turns.

    Once only the upper one did, and of the arm's work 0.04 % came from nowhere.
    """
    plate = Part("plate", Box(0.1, 0.1, 0.01), 0.5, 0.1, 5e4)
    lid, lands = plate._replace(name="lid", shape=Box(0.1, 0.1, 0.005)), NEXT._replace(name="lands")
    scene = Scene(
        (plate, at(600.0, 0.0, TABLE_MM + 10.0)),
        (lid, at(600.0, 0.0, TABLE_MM + 25.0)),
        (lands, at(600.0 + far_mm, 0.0, TABLE_MM + 78.0)),
    )
    scene.robot.step(1)
    handling = scene.handling
    kept, (u, v, w, x) = handling.kept(), fast
    below, upon, falls = kept.parts.bodies
    bodies = (below._replace(velocity=(u, v, 0.0), spin=spin), upon._replace(velocity=(w, x, 0.0)), falls)
    handling.restore(kept._replace(parts=kept.parts._replace(bodies=bodies)), scene.controller.tcp())
    books = Books(scene)
    for _ in range(40):
        books.step()
    assert scene.body("lands").on == "lid"
    assert books.returned_j <= ROUNDING_J

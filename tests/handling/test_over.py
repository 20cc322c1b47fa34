"""A held part over what its corners are beside: narrower, or turned otherwise."""

from __future__ import annotations

from math import pi

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.backdoor.states import States
from iiwa_sim.contact.shapes import Box, Cylinder, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Frame, Transform
from iiwa_sim.handling.falling import LIES
from iiwa_sim.handling.part import Part
from tests.asked import lin_force_move, lin_move
from tests.handling.books import G
from tests.handling.scenes import DOWN, JAWS, TABLE, TABLE_MM, Scene, at, down
from tests.samples import some

HALF_MM = 15.0
WIDE = Part("wide", Box(0.025, 0.02, 0.015), 0.3, 0.5, 5e4)
DISC = Part("disc", Cylinder(0.025, 0.015), 0.3, 0.5, 5e4)
RAIL = Surface("rail", Box(0.2, 0.0045, 0.02), at(600.0, -100.0, TABLE_MM + 20.0), 2e4, 0.0, 0.3)
ON_ITS_SIDE = Frame(600.0, -100.0, TABLE_MM + 12.0, 0.0, pi / 2, 0.0).to_transform()


def lying(shape: Shape, height_mm: float, turn: float = 0.0, x_mm: float = 600.0) -> tuple[Part, Transform]:
    return Part("low", shape, 0.5, 0.5, 5e4), at(x_mm, -100.0, TABLE_MM + 0.5 * height_mm, turn)


def held_above(
    low: tuple[Part, Transform] | None, part: Part = WIDE, surfaces: tuple[Surface, ...] = ()
) -> Scene:
    """A part in the jaws, above what lies at 600 -100, or stands there."""
    parts = [(part, at(600.0, 150.0, TABLE_MM + HALF_MM)), *([low] if low else [])]
    scene = Scene(*parts, surfaces=(TABLE, *surfaces))
    scene.picks(600.0, 150.0, TABLE_MM + HALF_MM)
    scene.goes(down(600.0, 150.0, TABLE_MM + 120.0))
    scene.goes(down(600.0, -100.0, TABLE_MM + 120.0))
    return scene


def felt_at_mm(scene: Scene) -> float:
    """How high above the table the underside of the part is when a force move has ended on what it feels."""
    scene.controller.move(lin_force_move(down(600.0, -100.0, TABLE_MM), 0.02, 0.0, (1e3, 1e3, 10.0)))
    scene.robot.runs_until_stopped()
    assert len(scene.robot.contacts) == 1, "it has gone through"
    return 1e3 * scene.body(scene.handling.workpieces.held).bottom - TABLE_MM  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("low", "height_mm"),
    [
        (lying(Box(0.015, 0.01, 0.02), 40.0), 40.0),
        (lying(Box(0.025, 0.02, 0.02), 40.0, turn=0.001), 40.0),
        (lying(Box(0.025, 0.02, 0.02), 40.0, turn=0.5), 40.0),
        (lying(Box(0.01, 0.04, 0.02), 40.0), 40.0),  # across
        (lying(Box(0.025, 0.02, 0.02), 40.0, turn=0.3, x_mm=630.0), 40.0),
        (lying(Cylinder(0.012, 0.02), 40.0), 40.0),
        ((Part("low", Cylinder(0.012, 0.03), 0.5, 0.5, 5e4), ON_ITS_SIDE), 24.0),
    ],
    ids=["narrower", "turned by 1 mrad", "turned", "across", "beside", "pin", "pin on its side"],
)
@pytest.mark.parametrize("part", [WIDE, DISC], ids=["box", "cylinder"])
def test_a_force_move_ends_on_what_no_corner_meets(
    part: Part, low: tuple[Part, Transform], height_mm: float
) -> None:
    """So far the one went through the other, with 0 N."""
    scene = held_above(low, part)
    assert felt_at_mm(scene) == pytest.approx(height_mm, abs=4.0)
    scene.closes(closed=False)
    scene.rests()
    assert scene.body(part.name).state == LIES


def test_so_it_does_on_a_rail() -> None:
    assert felt_at_mm(held_above(None, surfaces=(RAIL,))) == pytest.approx(40.0, abs=4.0)


@settings(max_examples=some(20), deadline=None)
@given(st.floats(-0.7, 0.7), st.floats(-20.0, 20.0), st.floats(0.004, 0.03))
def test_it_is_as_stiff_wherever_it_meets_the_other(turn: float, off_mm: float, half_m: float) -> None:
    """However the other is turned, and beside it: as on one of its own size."""
    forces = []
    for low in (
        lying(Box(0.025, 0.02, 0.02), 40.0),
        lying(Box(0.02, half_m, 0.02), 40.0, turn, 600.0 + off_mm),
    ):
        scene = held_above(low)
        scene.goes(down(600.0, -100.0, TABLE_MM + 40.0 + HALF_MM - 0.5), 0.02)
        forces.append(scene.controller.cartesian_force()[2])
    assert forces[1] == pytest.approx(forces[0], rel=0.02)


def test_what_comes_from_beside_is_not_lifted() -> None:
    """Past a rail, deeper than that is high: its sides may press, its underside does not."""
    post = Surface("post", Box(0.005, 0.005, 0.02), at(600.0, -100.0, TABLE_MM + 20.0), 2e4, 0.0, 0.3)
    scene = held_above(None, surfaces=(post,))
    scene.goes(down(600.0, 0.0, TABLE_MM + 120.0))
    scene.goes(down(600.0, 0.0, TABLE_MM + 50.0))
    weight_n = scene.controller.cartesian_force()[2]
    scene.controller.move(lin_move(down(600.0, -200.0, TABLE_MM + 50.0), 0.1, 0.0))
    while scene.controller.moving:
        scene.robot.step()
        assert scene.controller.cartesian_force()[2] == pytest.approx(weight_n, abs=1.0)


def test_a_named_state_keeps_how_it_presses() -> None:
    scene = held_above(None, surfaces=(RAIL,))
    felt_at_mm(scene)
    scene.rests()
    force = scene.controller.cartesian_force()
    states = States(scene.controller)
    states.save("pressed")
    scene.goes(down(600.0, -100.0, TABLE_MM + 120.0))
    states.restore("pressed")
    scene.robot.step(3)
    assert scene.controller.cartesian_force() == pytest.approx(force, abs=1e-9)


def test_moved_along_what_it_presses_on_it_presses_as_long_as_it_is_over_it() -> None:
    scene = held_above(lying(Box(0.01, 0.01, 0.02), 40.0))
    felt_at_mm(scene)
    scene.rests()
    pressed_n = scene.controller.cartesian_force()[2]
    z_mm = scene.controller.tool_frame().z_mm
    scene.goes(down(620.0, -100.0, z_mm), 0.02)
    assert scene.controller.cartesian_force()[2] == pytest.approx(pressed_n, rel=0.05)
    scene.goes(down(640.0, -100.0, z_mm), 0.02)
    assert scene.controller.cartesian_force()[2] == pytest.approx(2.943, abs=0.05)


def test_pressed_deep_into_what_is_below_it_takes_that_nowhere() -> None:
    """There is no friction where its corners are beside that. Once, pressed in by more than
    1 mm, it pushed that like a wall, against the post behind it, with 180 N."""
    post = Surface("post", Box(0.02, 0.005, 0.015), at(600.0, -85.0, TABLE_MM + 15.0), 2e5, 0.0, 0.0)
    scene = held_above(lying(Box(0.01, 0.01, 0.02), 40.0), surfaces=(post,))
    z_mm = TABLE_MM + 40.0 + HALF_MM
    scene.goes(down(600.0, -100.0, z_mm - 3.5), 0.02)
    deep_mm = 1e3 * (scene.body("low").pose.translation[2] - scene.body("wide").bottom) + 20.0
    assert deep_mm > 1.0
    scene.goes(down(600.0, -93.0, z_mm - 3.5), 0.02)
    assert abs(scene.controller.cartesian_force()[1]) < 1.0


def test_pressed_by_what_is_round_it_slides_where_the_jaws_hold_no_more() -> None:
    """Once it stayed where it was in the jaws: these felt what they hold at most, and what lies below three
    times that."""
    ball = Part("low", Sphere(0.02), 0.5, 0.5, 5e4), at(600.0, -100.0, TABLE_MM + 20.0)
    scene = held_above(ball)
    most_n = 2.0 * WIDE.friction * JAWS.force_n
    scene.goes(down(600.0, -100.0, TABLE_MM + 40.0 + HALF_MM - 6.0), 0.02)
    scene.rests()
    held = scene.handling.workpieces.in_jaws  # type: ignore[union-attr]
    assert held is not None
    assert 1e3 * held.in_tcp.translation[2] < -0.5
    assert held.touching.force[2] == pytest.approx(most_n + WIDE.mass_kg * G, rel=0.01)


def test_tilted_it_does_not_press_there_any_more() -> None:
    """What is not level meets others with its corners alone, also where it has been level before."""
    scene = held_above(None, surfaces=(RAIL,))
    felt_at_mm(scene)
    frame = scene.controller.tool_frame()
    scene.goes(Frame(frame.x_mm, frame.y_mm, frame.z_mm, DOWN[0], 0.02, DOWN[2]), 0.02)
    assert scene.controller.cartesian_force()[2] == pytest.approx(2.943, abs=0.05)

"""Parts that come down beside others: none comes to lie in another, and none is lifted."""

from __future__ import annotations

from itertools import combinations
from math import hypot

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.handling.falling import LIES
from iiwa_sim.handling.part import Part
from iiwa_sim.handling.room import CLEAR_M, Outline, outline_of
from iiwa_sim.handling.workpieces import Workpieces
from tests.asked import lin_move
from tests.handling.scenes import TABLE, TABLE_MM, Scene, at, down
from tests.samples import some

CUBE = Box(0.02, 0.02, 0.02)
SHAPES = [CUBE, Box(0.03, 0.01, 0.02), Box(0.01, 0.02, 0.03), Cylinder(0.015, 0.02)]


def part(name: str, shape: Box | Cylinder | Sphere = CUBE, mass_kg: float = 0.2) -> Part:
    return Part(name, shape, mass_kg, 0.5, 5e4)


def pieces_of(scene: Scene) -> Workpieces:
    found = scene.handling.workpieces
    assert found is not None
    return found


def outlines(scene: Scene) -> list[Outline]:
    lying = [each for each in pieces_of(scene).bodies.values() if each.state == LIES]
    seen = [outline_of(each.part.name, each.part.shape, each.pose, 5e4) for each in lying]
    assert None not in seen
    return [each for each in seen if each is not None]


def place(scene: Scene, name: str) -> tuple[float, ...]:
    """In mm."""
    return tuple(1e3 * each for each in scene.body(name).pose.translation)


def test_what_comes_down_past_an_edge_comes_down_beside() -> None:
    """Its middle 1 mm beyond the edge of what it comes past, which stays where it is."""
    scene = Scene((part("stands"), at(600, 0, TABLE_MM + 20)), (part("falls"), at(621, 3, TABLE_MM + 90)))
    scene.rests()
    x, y, _ = place(scene, "falls")
    assert (x, y) == pytest.approx((640.0 + 1e3 * CLEAR_M, 3.0), abs=1e-6)
    assert scene.body("falls").on == "table"
    assert place(scene, "stands")[:2] == (600.0, 0.0)


def test_what_has_no_room_between_two_lies_on_them_until_it_has() -> None:
    scene = Scene(
        (part("left"), at(600, -35, TABLE_MM + 20)),
        (part("right"), at(600, 35, TABLE_MM + 20)),
        (part("falls"), at(600, 1, TABLE_MM + 90)),
    )
    scene.rests()
    assert scene.body("falls").on == "left"
    assert place(scene, "falls")[2] == pytest.approx(TABLE_MM + 60.0, abs=0.5)
    pieces_of(scene).remove("right")
    pieces_of(scene).remove("left")
    scene.rests()
    assert scene.body("falls").on == "table"


def test_what_falls_beside_something_higher_is_not_lifted_onto_it() -> None:
    """What it lies on is taken away: its middle is above the top of what stands beside, its lowest place is
    not."""
    scene = Scene(
        (part("goes", Box(0.005, 0.02, 0.01)), at(600, 0, TABLE_MM + 10)),
        (part("stands", Box(0.02, 0.02, 0.015)), at(626, 0, TABLE_MM + 15)),
        (part("falls", Box(0.015, 0.015, 0.03)), at(600, 0, TABLE_MM + 50)),
    )
    scene.rests()
    pieces, highest = pieces_of(scene), scene.body("falls").bottom
    pieces.remove("goes")
    while not scene.controller.resting:
        scene.robot.step()
        assert scene.body("falls").bottom <= highest + 1e-9
        highest = min(highest, scene.body("falls").bottom)
    assert scene.body("falls").on == "table"


@settings(max_examples=some(60), deadline=None)
@given(
    st.lists(st.sampled_from(SHAPES), min_size=2, max_size=4),
    st.lists(st.tuples(st.floats(-35, 35), st.floats(-35, 35), st.floats(-3, 3)), min_size=4, max_size=4),
)
def test_no_two_parts_come_to_lie_in_each_other(
    shapes: list[Box | Cylinder | Sphere], places: list[tuple[float, float, float]]
) -> None:
    """However they come down on each other, one after the other; and their middles never rise."""
    scene = Scene(
        *(
            (part(f"part {number}", shape), at(600 + x, y, TABLE_MM + 40 + 150 * number, angle))
            for number, (shape, (x, y, angle)) in enumerate(zip(shapes, places, strict=False))
        )
    )
    heights = {name: each.pose.translation[2] for name, each in pieces_of(scene).bodies.items()}
    while not scene.controller.resting:
        scene.robot.step()
        for name, each in pieces_of(scene).bodies.items():
            assert each.pose.translation[2] <= heights[name] + 1e-9
            heights[name] = each.pose.translation[2]
    found = outlines(scene)
    assert len(found) == len(shapes)
    for one, other in combinations(found, 2):
        if one.low < other.top - 1e-3 and other.low < one.top - 1e-3:
            assert not one.is_in(other), (one, other)


@settings(max_examples=some(15), deadline=None)
@given(
    st.sampled_from([*SHAPES, Sphere(0.02)]),
    st.sampled_from([*SHAPES, Sphere(0.02)]),
    st.tuples(st.floats(-30, 30), st.floats(-30, 30)),
    st.sampled_from([0.05, 0.5, 2.0]),
)
def test_what_has_come_down_beside_another_is_not_shot_off_as_that_is_pushed(
    falls: Box | Cylinder | Sphere, stands: Box | Cylinder | Sphere, off: tuple[float, float], mass_kg: float
) -> None:
    """By closed jaws, at 0.05 m/s."""
    scene = Scene(
        (
            part("stands", stands, mass_kg),
            at(600, 0, TABLE_MM + 1e3 * part("", stands).reach(at(0, 0, 0).rotation, 2)),
        ),
        (part("falls", falls), at(600 + off[0], off[1], TABLE_MM + 120)),
        surfaces=(TABLE._replace(stiffness=5e4),),
    )
    scene.closes()
    scene.rests()
    scene.goes(down(600, -90, TABLE_MM + 60), straight=False)
    scene.goes(down(600, -90, TABLE_MM + 8))
    scene.controller.move(lin_move(down(600, 0, TABLE_MM + 8), 0.05, 0.0))
    while scene.controller.moving:
        scene.robot.step()
        for each in pieces_of(scene).bodies.values():
            assert hypot(*each.velocity) < 0.4


@pytest.mark.parametrize("other", [CUBE, Sphere(0.02), Cylinder(0.015, 0.02)])
def test_what_falls_in_each_other_comes_to_lie_beside_each_other(other: Box | Cylinder | Sphere) -> None:
    """Parts in the air meet nothing; the one that lands last is moved."""
    scene = Scene(
        (part("one"), at(600, 0, TABLE_MM + 100)), (part("other", other), at(610, 4, TABLE_MM + 101))
    )
    scene.rests()
    one, two = outlines(scene)
    assert one.depth(two) <= 0.0


def test_what_lands_in_a_ball_goes_past_what_is_beside_that() -> None:
    """Straight out of the ball it would be in the other part, and back it is farther than both are long."""
    scene = Scene(
        (part("ball", Sphere(0.025)), at(600, 0, TABLE_MM + 25)),
        (part("beside"), at(650, 0, TABLE_MM + 20)),
        (part("falls", Cylinder(0.015, 0.02)), at(606, 0, TABLE_MM + 120)),
    )
    scene.rests()
    for one, other in combinations(outlines(scene), 2):
        assert one.depth(other) <= 0.0
    assert scene.body("falls").on == "table"


def test_a_table_that_rises_lifts_what_lies_on_it_and_nothing_onto_what_that_lies_in() -> None:
    scene = Scene(
        (part("stands", Box(0.02, 0.02, 0.01)), at(600, 0, TABLE_MM + 10)),
        (part("beside", Box(0.01, 0.01, 0.03)), at(700, 0, TABLE_MM + 30)),
    )
    pieces = pieces_of(scene)
    inside = pieces.bodies["beside"]._replace(pose=at(600, 0, TABLE_MM + 29.7))
    pieces.put_aside(inside)
    pieces.surfaces_are([TABLE._replace(pose=at(600, 0, TABLE_MM - 20.0 + 0.5))])
    scene.rests()
    assert place(scene, "beside")[2] == pytest.approx(TABLE_MM + 30.0, abs=0.6)
    assert scene.body("beside").on == "table"

"""Several parts in a row between the jaws: they stop these, and none is held."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.backdoor.states import States
from iiwa_sim.contact.shapes import Box, Cylinder
from iiwa_sim.handling.falling import LIES
from iiwa_sim.handling.part import Part
from tests.handling.scenes import CLOSE, HOLDS, JAWS, TABLE_MM, Scene, at, down
from tests.samples import some

HALF_HIGH_M = 0.03
GRASP_MM = TABLE_MM + 35.0
WIDE_JAWS = JAWS._replace(stroke_m=0.2)


def slab(name: str, half_m: float, *, is_round: bool = False) -> Part:
    shape = Cylinder(half_m, HALF_HIGH_M) if is_round else Box(0.02, half_m, HALF_HIGH_M)
    return Part(name, shape, 0.2, 0.5, 5e4)


def between_jaws(*widths_mm: float, gap_mm: float = 0.5, off_mm: float = 0.0, round_ones: int = 0) -> Scene:
    """Parts of these widths in a row along y, not quite in the middle between open jaws."""
    y_mm = 50.0 + off_mm - 0.5 * (sum(widths_mm) + gap_mm * (len(widths_mm) - 1))
    parts = []
    for number, wide_mm in enumerate(widths_mm):
        y_mm += 0.5 * wide_mm
        part = slab(f"part {number}", 5e-4 * wide_mm, is_round=number < round_ones)
        parts.append((part, at(600.0, y_mm, TABLE_MM + 1e3 * HALF_HIGH_M)))
        y_mm += 0.5 * wide_mm + gap_mm
    scene = Scene(*parts, jaws=WIDE_JAWS)
    scene.goes(down(600.0, 50.0, GRASP_MM + 80.0), straight=False)
    scene.goes(down(600.0, 50.0, GRASP_MM))
    return scene


def assert_squeezed(scene: Scene, *widths_mm: float) -> None:
    """Side by side, all of them lie, and fill the room between the jaws."""
    gripper = scene.handling.state
    assert (gripper.state, gripper.opening_mm) == ("holds", pytest.approx(sum(widths_mm)))
    assert scene.controller.io.input(HOLDS)
    places = sorted(1e3 * scene.body(f"part {k}").pose.translation[1] for k in range(len(widths_mm)))
    assert [b - a for a, b in pairwise(places)] == pytest.approx(
        [0.5 * (a + b) for a, b in pairwise(widths_mm)], abs=1e-3
    )
    assert places[0] - 0.5 * widths_mm[0] == pytest.approx(50.0 - 0.5 * sum(widths_mm), abs=1e-3)
    assert all(each.state == "lies" for each in scene.handling.parts)


@settings(max_examples=some(20), deadline=None)
@given(
    st.lists(st.floats(6.0, 40.0), min_size=2, max_size=4),
    st.floats(0.01, 4.0),
    st.floats(-8.0, 8.0),
    st.integers(0, 2),
)
def test_parts_in_a_row_stop_the_jaws_and_stay_where_these_have_brought_them(
    widths_mm: list[float], gap_mm: float, off_mm: float, round_ones: int
) -> None:
    """So far the jaws closed through them."""
    scene = between_jaws(*widths_mm, gap_mm=gap_mm, off_mm=off_mm, round_ones=round_ones)
    scene.closes()
    scene.rests()
    assert_squeezed(scene, *widths_mm)


def test_as_the_robot_lifts_they_stay_and_the_jaws_close() -> None:
    scene = between_jaws(20.0, 30.0)
    scene.closes()
    scene.goes(down(600.0, 50.0, GRASP_MM + 80.0))
    scene.rests()
    assert scene.handling.state.state == "closed"
    assert not scene.controller.io.input(HOLDS)
    assert {scene.body(f"part {k}").on for k in range(2)} == {"table"}


def test_they_go_along_with_the_jaws_across_these() -> None:
    scene = between_jaws(20.0, 30.0)
    scene.closes()
    scene.goes(down(600.0, 80.0, GRASP_MM), 0.1)
    scene.rests()
    assert scene.handling.state.opening_mm == pytest.approx(50.0)
    assert scene.body("part 0").pose.translation[1] == pytest.approx(0.065, abs=1e-5)
    assert scene.body("part 1").pose.translation[1] == pytest.approx(0.09, abs=1e-5)


def test_of_a_row_from_which_one_is_taken_the_other_is_held() -> None:
    scene = between_jaws(20.0, 30.0)
    scene.closes()
    scene.handling.remove("part 0")
    scene.robot.step(200)
    scene.rests()
    assert scene.handling.workpieces is not None
    assert scene.handling.workpieces.held == "part 1"


def test_two_abreast_in_front_of_a_third_need_the_room_of_the_wider_one() -> None:
    abreast = slab("left", 0.008)._replace(shape=Box(0.008, 0.008, HALF_HIGH_M))
    wider = abreast._replace(name="right", shape=Box(0.008, 0.01, HALF_HIGH_M))
    z_mm = TABLE_MM + 1e3 * HALF_HIGH_M
    scene = Scene(
        (abreast, at(591.0, 38.0, z_mm)),
        (wider, at(609.0, 38.0, z_mm)),
        (slab("long", 0.01), at(600.0, 60.0, z_mm)),
    )
    scene.goes(down(600.0, 50.0, GRASP_MM + 80.0), straight=False)
    scene.goes(down(600.0, 50.0, GRASP_MM))
    scene.closes()
    scene.rests()
    assert scene.handling.state.opening_mm == pytest.approx(40.0)


def test_what_lies_on_each_other_is_no_row() -> None:
    flat = Part("flat", Box(0.02, 0.015, 0.008), 0.2, 0.5, 5e4)
    scene = Scene(
        (flat, at(600.0, 50.0, TABLE_MM + 8.0)),
        (flat._replace(name="upon"), at(600.0, 50.0, TABLE_MM + 24.0)),
    )
    scene.picks(600.0, 50.0, TABLE_MM + 20.0)
    assert scene.handling.workpieces is not None
    assert scene.handling.workpieces.held in ("flat", "upon")
    assert scene.handling.state.opening_mm == pytest.approx(30.0)


def test_a_named_state_keeps_that_they_are_squeezed() -> None:
    scene = between_jaws(20.0, 30.0)
    scene.closes()
    scene.rests()
    states = States(scene.controller)
    states.save("squeezed")
    scene.goes(down(600.0, 50.0, GRASP_MM + 80.0))
    states.restore("squeezed")
    assert_squeezed(scene, 20.0, 30.0)
    scene.robot.step(5)
    assert_squeezed(scene, 20.0, 30.0)


def test_opened_jaws_let_go_of_them_and_close_on_them_again() -> None:
    scene = between_jaws(20.0, 30.0, 10.0)
    scene.closes()
    scene.closes(closed=False)
    assert scene.handling.state.state == "open"
    scene.goes(down(600.0, 52.0, GRASP_MM))
    scene.controller.io.set_output(CLOSE, True)
    scene.closes()
    scene.rests()
    assert scene.handling.state.opening_mm == pytest.approx(60.0)
    assert all(scene.body(f"part {k}").state == LIES for k in range(3))


def test_what_is_round_stands_beside_what_is_round_as_near_as_it_touches() -> None:
    """Cylinders of 30 mm that are 18 mm apart across: 24 mm along y, and half a cylinder on both sides."""
    pin = slab("one", 0.015, is_round=True)
    z_mm = TABLE_MM + 1e3 * HALF_HIGH_M
    scene = Scene(
        (pin, at(591.0, 36.0, z_mm)), (pin._replace(name="other"), at(609.0, 64.0, z_mm)), jaws=WIDE_JAWS
    )
    scene.goes(down(600.0, 50.0, GRASP_MM + 80.0), straight=False)
    scene.goes(down(600.0, 50.0, GRASP_MM))
    scene.closes()
    scene.rests()
    assert scene.handling.state.opening_mm == pytest.approx(54.0)

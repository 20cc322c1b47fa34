"""Parts that are pushed, and push each other, in one tick: against closed forms, and without gain."""

from __future__ import annotations

from itertools import pairwise
from math import cos, sin

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.contact.crowd import PressingBall
from iiwa_sim.contact.shapes import Box, Cylinder, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Frame
from tests.contact.floor import BELOW, CUBE, FRICTION, SHAPES, TICK_S, Floor, G
from tests.interpreted import interpreted
from tests.samples import some


def test_what_nothing_touches_slides_for_itself_and_what_turns_is_braked() -> None:
    floor = Floor()
    floor.put(CUBE, 0.0, 0.0, velocity=(0.5, 0.0, 0.0, 0.0))
    floor.put(CUBE, 0.5, 0.0, velocity=(0.0, 0.0, 0.0, 5.0))
    floor.begin()
    (gone,) = floor.step()
    assert gone.part == 1
    assert 0.0 < gone.velocity[3] < 5.0
    assert not gone.pressed


def test_pressed_from_above_springs_and_inertia_share_the_depth() -> None:
    floor = Floor()
    floor.put(CUBE, 0.0, 0.0)
    floor.begin()
    top = floor.laid[0].solid.pose.translation[2] + 0.02
    (gone,) = floor.step((0, PressingBall((0.0, 0.0, top - 0.002 + 0.005), 0.005, 5e4)))
    assert gone.way == pytest.approx(
        (0.0, 0.0, -0.002 * 5e4 / (5e4 + BELOW + 0.2 / TICK_S**2), 0.0), rel=1e-9
    )


def test_pressed_from_below_a_part_is_lifted_by_its_share_of_the_depth() -> None:
    """What it lies on pushes with it, until it is off that: here it stays in by more."""
    floor = Floor()
    floor.put(CUBE, 0.0, 0.0)
    floor.begin()
    low = floor.laid[0].solid.pose.translation[2] - 0.02
    (gone,) = floor.step((0, PressingBall((0.0, 0.0, low + 1e-6 - 0.005), 0.005, 5e4)))
    assert gone.way == pytest.approx((0.0, 0.0, 1e-6 * 5e4 / (5e4 + BELOW + 0.2 / TICK_S**2), 0.0), rel=1e-9)


@pytest.mark.parametrize("count", [1, 2, 5, 10])
def test_a_row_takes_the_friction_of_all_that_are_in_it(count: int) -> None:
    """Pushed slowly by a ball, which is as deep in the first as that takes."""
    floor = Floor()
    for number in range(count):
        floor.put(CUBE, 0.04 * number, 0.0)
    floor.begin()
    at, forces = -0.02, []
    for tick in range(1500):
        at += 0.05 * TICK_S
        floor.step((0, PressingBall((at - 0.01, 0.0, 0.02), 0.01, 5e4)))
        depth = at - (floor.laid[0].solid.pose.translation[0] - 0.02)
        if tick >= 1000:
            forces.append(5e4 * max(0.0, depth))
    friction = FRICTION * 0.2 * G * count
    assert sum(forces) / len(forces) == pytest.approx(friction, rel=0.1)
    ends = [laid.solid.pose.translation[0] for laid in floor.laid]
    assert all(b - a == pytest.approx(0.04, abs=1e-3) for a, b in pairwise(ends))


def test_what_is_remembered_of_places_is_kept_and_brought_back() -> None:
    """A cube past the middle of a wall of 1 mm is pushed out the way it came in; as if for the first time,
    the nearest way, through it."""
    wall = Surface("wall", Box(0.0005, 0.1, 0.1), Frame(0, 0, 0, 0, 0, 0).to_transform(), 5e4, 0.0, 0.3)
    floor = Floor(wall)
    floor.put(CUBE, -0.0211, 0.0, velocity=(1.0, 0.0, 0.0, 0.0))
    floor.begin()
    for _ in range(2):
        floor.step()
    assert floor.laid[0].solid.pose.translation[0] > -0.02, "its face is past the middle of the wall"
    kept, before = floor.crowd.kept(), list(floor.laid)
    out = floor.step()
    floor.laid = list(before)
    floor.crowd.forget()
    floor.crowd.lay(0, before[0])
    assert floor.step() != out
    floor.laid = list(before)
    floor.crowd.restore(kept)
    floor.crowd.lay(0, before[0])
    assert floor.step() == out
    for _ in range(10):
        floor.step()
    assert floor.laid[0].solid.pose.translation[0] < -0.0205, "it is out again"


@pytest.mark.parametrize("on", [-1, 0])
def test_compiled_and_as_python_it_is_the_same(on: int) -> None:
    """A turned part, one beside it, a ball, which may go with the first, and a wall, pushed by a ball."""
    plain = interpreted("iiwa_sim.contact.crowd_kernel")
    wall = Surface("wall", Box(0.005, 0.2, 0.2), Frame(105, 0, 0, 0.1, 0, 0).to_transform(), 4e4, 0.0, 0.3)
    floors = [Floor(wall), Floor(wall, kernel=plain)]
    found = []
    for floor in floors:
        floor.put(CUBE, 0.0, 0.0, 0.2, (0.3, 0.0, 0.0, 2.0))
        floor.put(Cylinder(0.015, 0.02), 0.0375, 0.005)
        floor.put(Sphere(0.02), 0.07, 0.0)
        floor.laid[2] = floor.laid[2]._replace(on=on)
        floor.begin()
        found.append(
            [floor.step((0, PressingBall((-0.029 + 5e-4 * k, 0.004, 0.02), 0.01, 5e4))) for k in range(8)]
        )
    assert found[0] == found[1]
    assert sum(map(len, found[0])) >= 12, "they push each other"


place = st.floats(-0.06, 0.06)


@settings(max_examples=some(300), deadline=None)
@given(
    parts=st.lists(
        st.tuples(
            st.sampled_from(SHAPES),
            st.floats(-0.004, 0.004),
            st.floats(-0.02, 0.02),
            st.floats(-3.1, 3.1),
            st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.just(0.0), st.floats(-20.0, 20.0)),
        ),
        min_size=1,
        max_size=5,
    ),
    walls=st.lists(st.tuples(st.floats(-3.1, 3.1), st.floats(0.001, 0.02)), max_size=2),
    balls=st.lists(st.tuples(place, place, st.floats(0.0, 0.04), st.floats(0.0, 0.01)), max_size=3),
    friction=st.floats(0.0, 1.0),
)
def test_no_crowd_has_more_energy_than_there_was(
    parts: list[tuple[Shape, float, float, float, tuple[float, ...]]],
    walls: list[tuple[float, float]],
    balls: list[tuple[float, float, float, float]],
    friction: float,
) -> None:
    """Against the least there has been, with all that presses at rest; parts begin a little in each other."""
    floor = Floor(
        *(
            Surface(
                f"wall {number}",
                Box(half, 0.2, 0.2),
                Frame(70.0 * cos(angle), 70.0 * sin(angle), 0.0, angle, 0.0, 0.0).to_transform(),
                4e4,
                0.0,
                friction,
            )
            for number, (angle, half) in enumerate(walls)
        )
    )
    for number, (shape, x, y, angle, velocity) in enumerate(parts):
        floor.put(shape, 0.04 * number + x, y, angle, velocity)
    floor.begin()
    solid, held = floor.laid[0].solid, len(parts)
    pressing = [
        (0, PressingBall((x, y, z), radius, 3e4, held=held, place=number))
        for number, (x, y, z, radius) in enumerate(balls)
        if solid.nearest(x, y, z)[0] > radius
    ]
    floor.step(*pressing)
    least = floor.energy()
    for _ in range(30):
        floor.step(*pressing)
        now = floor.energy()
        assert now <= least + 1e-9 * max(1.0, least)
        least = min(least, now)

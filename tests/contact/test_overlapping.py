"""Parts that lie in each other; what turns on its spot, and what is carried: none has energy from nowhere."""

from __future__ import annotations

from math import pi, sqrt

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.contact.shapes import Box, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Frame
from iiwa_sim.handling.pushed_kernel import gone_by
from tests.contact.floor import BELOW, CUBE, FRICTION, SHAPES, TICK_S, Floor, G
from tests.samples import some


def test_parts_that_lie_in_each_other_hold_each_other_up() -> None:
    """1 mm deep, pushed further in: they go in no further than that stores."""
    floor = Floor()
    floor.put(CUBE, 0.0, 0.0, velocity=(0.3, 0.0, 0.0, 0.0))
    floor.put(CUBE, 0.039, 0.0)
    floor.begin()
    for _ in range(20):
        floor.step()
        first, other = (laid.solid.pose.translation[0] for laid in floor.laid)
        assert other - first > 0.038
    assert other > 0.04


def test_parts_that_lie_in_each_other_do_not_push_what_goes_away() -> None:
    floor = Floor()
    floor.put(CUBE, 0.0, 0.0, velocity=(-0.3, 0.0, 0.0, 0.0))
    floor.put(CUBE, 0.03, 0.0)
    floor.begin()
    for _ in range(20):
        floor.step()
    assert floor.laid[0].solid.pose.translation[0] < -0.005
    assert floor.laid[1].solid.pose.translation[0] == 0.03


def test_where_a_part_has_been_is_forgotten_as_it_comes_to_lie_elsewhere() -> None:
    floor = Floor()
    floor.put(CUBE, 0.0, 0.0, velocity=(0.3, 0.0, 0.0, 0.0))
    floor.put(CUBE, 0.0401, 0.0)
    floor.begin()
    floor.step()
    kept = floor.crowd.kept()
    assert kept != (b"", b"")
    floor.crowd.parted(2)
    assert floor.crowd.kept() == kept
    floor.crowd.parted(1)
    assert floor.crowd.kept() == (b"", b"")


def test_a_ball_that_turns_on_its_spot_is_braked_by_the_disc_on_which_it_touches() -> None:
    floor = Floor()
    floor.put(Sphere(0.02), 0.0, 0.0, velocity=(0.0, 0.0, 0.0, 20.0))
    floor.begin()
    for _ in range(10):
        floor.step()
    before = floor.laid[0].velocity[3]
    for _ in range(10):
        floor.step()
    weight = 0.2 * G
    torque = 3.0 * pi / 16.0 * FRICTION * weight * sqrt(0.02 * weight / BELOW)
    braked = 10 * TICK_S * torque / (0.4 * 0.2 * 0.02**2)
    assert before - floor.laid[0].velocity[3] == pytest.approx(braked, rel=0.02)


def test_what_is_lifted_by_its_spring_lifts_what_it_carries() -> None:
    """Pressed in by 0.2 mm and let go: a part that carries as much again accelerates by what is above both
    weights."""
    floor = Floor()
    floor.put(CUBE, 0.0, 0.0)
    pose = gone_by(floor.laid[0].solid.pose, (0.0, 0.0, -2e-4, 0.0))
    solid = floor.laid[0].solid._replace(pose=pose)
    floor.laid[0] = floor.laid[0]._replace(solid=solid, carries_kg=0.2, wound=(0.0,) * 8)
    floor.begin()
    (gone,) = floor.step()
    rises = BELOW * 2e-4 / (BELOW + 0.4 / TICK_S**2)
    assert gone.way[2] == pytest.approx(rises, rel=1e-9)


@settings(max_examples=some(200), deadline=None)
@given(
    parts=st.lists(
        st.tuples(
            st.sampled_from(SHAPES),
            st.floats(-0.03, 0.03),
            st.floats(-0.03, 0.03),
            st.floats(-3.1, 3.1),
            st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.just(0.0), st.floats(-5.0, 5.0)),
        ),
        min_size=2,
        max_size=4,
    ),
    angle=st.floats(-3.1, 3.1),
)
def test_parts_that_lie_in_each_other_and_in_a_wall_have_nothing_from_that(
    parts: list[tuple[Shape, float, float, float, tuple[float, ...]]], angle: float
) -> None:
    wall = Surface("wall", Box(0.004, 0.2, 0.2), Frame(10, 0, 0, angle, 0, 0).to_transform(), 4e4, 0.0, 0.3)
    floor = Floor(wall)
    for part in parts:
        floor.put(*part)
    floor.begin()
    least = floor.energy()
    for _ in range(30):
        floor.step()
        now = floor.energy()
        assert now <= least + 1e-9 * max(1.0, least)
        least = min(least, now)

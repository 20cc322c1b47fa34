"""By which way a place has come into a shape, and how deep it is then."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.ways_in_kernel import NOT_IN, way_out
from iiwa_sim.frames import IDENTITY, Transform, Vector, inverse, rotate, transform_from_euler
from tests.interpreted import interpreted
from tests.samples import some

PLAIN = interpreted("iiwa_sim.contact.ways_in_kernel")
SHAPES: list[Shape] = [
    Plane(),
    Box(0.05, 0.06, 0.02),
    Box(0.05, 0.002, 0.05),
    Sphere(0.03),
    Cylinder(0.03, 0.02),
    Cylinder(0.004, 0.05),
]
coordinate = st.floats(-0.08, 0.08)
walk = st.lists(st.tuples(coordinate, coordinate, coordinate), min_size=2, max_size=12)
turn = st.tuples(st.floats(-3.0, 3.0), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0))


def solid(shape: Shape, pose: Transform = IDENTITY) -> Surface:
    return Surface("it", shape, pose, 2e4, 0.0, 0.0)


@settings(max_examples=some(300))
@given(shape=st.sampled_from(SHAPES), angles=turn, places=walk, radius=st.sampled_from([0.0, 0.004, 0.05]))
def test_what_is_remembered_is_never_less_deep_than_the_nearest_point_and_is_told_alike_when_asked_again(
    shape: Shape, angles: Vector, places: list[Vector], radius: float
) -> None:
    """So who forgets gives work to nobody. And compiled and interpreted it is the same, bit for bit."""
    surface, came = solid(shape, transform_from_euler(0.01, 0.02, 0.03, *angles)), NOT_IN
    for place in places:
        found, after = way_out(surface, radius, place, came)
        assert (found, after) == PLAIN.way_out(surface, radius, place, came)
        assert found[0] <= surface.nearest(*place)[0] + 1e-12
        assert math.hypot(*found[1:]) == pytest.approx(1.0)
        assert rotate(inverse(surface.pose).rotation, (found[1], found[2], found[3])) == pytest.approx(
            after, abs=1e-9
        )
        again, remembered = way_out(surface, radius, place, after)
        assert again == pytest.approx(found, abs=1e-12)
        assert remembered == pytest.approx(after, abs=1e-12)
        came = after if found[0] < radius else NOT_IN


@settings(max_examples=some(100))
@given(
    shape=st.sampled_from(SHAPES[1:]),
    axis=st.sampled_from([0, 1, 2]),
    side=st.sampled_from([-1.0, 1.0]),
    radius=st.sampled_from([0.0, 0.004, 0.05]),
    off=st.floats(0.0, 0.3),
)
def test_straight_through_a_body_the_way_out_stays_the_same(
    shape: Shape, axis: int, side: float, radius: float, off: float
) -> None:
    """However thin it is, by steps of half a millimetre, and past its far side too."""
    surface, came, deepest = solid(shape), NOT_IN, -1.0
    sizes = [*shape, *shape, *shape] if isinstance(shape, Sphere) else [*shape]
    if isinstance(shape, Cylinder):
        sizes = [shape.radius, shape.radius, shape.half_z]
    # What is round is left sideways by who has come in beside its middle.
    flat = isinstance(shape, Box) or (isinstance(shape, Cylinder) and axis == 2)
    off *= min(sizes) if flat else 0.0
    for step in range(400):
        place = [0.0, 0.0, 0.0]
        place[axis], place[(axis + 1) % 3] = side * (0.1 - 5e-4 * step), off
        found, came_now = way_out(surface, radius, (place[0], place[1], place[2]), came)
        depth = radius - found[0]
        if depth > 0.0:
            assert side * came_now[axis] > 0.5
            assert depth > deepest, "it grows all the way"
            deepest = depth
        else:
            assert deepest < 0.0, "it does not come out"
        came = came_now if depth > 0.0 else NOT_IN
    assert deepest > 0.1, "it has gone through"


def test_beside_the_outline_it_is_forgotten() -> None:
    surface = solid(Box(0.05, 0.002, 0.05))
    _, came = way_out(surface, 0.0, (0.0, 0.0019, 0.0), NOT_IN)
    assert came == (0.0, 1.0, 0.0)
    (distance, *_), came = way_out(surface, 0.0, (0.04, -0.03, 0.0), came)
    assert (distance, came) == (pytest.approx(-0.032), (0.0, 1.0, 0.0))
    (distance, *_), came = way_out(surface, 0.0, (0.06, -0.03, 0.0), came)
    assert distance == pytest.approx(math.hypot(0.01, 0.028))

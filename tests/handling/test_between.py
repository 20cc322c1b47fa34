"""How far parts are at least from each other: compiled as interpreted, and never more than they are."""

from __future__ import annotations

from math import dist

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.frames import Transform, apply, transform_from_euler
from iiwa_sim.handling.between_kernel import between
from iiwa_sim.handling.part import Part, X, Y, Z
from tests.interpreted import interpreted
from tests.samples import some

PLAIN = interpreted("iiwa_sim.handling.between_kernel")
SHAPES = (Box(0.05, 0.02, 0.03), Cylinder(0.02, 0.04), Sphere(0.03))
places = st.tuples(*(st.floats(-0.2, 0.2) for _ in range(3)), *(st.floats(-3.0, 3.0) for _ in range(3)))


def inside(part: Part, pose: Transform, share: tuple[float, float, float]) -> tuple[float, float, float]:
    """Of a part at a pose, some place of it."""
    shape, (a, b, c) = part.shape, share
    if isinstance(shape, Box):
        own = (a * shape.half_x, b * shape.half_y, c * shape.half_z)
    elif isinstance(shape, Cylinder):
        own = (0.7 * a * shape.radius, 0.7 * b * shape.radius, c * shape.half_z)
    else:
        own = (0.57 * a * shape.radius, 0.57 * b * shape.radius, 0.57 * c * shape.radius)
    return apply(pose, own)


@settings(max_examples=some(100), deadline=None)
@given(
    st.sampled_from(SHAPES),
    st.sampled_from(SHAPES),
    places,
    places,
    *[st.tuples(*[st.floats(-1.0, 1.0)] * 3)] * 2,
)
def test_they_are_no_nearer_and_both_forms_say_the_same(one, other, place, there, here, beside) -> None:  # type: ignore[no-untyped-def]
    a, b = (Part(str(shape), shape, 0.5, 0.3, 1e5) for shape in (one, other))
    pose, away = transform_from_euler(*place), transform_from_euler(*there)
    least = between(a, pose, b, away)
    assert dist(inside(a, pose, here), inside(b, away, beside)) >= least - 1e-12
    assert PLAIN.between(a, pose, b, away) == least
    reaches = (
        abs(pose.translation[axis] - away.translation[axis])
        - a.reach(pose.rotation, axis)
        - b.reach(away.rotation, axis)
        for axis in (X, Y, Z)
    )
    assert least == pytest.approx(max(reaches), abs=1e-15)

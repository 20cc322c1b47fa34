"""A surface in its place is its shape, seen from there."""

from __future__ import annotations

from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.contact.shapes import Shape
from iiwa_sim.frames import Transform, apply, rotate, transform_from_euler
from tests.contact.materials import SHAPES, surface

angles, metres = st.floats(-pi, pi), st.floats(-2.0, 2.0)
poses = st.builds(transform_from_euler, metres, metres, metres, angles, angles, angles)


@given(st.sampled_from(SHAPES), poses, st.tuples(metres, metres, metres))
def test_distance_and_direction_move_with_the_pose(
    shape: Shape, pose: Transform, inside: tuple[float, float, float]
) -> None:
    expected, *local = shape.nearest(*inside)
    distance, *direction = surface(shape, pose).nearest(*apply(pose, inside))
    assert distance == pytest.approx(expected, abs=1e-12)
    if abs(expected) > 1e-6 and min(abs(place) for place in inside) > 1e-6:  # else rounding may choose a side
        nx, ny, nz = rotate(pose.rotation, (local[0], local[1], local[2]))
        other = pytest.approx((nx, ny, nz), abs=1e-6)
        assert tuple(direction) == other or expected < 0.0  # within, two faces may be equally near

"""Distances to shapes, against points on their surfaces and inside of them."""

from __future__ import annotations

from math import hypot, isclose

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Shape, Sphere

Array = NDArray[np.float64]
lengths = st.floats(0.01, 2.0)
places = st.floats(-2.0, 2.0, allow_subnormal=False)
points = st.tuples(places, places, places)
solids = st.one_of(
    st.builds(Box, lengths, lengths, lengths),
    st.builds(Sphere, lengths),
    st.builds(Cylinder, lengths, lengths),
)


def within(shape: Shape, point: tuple[float, float, float]) -> bool:
    """By the definition of the shape."""
    x, y, z = point
    match shape:
        case Box(a, b, c):
            return abs(x) <= a and abs(y) <= b and abs(z) <= c
        case Sphere(radius):
            return x * x + y * y + z * z <= radius * radius
        case Cylinder(radius, half):
            return x * x + y * y <= radius * radius and abs(z) <= half
    return z <= 0.0


@given(st.one_of(solids, st.just(Plane())), points)
def test_the_distance_is_negative_inside(shape: Shape, point: tuple[float, float, float]) -> None:
    distance = shape.nearest(*point)[0]
    if abs(distance) > 1e-12:
        assert (distance < 0.0) == within(shape, point)


@given(st.one_of(solids, st.just(Plane())), points)
def test_the_normal_is_a_unit_vector_through_the_nearest_point(
    shape: Shape, point: tuple[float, float, float]
) -> None:
    distance, nx, ny, nz = shape.nearest(*point)
    assert isclose(hypot(nx, ny, nz), 1.0, rel_tol=1e-12)
    x, y, z = point
    on_it = (x - distance * nx, y - distance * ny, z - distance * nz)
    assert abs(shape.nearest(*on_it)[0]) < 1e-12

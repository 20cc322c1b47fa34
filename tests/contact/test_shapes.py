"""Distances to shapes, against points all over their surfaces and against what is within."""

from __future__ import annotations

from math import hypot, isclose

import numpy as np
import pytest
from hypothesis import assume, given
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
def test_the_sign_tells_what_is_within(shape: Shape, point: tuple[float, float, float]) -> None:
    distance = shape.nearest(*point)[0]
    if abs(distance) > 1e-12:
        assert (distance < 0.0) == within(shape, point)


@given(st.one_of(solids, st.just(Plane())), points)
def test_the_direction_is_a_unit_vector_and_leads_to_the_surface(
    shape: Shape, point: tuple[float, float, float]
) -> None:
    distance, nx, ny, nz = shape.nearest(*point)
    assert isclose(hypot(nx, ny, nz), 1.0, rel_tol=1e-12)
    x, y, z = point
    on_it = (x - distance * nx, y - distance * ny, z - distance * nz)
    assert abs(shape.nearest(*on_it)[0]) < 1e-12


@pytest.mark.parametrize("shape", [Box(1.0, 1.0, 1.0), Sphere(1.0), Cylinder(1.0, 1.0)])
def test_in_the_middle_it_is_one_unit_to_the_surface(shape: Shape) -> None:
    distance, *direction = shape.nearest(0.0, 0.0, 0.0)
    assert distance == -1.0
    assert hypot(*direction) == 1.0


@given(st.builds(Box, lengths, lengths, lengths) | st.builds(Cylinder, lengths, lengths), points, points)
def test_the_face_that_was_entered_is_the_one_where_the_way_comes_in(
    solid: Box | Cylinder, start: tuple[float, float, float], end: tuple[float, float, float]
) -> None:
    assume(not within(solid, start))
    way = np.linspace(start, end, 300)
    inside = [point for point in way.tolist() if within(solid, (point[0], point[1], point[2]))]
    face = solid.entered(start, end)
    if face is None:
        # Nothing, or a corner that is smaller than the grid; a cylinder's mantle is no flat face.
        assert len(inside) < 3 or isinstance(solid, Cylinder)
        return
    axis, side = face
    half = solid.half_z if isinstance(solid, Cylinder) else solid[axis]
    assert side * start[axis] >= half >= side * end[axis], "from before the face to behind it"
    share = (side * half - start[axis]) / (end[axis] - start[axis])
    x, y, z = np.add(start, share * np.subtract(end, start)).tolist()
    found = solid.behind(face, *(0.999999 * np.array([x, y, z])).tolist())
    assert found is not None, "it comes in within the outline"
    assert found[0] == pytest.approx(0.0, abs=1e-5)
    assert found[1:] == tuple(side * (k == axis) for k in range(3))

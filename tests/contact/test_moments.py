"""Weight and inertia of bodies, as ten numbers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.contact.moments import Moments, added, body, difference, seen_from
from iiwa_sim.frames import Frame, apply
from tests.samples import some

numbers = st.floats(-1.0, 1.0)
places = st.tuples(numbers, numbers, numbers)
frames = st.builds(Frame, *[st.floats(-500.0, 500.0)] * 3, *[st.floats(-3.0, 3.0)] * 3)


def of_points(points: list[tuple[float, float, float]], mass: float) -> Moments:
    """Summed over points of one mass (kg) each."""
    r = np.array(points)
    second = mass * r.T @ r
    return Moments(
        mass * len(points),
        *(mass * r.sum(axis=0)).tolist(),
        *(float(second[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))),
    )


@settings(max_examples=some(60))
@given(points=st.lists(places, min_size=1, max_size=6), frame=frames)
def test_a_body_seen_from_elsewhere_is_its_points_seen_from_there(
    points: list[tuple[float, float, float]], frame: Frame
) -> None:
    pose = frame.to_transform()
    expected = of_points([apply(pose, point) for point in points], 0.5)
    assert seen_from(of_points(points, 0.5), pose) == pytest.approx(expected, abs=1e-12)


@settings(max_examples=some(60))
@given(points=st.lists(places, min_size=1, max_size=6))
def test_a_body_is_told_by_mass_centre_and_inertia(points: list[tuple[float, float, float]]) -> None:
    r = np.array(points)
    centre = r.mean(axis=0)
    off = r - centre
    inertia = 0.5 * sum(np.dot(each, each) * np.eye(3) - np.outer(each, each) for each in off)
    six = (*np.diag(inertia).tolist(), inertia[0, 1], inertia[0, 2], inertia[1, 2])
    x, y, z = centre.tolist()
    assert body(0.5 * len(points), (x, y, z), six) == pytest.approx(of_points(points, 0.5), abs=1e-12)


def test_bodies_that_are_fixed_to_each_other_add_up() -> None:
    one, other = of_points([(0.1, 0.2, 0.3)], 1.0), of_points([(-0.3, 0.0, 0.2), (0.1, 0.1, 0.0)], 1.0)
    both = of_points([(0.1, 0.2, 0.3), (-0.3, 0.0, 0.2), (0.1, 0.1, 0.0)], 1.0)
    assert added(one, other) == pytest.approx(both)
    assert difference(both, other) == pytest.approx(one)

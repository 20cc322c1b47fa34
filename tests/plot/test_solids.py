"""Surfaces as polygons."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import IDENTITY, Frame
from iiwa_sim.plot.solids import cut_off, outline, polygons
from iiwa_sim.plot.things import Rod, Solid
from tests.samples import some

LENGTH_M = st.floats(0.01, 1.0)
SHAPES = st.one_of(
    st.builds(Box, LENGTH_M, LENGTH_M, LENGTH_M),
    st.builds(Sphere, LENGTH_M),
    st.builds(Cylinder, LENGTH_M, LENGTH_M),
)
PLACE_MM = st.floats(-1000.0, 1000.0)
TURN = st.floats(-pi, pi)
POSES = st.builds(Frame, PLACE_MM, PLACE_MM, PLACE_MM, TURN, TURN, TURN)
VIEWS = st.sampled_from([(0, 1), (0, 2), (1, 2)])


def surface(shape: Shape, pose: Frame) -> Surface:
    return Surface("it", shape, pose.to_transform(), 1e5, 0.0, 0.0)


@settings(max_examples=some(40))
@given(SHAPES, POSES)
def test_corners_lie_on_the_surface_and_faces_are_flat(shape: Shape, pose: Frame) -> None:
    it = surface(shape, pose)
    for face in polygons(it):
        for x, y, z in 1e-3 * face:
            assert it.nearest(x, y, z)[0] == pytest.approx(0.0, abs=1e-9)
        flat = np.linalg.svd(face - face.mean(axis=0), compute_uv=False)[2]
        assert flat == pytest.approx(0.0, abs=1e-6)


@settings(max_examples=some(40))
@given(SHAPES, POSES, VIEWS)
def test_an_outline_holds_all_corners_and_has_none_that_it_does_not_need(
    shape: Shape, pose: Frame, axes: tuple[int, int]
) -> None:
    it = surface(shape, pose)
    corners = outline(it, axes)
    assert corners is not None
    along = np.roll(corners, -1, axis=0) - corners
    for point in np.concatenate(polygons(it))[:, list(axes)]:
        beside = along[:, 0] * (point - corners)[:, 1] - along[:, 1] * (point - corners)[:, 0]
        assert (beside > -1e-6 * (1.0 + np.linalg.norm(along, axis=1) * 1e3)).all(), (
            "to the left of all edges"
        )
    following = np.roll(along, -1, axis=0)
    assert (along[:, 0] * following[:, 1] - along[:, 1] * following[:, 0] > -1e-6).all()


def test_the_outline_of_a_sphere_is_round() -> None:
    corners = outline(surface(Sphere(0.1), Frame(50, 60, 70, 0, 0, 0)), (0, 1))
    assert corners is not None
    assert np.linalg.norm(corners - [50.0, 60.0], axis=1) == pytest.approx(100.0, abs=1e-9)


def test_a_rod_has_round_ends() -> None:
    for half_z in (0.0, 0.2):
        faces = polygons(Solid(Rod(0.1, half_z), IDENTITY))
        corners = 1e-3 * np.concatenate(faces)
        x, y, z = corners.T
        beyond = z - np.clip(z, -half_z, half_z)
        assert np.sqrt(x * x + y * y + beyond * beyond) == pytest.approx(0.1)
        assert (z.min(), z.max()) == pytest.approx((-half_z - 0.1, half_z + 0.1))
        for face in faces:
            assert np.linalg.svd(face - face.mean(axis=0), compute_uv=False)[2] == pytest.approx(
                0.0, abs=1e-6
            )


def test_a_plane_is_seen_from_the_side_only() -> None:
    floor = surface(Plane(), Frame(0, 0, 300, 0, 0, 0))
    assert outline(floor, (0, 1)) is None
    corners = outline(floor, (0, 2))
    assert corners is not None
    assert corners[:, 1].max() == pytest.approx(300.0)
    assert corners[:, 1].min() < -10_000.0
    assert corners[:, 0].min() < -10_000.0 < 10_000.0 < corners[:, 0].max()
    slanting = surface(Plane(), Frame(0, 0, 300, 0, 0.5, 0.5))
    assert outline(slanting, (0, 2)) is None


@settings(max_examples=some(60))
@given(SHAPES, POSES)
def test_what_is_cut_off_lies_within_and_the_rest_is_as_it_was(shape: Shape, pose: Frame) -> None:
    low, high = np.array([-200.0, -300.0, -400.0]), np.array([250.0, 350.0, 450.0])
    for face in polygons(surface(shape, pose)):
        left = cut_off(face, low, high)
        assert (left >= low - 1e-6).all()
        assert (left <= high + 1e-6).all()
        inside = face[((face >= low) & (face <= high)).all(axis=1)]
        assert all((left == corner).all(axis=1).any() for corner in inside)


def test_a_table_larger_than_the_scene_fills_it() -> None:
    low, high = np.full(3, -100.0), np.full(3, 100.0)
    (top,) = (
        face
        for face in (
            cut_off(each, low, high)
            for each in polygons(surface(Box(5.0, 5.0, 0.01), Frame(0, 0, 0, 0, 0, 0)))
        )
        if len(face) and face[:, 2].min() > 0.0
    )
    assert sorted(map(tuple, top.round(6))) == [
        (-100, -100, 10),
        (-100, 100, 10),
        (100, -100, 10),
        (100, 100, 10),
    ]

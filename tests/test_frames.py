"""Frames: conversions back and forth, also at singular angles."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from iiwa_sim.frames import (
    IDENTITY,
    Frame,
    Rotation,
    Transform,
    apply,
    compose,
    euler_from_rotation,
    inverse,
    multiply,
    quaternion_from_rotation,
    rotate,
    rotation_from_quaternion,
    transform_from_euler,
    transpose,
    turn_between,
)

angles = st.floats(-math.pi, math.pi)
lengths_m = st.floats(-2.0, 2.0)
small = st.sampled_from([0.0, 1e-300, 1e-17, 1e-15, 1e-12, 3e-12, 1e-9, 1e-6])
transforms = st.builds(transform_from_euler, lengths_m, lengths_m, lengths_m, angles, angles, angles)
rotations = transforms.map(lambda t: t.rotation)
directions = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: math.hypot(*v) > 1e-3)
axes = directions.map(lambda v: (v[0] / math.hypot(*v), v[1] / math.hypot(*v), v[2] / math.hypot(*v)))


def rotation_about(axis: tuple[float, float, float], angle: float) -> Rotation:
    """Return the rotation by an angle (rad) about a unit axis, by Pinocchio."""
    rotation: Rotation = tuple(pin.exp3(np.multiply(angle, axis)).ravel().tolist())
    return rotation


def assert_same(a: Rotation, b: Rotation, tolerance: float = 1e-12) -> None:
    assert np.abs(np.subtract(a, b)).max() <= tolerance


def about_z_y_x(alpha: float, beta: float, gamma: float) -> Rotation:
    """Return the rotation of angles on the wire by their definition, axis by axis."""
    about_y_x = multiply(rotation_about((0, 1, 0), beta), rotation_about((1, 0, 0), gamma))
    return multiply(rotation_about((0, 0, 1), alpha), about_y_x)


@given(angles, angles, angles)
def test_euler_angles_are_intrinsic_z_y_x(alpha: float, beta: float, gamma: float) -> None:
    rotation = transform_from_euler(0, 0, 0, alpha, beta, gamma).rotation
    assert_same(rotation, about_z_y_x(alpha, beta, gamma), 1e-15)


@given(angles, angles, angles)
def test_euler_angles_round_trip_in_their_ranges(alpha: float, beta: float, gamma: float) -> None:
    rotation = about_z_y_x(alpha, beta, gamma)
    a, b, c = euler_from_rotation(rotation)
    assert -math.pi < a <= math.pi
    assert abs(b) <= math.pi / 2
    assert -math.pi < c <= math.pi
    assert_same(about_z_y_x(a, b, c), rotation)


@given(angles, angles, small, st.sampled_from([1.0, -1.0]))
def test_euler_angles_round_trip_at_gimbal_lock(alpha: float, gamma: float, off: float, side: float) -> None:
    rotation = about_z_y_x(alpha, side * (math.pi / 2 - off), gamma)
    assert_same(about_z_y_x(*euler_from_rotation(rotation)), rotation)


@given(transforms, st.tuples(lengths_m, lengths_m, lengths_m))
def test_inverse_undoes(t: Transform, point: tuple[float, float, float]) -> None:
    back = compose(inverse(t), t)
    assert_same(back.rotation, IDENTITY.rotation)
    assert np.abs(back.translation).max() <= 1e-12
    assert apply(inverse(t), apply(t, point)) == pytest.approx(point, abs=1e-12)
    assert rotate(transpose(t.rotation), rotate(t.rotation, point)) == pytest.approx(point, abs=1e-12)


@given(rotations)
@example((1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0))
@example((-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0))
@example((-1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0))
def test_quaternion_round_trip_and_sign(rotation: Rotation) -> None:
    quaternion = quaternion_from_rotation(rotation)
    assert quaternion[3] >= 0.0
    assert sum(value * value for value in quaternion) == pytest.approx(1.0, abs=1e-14)
    assert_same(rotation_from_quaternion(quaternion), rotation)


@given(axes, st.one_of(st.floats(1e-3, math.pi - 1e-3), small, small.map(lambda off: math.pi - off)))
def test_turn_between_round_trip(axis: tuple[float, float, float], angle: float) -> None:
    found_axis, found_angle = turn_between(IDENTITY.rotation, rotation_about(axis, angle))
    assert 0.0 <= found_angle <= math.pi
    assert found_angle == pytest.approx(angle, abs=1e-12)
    assert math.hypot(*found_axis) == pytest.approx(1.0, abs=1e-14)
    assert_same(rotation_about(found_axis, found_angle), rotation_about(axis, angle))


@pytest.mark.requirement("FRC005")
@given(transforms)
def test_frame_and_transform(t: Transform) -> None:
    frame = Frame.from_transform(t)
    back = frame.to_transform()
    assert_same(back.rotation, t.rotation)
    assert np.abs(np.subtract(back.translation, t.translation)).max() <= 1e-12
    assert np.allclose(frame[:3], np.multiply(1e3, t.translation), rtol=0, atol=1e-9)

"""Rigid transforms and the frames x y z alpha beta gamma of the wire.

Plain Python floats throughout: for one transform at a time they are faster than arrays. Lengths are metres in
a `Transform` and millimetres in a `Frame`; angles are radians. Nothing here checks for finite numbers.
"""

from __future__ import annotations

from math import atan2, cos, hypot, pi, sin, sqrt
from typing import NamedTuple

Vector = tuple[float, float, float]
Rotation = tuple[float, float, float, float, float, float, float, float, float]
"""A rotation matrix, row by row."""
Quaternion = tuple[float, float, float, float]
"""A unit quaternion x, y, z, w."""

# Closer to beta = +-90 deg than this (rad), alpha and gamma turn about one axis and their split is noise.
GIMBAL_LOCK = 5e-13


class Transform(NamedTuple):
    """Pose of an inner frame in an outer one: a point p moves to `rotation @ p + translation`."""

    rotation: Rotation
    translation: Vector
    """m"""


IDENTITY = Transform((1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0))


class Frame(NamedTuple):
    """A frame as on the wire: mm, and intrinsic Z-Y-X angles in rad (alpha about z, beta y, gamma x)."""

    x_mm: float
    y_mm: float
    z_mm: float
    alpha: float
    beta: float
    gamma: float

    @classmethod
    def from_transform(cls, transform: Transform) -> Frame:
        """Return the frame of a pose that has its place in m."""
        x, y, z = transform.translation
        return cls(1e3 * x, 1e3 * y, 1e3 * z, *euler_from_rotation(transform.rotation))

    def to_transform(self) -> Transform:
        """Return this frame as a rotation matrix and a place in m."""
        x_mm, y_mm, z_mm, alpha, beta, gamma = self
        return transform_from_euler(1e-3 * x_mm, 1e-3 * y_mm, 1e-3 * z_mm, alpha, beta, gamma)


def multiply(a: Rotation, b: Rotation) -> Rotation:
    """Return the rotation `a @ b`."""
    a0, a1, a2, a3, a4, a5, a6, a7, a8 = a
    b0, b1, b2, b3, b4, b5, b6, b7, b8 = b
    return (
        a0 * b0 + a1 * b3 + a2 * b6, a0 * b1 + a1 * b4 + a2 * b7, a0 * b2 + a1 * b5 + a2 * b8,
        a3 * b0 + a4 * b3 + a5 * b6, a3 * b1 + a4 * b4 + a5 * b7, a3 * b2 + a4 * b5 + a5 * b8,
        a6 * b0 + a7 * b3 + a8 * b6, a6 * b1 + a7 * b4 + a8 * b7, a6 * b2 + a7 * b5 + a8 * b8,
    )  # fmt: skip


def transpose(rotation: Rotation) -> Rotation:
    """Return the inverse rotation."""
    r0, r1, r2, r3, r4, r5, r6, r7, r8 = rotation
    return (r0, r3, r6, r1, r4, r7, r2, r5, r8)


def rotate(rotation: Rotation, vector: Vector) -> Vector:
    """Return `rotation @ vector`."""
    r0, r1, r2, r3, r4, r5, r6, r7, r8 = rotation
    x, y, z = vector
    return (r0 * x + r1 * y + r2 * z, r3 * x + r4 * y + r5 * z, r6 * x + r7 * y + r8 * z)


def compose(a: Transform, b: Transform) -> Transform:
    """Pose of c in the outer frame: `a` is the pose of b in the outer frame, `b` the pose of c in b."""
    return Transform(multiply(a.rotation, b.rotation), apply(a, b.translation))


def inverse(t: Transform) -> Transform:
    """Pose of the outer frame in the inner one."""
    rotation = transpose(t.rotation)
    x, y, z = rotate(rotation, t.translation)
    return Transform(rotation, (-x, -y, -z))


def apply(t: Transform, point: Vector) -> Vector:
    """Return a point (m) of the inner frame, in the outer frame (m)."""
    x, y, z = rotate(t.rotation, point)
    tx, ty, tz = t.translation
    return (x + tx, y + ty, z + tz)


def transform_from_euler(
    x_m: float, y_m: float, z_m: float, alpha: float, beta: float, gamma: float
) -> Transform:
    """Transform with the rotation Rz(alpha) Ry(beta) Rx(gamma) (rad) and the translation x, y, z (m)."""
    ca, sa, cb, sb, cg, sg = cos(alpha), sin(alpha), cos(beta), sin(beta), cos(gamma), sin(gamma)
    rotation = (
        ca * cb, ca * sb * sg - sa * cg, ca * sb * cg + sa * sg,
        sa * cb, sa * sb * sg + ca * cg, sa * sb * cg - ca * sg,
        -sb, cb * sg, cb * cg,
    )  # fmt: skip
    return Transform(rotation, (x_m, y_m, z_m))


def euler_from_rotation(rotation: Rotation) -> Vector:
    """Return angles alpha, beta, gamma (rad) with `rotation` = Rz(alpha) Ry(beta) Rx(gamma).

    alpha and gamma lie in (-pi, pi], beta in [-pi/2, pi/2]. At beta = +-pi/2, where only the sum or
    difference of the other two is defined, gamma is 0. Near there alpha is inexact, but gamma is taken from
    the rest of the rotation: the three always give the rotation back.
    """
    r00, r01, r02, r10, r11, r12, r20, _, _ = rotation
    cos_beta = hypot(r00, r10)
    if cos_beta < GIMBAL_LOCK:
        return (_half_open(atan2(-r01, r11)), atan2(-r20, cos_beta), 0.0)
    sa, ca = r10 / cos_beta, r00 / cos_beta
    gamma = atan2(sa * r02 - ca * r12, ca * r11 - sa * r01)
    return (_half_open(atan2(r10, r00)), atan2(-r20, cos_beta), _half_open(gamma))


def rotation_from_quaternion(quaternion: Quaternion) -> Rotation:
    """Rotation of a quaternion x, y, z, w, which need not have unit length (but not zero either)."""
    x, y, z, w = quaternion
    scale = 2.0 / (x * x + y * y + z * z + w * w)
    sx, sy, sz = scale * x, scale * y, scale * z
    xx, yy, zz, xy, xz, yz = sx * x, sy * y, sz * z, sx * y, sx * z, sy * z
    wx, wy, wz = sx * w, sy * w, sz * w
    return (
        1.0 - yy - zz, xy - wz, xz + wy,
        xy + wz, 1.0 - xx - zz, yz - wx,
        xz - wy, yz + wx, 1.0 - xx - yy,
    )  # fmt: skip


def quaternion_from_rotation(rotation: Rotation) -> Quaternion:
    """Return the unit quaternion x, y, z, w of a rotation, with w >= 0 (of the two that describe it)."""
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = rotation
    # Divide by the largest of the four, so that none loses digits.
    trace = r00 + r11 + r22
    largest = max(trace, r00, r11, r22)
    if largest == trace:
        x, y, z, w = r21 - r12, r02 - r20, r10 - r01, 1.0 + trace
    elif largest == r00:
        x, y, z, w = 1.0 + r00 - r11 - r22, r01 + r10, r02 + r20, r21 - r12
    elif largest == r11:
        x, y, z, w = r01 + r10, 1.0 - r00 + r11 - r22, r12 + r21, r02 - r20
    else:
        x, y, z, w = r02 + r20, r12 + r21, 1.0 - r00 - r11 + r22, r10 - r01
    scale = 1.0 / sqrt(x * x + y * y + z * z + w * w)
    if w < 0.0:
        scale = -scale
    return (scale * x, scale * y, scale * z, scale * w)


def turn_between(start: Rotation, end: Rotation) -> tuple[Vector, float]:
    """Return unit axis, in the outer frame, and angle (rad, 0 to pi) of a turn; axis z if there is none."""
    x, y, z, w = quaternion_from_rotation(multiply(end, transpose(start)))
    sine = hypot(x, y, z)
    if sine == 0.0:
        return ((0.0, 0.0, 1.0), 0.0)
    return ((x / sine, y / sine, z / sine), 2.0 * atan2(sine, w))


def with_z_along(direction: Vector) -> Rotation:
    """Return a rotation that turns z to a direction, a unit vector."""
    x, y, z = direction
    second = (0.0, z, -y) if abs(x) < 0.9 else (-z, 0.0, x)
    length = hypot(*second)
    a, b, c = second[0] / length, second[1] / length, second[2] / length
    return (b * z - c * y, a, x, c * x - a * z, b, y, a * y - b * x, c, z)


def _half_open(angle: float) -> float:
    """Return the angle of atan2 with -pi, which it gives for a negative zero, as pi."""
    return pi if angle <= -pi else angle

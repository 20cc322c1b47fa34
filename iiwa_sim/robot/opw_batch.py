"""The closed form of `opw` for many poses at once. Same steps, same names."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.robot.opw_geometry import Geometry

Array = NDArray[np.float64]

_ROUNDING = 1e-9
"""Farther than this out of reach (as the square of a sine) rounding cannot be the reason."""


def joints_of_regular_poses(
    geometry: Geometry,
    rotations: Array,
    translations: Array,
    status: int | NDArray[np.int64],
    near: tuple[float, float, float],
) -> tuple[Array, NDArray[np.bool_]]:
    """Joints (N, 6), and which rows (N,) are near a singular pose and were not solved.

    `near` are the limits for that: the square of the sine of half the bend of the elbow, the square (m^2) of
    the wrist point's distance from the axis of A1, and the sine of A5. Rows out of reach are NaN.
    """
    (sx, sz), (ux, uz), _, hand, signs, unturned = geometry
    upper, fore = geometry.lengths
    near_straight, near_axis, near_aligned = near
    bits = np.asarray(status)
    turned = np.ascontiguousarray(rotations.reshape(-1, 3, 3) @ np.reshape(unturned, (3, 3)))
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = np.ascontiguousarray(turned.reshape(-1, 9).T)
    px, py, pz = translations.T
    wx = px - hand * r00
    wy = py - hand * r10
    tz = pz - hand * r20 - sz
    h2 = wx * wx + wy * wy
    x1 = np.sqrt(h2) * np.where(bits & 1, -1.0, 1.0)
    tx = x1 - sx
    half2 = ((upper + fore) ** 2 - tx * tx - tz * tz) * (0.25 / (upper * fore))
    with np.errstate(invalid="ignore", divide="ignore"):
        sd = 2.0 * np.sqrt(half2 * (1.0 - half2)) * np.where(bits & 2, signs[2], -signs[2])
        cd = 1.0 - 2.0 * half2
        c1 = wx / x1
        s1 = wy / x1
        k = fore / upper
        vx = ux + k * (ux * cd + uz * sd)
        vz = uz + k * (uz * cd - ux * sd)
        c2 = tx * vx + tz * vz
        s2 = tx * vz - tz * vx
        n = np.sqrt(c2 * c2 + s2 * s2)
        c2 /= n
        s2 /= n
        sp, cp = np.sin(geometry.stretched), np.cos(geometry.stretched)
        s3 = sd * cp + cd * sp
        c3 = cd * cp - sd * sp
        s23 = s2 * c3 + c2 * s3
        c23 = c2 * c3 - s2 * s3

        x = c1 * r00 + s1 * r10
        y = c1 * r10 - s1 * r00
        t0 = x * c23 - r20 * s23
        z = x * s23 + r20 * c23
        s5 = np.sqrt(y * y + z * z)
        aligned = s5 <= near_aligned
        s5 = s5 * np.where(bits & 4, signs[4], -signs[4])
        s4 = y / s5
        c4 = -z / s5
        x = s4 * s23
        z = s4 * c23
        x, y = c1 * x - s1 * c4, s1 * x + c1 * c4

        joints = np.empty((len(half2), 6))
        joints[:, 0] = np.arctan2(s1, c1)
        joints[:, 1] = np.arctan2(s2, c2)
        joints[:, 2] = np.arctan2(s3, c3)
        joints[:, 3] = np.arctan2(s4, c4)
        joints[:, 4] = np.arctan2(s5, t0)
        joints[:, 5] = np.arctan2(-(x * r02 + y * r12 + z * r22), x * r01 + y * r11 + z * r21)
    joints *= signs
    joints[joints == -np.pi] = np.pi
    joints[np.isnan(s5)] = np.nan  # s5 depends on all that goes before
    straight = (half2 < near_straight) & (half2 > -_ROUNDING)
    return joints, aligned | straight | (h2 < near_axis)

"""The closed form of `srs` for many poses at once. Same steps, same names."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.robot.srs_geometry import Lengths

Array = NDArray[np.float64]

_ROUNDING = 1e-9
"""Farther than this out of reach (as sin^2 or m^2) rounding cannot be the reason."""


def joints_of_regular_poses(
    lengths: Lengths,
    rotations: Array,
    translations: Array,
    redundancies: Array,
    status: int | NDArray[np.int64],
    near: tuple[float, float, float],
) -> tuple[Array, NDArray[np.bool_]]:
    """Joints (N, 7), and which rows (N,) are near a singular pose and were not solved.

    `near` are the limits for that: sin^2(A4/2), the square (m^2) of the wrist point's x in the frame of A1,
    and the sine of A6. Rows out of reach are NaN.
    """
    d1, d3, d5, d7 = lengths
    near_straight, near_fold, near_aligned = near
    bits = np.asarray(status)
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = np.ascontiguousarray(rotations.reshape(-1, 9).T)
    px, py, pz = translations.T
    wx = px - d7 * r02
    wy = py - d7 * r12
    wz = pz - d7 * r22 - d1
    h2 = wx * wx + wy * wy
    half2 = ((d3 + d5) ** 2 - h2 - wz * wz) * (0.25 / (d3 * d5))
    with np.errstate(invalid="ignore", divide="ignore"):
        s4 = 2.0 * np.sqrt(half2 * (1.0 - half2)) * np.where(bits & 2, -1.0, 1.0)
        c4 = 1.0 - 2.0 * half2
        s3 = np.sin(redundancies)
        c3 = np.cos(redundancies)
        vx = -d5 * s4
        vy = vx * s3
        vx = vx * c3
        vz = d3 + d5 * c4
        x2 = h2 - vy * vy
        x1 = np.sqrt(x2) * np.where(bits & 1, -1.0, 1.0)

        c2 = x1 * vx + wz * vz
        s2 = x1 * vz - wz * vx
        q2 = np.arctan2(s2, c2)
        n = np.sqrt(c2 * c2 + s2 * s2)
        c2 /= n
        s2 /= n
        c1 = wx * x1 + wy * vy
        s1 = wy * x1 - wx * vy
        q1 = np.arctan2(s1, c1)
        n = np.sqrt(c1 * c1 + s1 * s1)
        c1 /= n
        s1 /= n

        y = c1 * r12 - s1 * r02
        z = c1 * r02 + s1 * r12
        x = c2 * z - s2 * r22
        z = c2 * r22 + s2 * z
        t1 = c3 * y - s3 * x
        x = c3 * x + s3 * y
        t0 = c4 * x + s4 * z
        t2 = c4 * z - s4 * x
        s6 = np.sqrt(t0 * t0 + t1 * t1)
        aligned = s6 <= near_aligned
        s6 = np.where(bits & 4, -s6, s6)
        c5 = t0 / s6
        s5 = t1 / s6
        x = -s5 * c4
        z = -s5 * s4
        y = s3 * x + c3 * c5
        x = c3 * x - s3 * c5
        z, x = c2 * z - s2 * x, c2 * x + s2 * z
        x, y = c1 * x - s1 * y, s1 * x + c1 * y

        joints = np.empty((len(redundancies), 7))
        joints[:, 0] = q1
        joints[:, 1] = q2
        joints[:, 2] = redundancies
        joints[:, 3] = np.arctan2(s4, c4)
        joints[:, 4] = np.arctan2(s5, c5)
        joints[:, 5] = np.arctan2(s6, t2)
        joints[:, 6] = np.arctan2(x * r00 + y * r10 + z * r20, x * r01 + y * r11 + z * r21)
    joints[joints == -np.pi] = np.pi
    joints[np.isnan(s6)] = np.nan  # s6 depends on all that goes before
    straight = (half2 < near_straight) & (half2 > -_ROUNDING)
    fold = (x2 < near_fold) & (x2 > -_ROUNDING)
    return joints, aligned | straight | fold

"""Poses as arrays of twelve numbers, and how fast and how far what is at them goes."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from typing import Any

import cython
from cython.cimports.libc.math import sqrt

from iiwa_sim.frames import Transform, Vector

if cython.compiled:
    from cython.cimports.iiwa_sim.robot.record_kernel import record
else:
    from iiwa_sim.robot.record_kernel import record


def velocity_between(before: Vector, after: Vector, time_s: float) -> Vector:
    """The velocity (m/s) of a way between two places (m)."""
    ax: cython.double
    ay: cython.double
    az: cython.double
    bx: cython.double
    by: cython.double
    bz: cython.double
    dt: cython.double = time_s
    ax, ay, az = before
    bx, by, bz = after
    return ((bx - ax) / dt, (by - ay) / dt, (bz - az) / dt)


@cython.cfunc
@cython.exceptval(check=False)
def farthest(before: cython.double[::1], after: cython.double[::1], extent_m: cython.double) -> cython.double:
    """No point of a body that reaches so far from its origin has gone farther (m) between two poses."""
    turned: cython.double = 0.0
    way: cython.double = 0.0
    for k in range(9):
        turned += (after[k] - before[k]) * (after[k] - before[k])
    for k in range(9, 12):
        way += (after[k] - before[k]) * (after[k] - before[k])
    return sqrt(way) + extent_m * sqrt(turned)


@cython.cfunc
@cython.exceptval(check=True)
def take(pose: Any, numbers: cython.double[::1]) -> cython.void:
    """Write down a pose."""
    n = numbers
    rotation, place = pose
    n[0], n[1], n[2], n[3], n[4], n[5], n[6], n[7], n[8] = rotation
    n[9], n[10], n[11] = place


@cython.cfunc
@cython.exceptval(check=False)
def put_together(a: cython.double[::1], b: cython.double[::1], both: cython.double[::1]) -> cython.void:
    """Where a body is that is at pose b in a body that is at pose a, as `compose`."""
    for i in range(3):
        for j in range(3):
            both[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j]
        both[9 + i] = a[3 * i] * b[9] + a[3 * i + 1] * b[10] + a[3 * i + 2] * b[11] + a[9 + i]


@cython.cfunc
def as_transform(pose: cython.double[::1]) -> object:
    """The pose of that array."""
    p = pose
    rotation = (p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8])
    return record(Transform, (rotation, (p[9], p[10], p[11])))

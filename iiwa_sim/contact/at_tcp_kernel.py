"""Contact as the TCP has it: how fast and how far it comes, and what it feels along its own axes."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from typing import Any

import cython
from cython.cimports.libc.math import sqrt

from iiwa_sim.frames import Rotation, Vector
from iiwa_sim.wrench import NO_WRENCH, Wrench


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


def farthest_way(before: Any, after: Any, extent_m: float) -> float:
    """No point of a body that reaches so far from its origin has gone farther (m) between two poses."""
    reach: cython.double = extent_m
    turned: cython.double = 0.0
    way: cython.double = 0.0
    a: cython.double
    b: cython.double
    was, place = before
    rotation, to = after
    for k in range(9):
        a, b = was[k], rotation[k]
        turned += (b - a) * (b - a)
    for k in range(3):
        a, b = place[k], to[k]
        way += (b - a) * (b - a)
    farthest: float = sqrt(way) + reach * sqrt(turned)
    return farthest


def seen_from(rotation: Rotation, touch: Any) -> Wrench:
    """What acts, force and torque in the axes of the base, along those of a TCP turned like that."""
    r0: cython.double
    r1: cython.double
    r2: cython.double
    r3: cython.double
    r4: cython.double
    r5: cython.double
    r6: cython.double
    r7: cython.double
    r8: cython.double
    fx: cython.double
    fy: cython.double
    fz: cython.double
    tx: cython.double
    ty: cython.double
    tz: cython.double
    force, torque = touch
    fx, fy, fz = force
    tx, ty, tz = torque
    if fx == 0.0 and fy == 0.0 and fz == 0.0 and tx == 0.0 and ty == 0.0 and tz == 0.0:
        return NO_WRENCH
    r0, r1, r2, r3, r4, r5, r6, r7, r8 = rotation
    return (
        r0 * fx + r3 * fy + r6 * fz,
        r1 * fx + r4 * fy + r7 * fz,
        r2 * fx + r5 * fy + r8 * fz,
        r0 * tx + r3 * ty + r6 * tz,
        r1 * tx + r4 * ty + r7 * tz,
        r2 * tx + r5 * ty + r8 * tz,
    )

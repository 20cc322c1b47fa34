"""Contact as the TCP has it: how fast and how far it comes."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from typing import Any

import cython
from cython.cimports.libc.math import sqrt

from iiwa_sim.frames import Vector


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

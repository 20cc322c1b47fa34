"""How far parts are at least from each other, by the boxes round them: cheap enough for many in a tick."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from typing import Any

import cython
from cython.cimports.libc.math import fabs, sqrt

from iiwa_sim.contact.shapes import Box, Cylinder
from iiwa_sim.frames import Transform
from iiwa_sim.handling.part import Part


def between(one: Part, place: Transform, other: Part, there: Transform) -> float:
    """Two parts are no nearer to each other (m), by the boxes round them along the axes of the base."""
    most: cython.double = -1e9
    a: cython.double
    b: cython.double
    rotation, middle = place
    turned, away = there
    shape, beside = one[1], other[1]
    for axis in range(3):
        a, b = middle[axis], away[axis]
        most = max(most, fabs(a - b) - _reach(shape, rotation, axis) - _reach(beside, turned, axis))
    return float(most)


@cython.cfunc
@cython.exceptval(check=True)
def _reach(shape: Any, rotation: Any, axis: cython.Py_ssize_t) -> cython.double:
    """As `Part.reach`."""
    a: cython.double
    b: cython.double
    c: cython.double
    x: cython.double
    y: cython.double
    z: cython.double
    if type(shape) is Box:
        a, b, c = rotation[3 * axis], rotation[3 * axis + 1], rotation[3 * axis + 2]
        x, y, z = shape
        return fabs(a) * x + fabs(b) * y + fabs(c) * z
    x = shape[0]
    if type(shape) is Cylinder:
        c, z = rotation[3 * axis + 2], shape[1]
        return fabs(c) * z + sqrt(max(0.0, 1.0 - c * c)) * x
    return x

"""How far a place is from a shape, and which way is out of it, also for one that has come in by a way that is
remembered.

Lengths are metres, in the shape's own frame, as in `shapes`, whose numbers these are: a box has half its
edges, a ball its radius, a cylinder its radius and half its length.

**Ways in.** What is remembered of a place that touches a shape is one unit vector: which way was out when it
was looked at last. Of a box it is a face as soon as the place is inside, and the place is as deep as it is
behind that face, also past the far side, until it is beside the face's outline. Out of what is round the way
is to the nearest point down to half-way to its middle, and stays as it is there from then on. So a force does
not turn round within a thin plate or a rod, nor behind it. Along the way that is remembered nothing is less
deep than it is to the nearest point, so what is forgotten makes the depth less, or leaves it as it is: nobody
is given work by it.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from typing import Any

import cython
from cython.cimports.libc.math import fabs, sqrt

from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Vector

KINDS = {Plane: 0, Box: 1, Sphere: 2, Cylinder: 3}
"""The shapes by their numbers."""
_PLANE = cython.declare(cython.int, 0)
_BOX = cython.declare(cython.int, 1)
_SPHERE = cython.declare(cython.int, 2)
_CYLINDER = cython.declare(cython.int, 3)
# The way out is on the same side as before where the cosine between them is more: each direction is so near
# to a face of a box.
_SAME_SIDE = cython.declare(cython.double, 0.5)
NOT_IN: Vector = (0.0, 0.0, 0.0)
"""Remembered of what touches nothing."""

Out = tuple[float, float, float, float]


@cython.cfunc
@cython.exceptval(check=False)
def nearest(
    kind: cython.int,
    a: cython.double,
    b: cython.double,
    c: cython.double,
    x: cython.double,
    y: cython.double,
    z: cython.double,
) -> tuple[cython.double, cython.double, cython.double, cython.double]:
    """Signed distance of a place from the nearest point of a shape, and the way out; `a` to `c` are its
    sizes."""
    nx: cython.double = 0.0
    ny: cython.double = 0.0
    nz: cython.double = 0.0
    if kind == _PLANE:
        distance, nz = z, 1.0
    elif kind == _SPHERE:
        off = sqrt(x * x + y * y + z * z)
        distance = off - a
        if off == 0.0:
            nz = 1.0
        else:
            nx, ny, nz = x / off, y / off, z / off
    elif kind == _BOX:
        i, j, k = fabs(x) - a, fabs(y) - b, fabs(z) - c
        if i <= 0.0 and j <= 0.0 and k <= 0.0:
            distance = max(i, j, k)
            if distance == i:
                nx = 1.0 if x >= 0.0 else -1.0
            elif distance == j:
                ny = 1.0 if y >= 0.0 else -1.0
            else:
                nz = 1.0 if z >= 0.0 else -1.0
        else:
            i, j, k = max(i, 0.0), max(j, 0.0), max(k, 0.0)
            distance = sqrt(i * i + j * j + k * k)
            nx, ny, nz = i / distance, j / distance, k / distance
            nx, ny, nz = -nx if x < 0.0 else nx, -ny if y < 0.0 else ny, -nz if z < 0.0 else nz
    else:
        off = sqrt(x * x + y * y)
        i, j = off - a, fabs(z) - b
        nx, ny = (x / off, y / off) if off > 0.0 else (1.0, 0.0)
        nz = -1.0 if z < 0.0 else 1.0
        if j <= 0.0 and j <= i:
            distance, nz = i, 0.0
        elif i <= 0.0:
            distance, nx, ny = j, 0.0, 0.0
        else:
            distance = sqrt(i * i + j * j)
            nx, ny, nz = nx * i / distance, ny * i / distance, nz * j / distance
    return distance, nx, ny, nz


@cython.cfunc
@cython.exceptval(check=False)
def come_in(
    kind: cython.int,
    a: cython.double,
    b: cython.double,
    c: cython.double,
    radius: cython.double,
    x: cython.double,
    y: cython.double,
    z: cython.double,
    mx: cython.double,
    my: cython.double,
    mz: cython.double,
) -> tuple[cython.double, cython.double, cython.double, cython.double]:
    """Signed distance and way out of `nearest`, for the middle of a ball of a `radius` of which `m` is
    remembered: what is returned as the way out is to be remembered next."""
    distance, nx, ny, nz = nearest(kind, a, b, c, x, y, z)
    if kind == _PLANE or (mx == 0.0 and my == 0.0 and mz == 0.0):
        return distance, nx, ny, nz
    same: cython.bint = nx * mx + ny * my + nz * mz > _SAME_SIDE
    if kind == _BOX:
        if same and distance > 0.0:
            return distance, nx, ny, nz
        distance, nx, ny, nz = _through_a_face(a, b, c, x, y, z, mx, my, mz, distance, nx, ny, nz)
        return distance, nx, ny, nz
    if kind == _SPHERE:
        if same and distance > 0.5 * radius - 0.5 * a:
            return distance, nx, ny, nz
        along = x * mx + y * my + z * mz
        i, j, k = x - along * mx, y - along * my, z - along * mz
        if i * i + j * j + k * k <= a * a:
            return along - a, mx, my, mz
        return distance, nx, ny, nz
    if same and distance > 0.0 and distance > 0.5 * radius - 0.5 * a:
        return distance, nx, ny, nz
    distance, nx, ny, nz = _into_a_cylinder(a, b, radius, x, y, z, mx, my, mz, distance, nx, ny, nz)
    return distance, nx, ny, nz


@cython.cfunc
@cython.exceptval(check=False)
def _through_a_face(
    a: cython.double,
    b: cython.double,
    c: cython.double,
    x: cython.double,
    y: cython.double,
    z: cython.double,
    mx: cython.double,
    my: cython.double,
    mz: cython.double,
    distance: cython.double,
    nx: cython.double,
    ny: cython.double,
    nz: cython.double,
) -> tuple[cython.double, cython.double, cython.double, cython.double]:
    """Way out of a box: the nearest face to which what is remembered points and which the place is behind."""
    side: cython.double
    off: cython.double
    least: cython.double = -1e300
    i, j, k = fabs(x) - a, fabs(y) - b, fabs(z) - c
    if fabs(mx) > _SAME_SIDE and j <= 0.0 and k <= 0.0:
        side = 1.0 if mx > 0.0 else -1.0
        off = side * x - a
        if off <= 0.0:
            least, nx, ny, nz = off, side, 0.0, 0.0
    if fabs(my) > _SAME_SIDE and i <= 0.0 and k <= 0.0:
        side = 1.0 if my > 0.0 else -1.0
        off = side * y - b
        if least < off <= 0.0:
            least, nx, ny, nz = off, 0.0, side, 0.0
    if fabs(mz) > _SAME_SIDE and i <= 0.0 and j <= 0.0:
        side = 1.0 if mz > 0.0 else -1.0
        off = side * z - c
        if least < off <= 0.0:
            least, nx, ny, nz = off, 0.0, 0.0, side
    return (distance if least == -1e300 else least), nx, ny, nz


@cython.cfunc
@cython.exceptval(check=False)
def _into_a_cylinder(
    a: cython.double,
    b: cython.double,
    radius: cython.double,
    x: cython.double,
    y: cython.double,
    z: cython.double,
    mx: cython.double,
    my: cython.double,
    mz: cython.double,
    distance: cython.double,
    nx: cython.double,
    ny: cython.double,
    nz: cython.double,
) -> tuple[cython.double, cython.double, cython.double, cython.double]:
    """Way out of a cylinder: through the end or the mantle to which what is remembered points and which the
    place is behind, whichever is nearer."""
    least: cython.double = -1e300
    off = sqrt(x * x + y * y)
    if fabs(mz) > _SAME_SIDE and off <= a:
        side: cython.double = 1.0 if mz > 0.0 else -1.0
        behind = side * z - b
        if behind <= 0.0:
            least, nx, ny, nz = behind, 0.0, 0.0, side
    level = sqrt(mx * mx + my * my)
    if level > _SAME_SIDE and fabs(z) <= b:
        mx, my = mx / level, my / level
        along = x * mx + y * my
        if off - a > 0.5 * radius - 0.5 * a and along > _SAME_SIDE * off:
            if off - a > least:
                least, nx, ny, nz = off - a, x / off, y / off, 0.0
        elif along - a > least and fabs(y * mx - x * my) <= a:
            least, nx, ny, nz = along - a, mx, my, 0.0
    return (distance if least == -1e300 else least), nx, ny, nz


@cython.ccall
def way_out(surface: Surface, radius: cython.double, place: Vector, came: Vector) -> tuple[Out, Vector]:
    """Signed distance (m) of the middle of a ball at a place in the base, and the way out in the base; and
    what is to be remembered next, where `came` is remembered now: both in the frame of the shape."""
    r0: cython.double
    r1: cython.double
    r2: cython.double
    r3: cython.double
    r4: cython.double
    r5: cython.double
    r6: cython.double
    r7: cython.double
    r8: cython.double
    px: cython.double
    py: cython.double
    pz: cython.double
    ox: cython.double
    oy: cython.double
    oz: cython.double
    mx: cython.double
    my: cython.double
    mz: cython.double
    (r0, r1, r2, r3, r4, r5, r6, r7, r8), (ox, oy, oz) = surface.pose
    px, py, pz = place
    mx, my, mz = came
    px, py, pz = px - ox, py - oy, pz - oz
    sizes: Any = surface.shape
    count: cython.Py_ssize_t = len(sizes)
    kind: cython.int = KINDS[type(surface.shape)]
    a: cython.double = sizes[0] if count > 0 else 0.0
    b: cython.double = sizes[1] if count > 1 else 0.0
    c: cython.double = sizes[2] if count > 2 else 0.0
    distance, nx, ny, nz = come_in(
        kind,
        a,
        b,
        c,
        radius,
        r0 * px + r3 * py + r6 * pz,
        r1 * px + r4 * py + r7 * pz,
        r2 * px + r5 * py + r8 * pz,
        mx,
        my,
        mz,
    )
    x = r0 * nx + r1 * ny + r2 * nz
    y = r3 * nx + r4 * ny + r5 * nz
    z = r6 * nx + r7 * ny + r8 * nz
    return (distance, x, y, z), (nx, ny, nz)

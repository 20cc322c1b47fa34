"""A level part over the level face of something narrower, or turned otherwise: where the one presses on the
other though none of its corners, or of the points of its rim, is over that.

Each of its lower points that is beside the face presses where face and underside, seen from above, come
nearest to it: with the stiffness that it has over the face. So a part is as stiff on a post, on a rail, or
turned on one of its size, as on a table. It has to come from above: what comes in from beside presses nothing
here. There is no friction at these places.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from typing import Any

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt

_LEVEL = cython.declare(cython.double, 1.0 - 5e-9)  # the cosine of 1e-4 rad
_SINE = cython.declare(cython.double, 1e-4)
# So far (m) within the face: what lies there may move by that in a tick.
_INSET = cython.declare(cython.double, 5e-4)
_TOUCHES = cython.declare(cython.double, 1e-9)
_ROUNDS = cython.declare(cython.int, 32)  # until a place is both in the face and below the part
_BOX = cython.declare(cython.int, 1)
_CYLINDER = cython.declare(cython.int, 3)
# Heights (m) between which it is looked for such places.
_ABOVE = cython.declare(cython.double, 0.01)


@cython.cclass
class Over:
    """One part over faces that its points are beside; the attributes are declared in the .pxd.

    Shapes are rows: rotation, place (m), three sizes (m). A footprint is such a shape from above: half its
    length and width, or its radius and 0; its middle, and the direction of its length; its height.
    """

    def __init__(self, own: Any, kind: int, sizes: Any) -> None:
        """The part has its `own` points (m), and is of a kind, a number of `ways_in_kernel.KINDS`."""
        self._own = own
        self._row = np.array([*(0.0,) * 12, *sizes, 0.0, 0.0, 0.0][:15])
        self._kind = kind
        self._is_level = self._is_near = self._is_apart = False
        self._under, self._face = np.zeros((2, 7))
        self.x = self.y = 0.0

    @cython.cfunc
    @cython.exceptval(-1, check=True)
    def put(self, pose: cython.double[::1]) -> cython.bint:
        """The part is at a pose: whether it has a level underside."""
        for k in range(12):
            self._row[k] = pose[k]
        self._is_level = footprint(self._row, self._kind, self._under, -1.0)
        return self._is_level

    @cython.cfunc
    @cython.exceptval(-1.0, check=True)
    def gap(self, row: cython.double[::1], kind: cython.int) -> cython.double:
        """How far (m) the part, where it has been put, is at least above a face, or beside it; less than 0
        where it may press on that. Very far where there is no such face."""
        u, f = self._under, self._face
        if not self._is_level or not footprint(row, kind, f, 1.0):
            return 1e9
        x, y = u[2] - f[2], u[3] - f[3]
        reach: cython.double = sqrt(u[0] * u[0] + u[1] * u[1]) + sqrt(f[0] * f[0] + f[1] * f[1])
        beside: cython.double = sqrt(x * x + y * y) - reach
        deep: cython.double = f[6] - row[11]  # half the height of what has the face
        return max(beside, u[6] - f[6], (f[6] - 2.0 * deep) - u[6])

    @cython.cfunc
    @cython.exceptval(check=True)
    def face(self, row: cython.double[::1], kind: cython.int) -> cython.void:
        """From now on it is asked for places over the face of such a shape."""
        self._is_near = self.gap(row, kind) < _ABOVE
        self._is_apart = not self._is_near or beside(self._under, self._face) > _TOUCHES

    @cython.cfunc
    @cython.exceptval(check=False)
    def is_apart(self) -> cython.bint:
        """Whether no point of the part can be over that face, nor press on it."""
        return self._is_apart

    @cython.cfunc
    @cython.exceptval(check=False)
    def is_over(self, n: cython.Py_ssize_t) -> cython.bint:
        """Whether a point of the part, by its number, is beside the face and presses on it: it does so at x
        and y (m, in the base)."""
        p, own = self._row, self._own
        if self._is_apart or not self.is_low(n):
            return False
        x: cython.double = (p[0] * own[n, 0] + p[1] * own[n, 1] + p[2] * own[n, 2]) + p[9]
        y: cython.double = (p[3] * own[n, 0] + p[4] * own[n, 1] + p[5] * own[n, 2]) + p[10]
        is_over, self.x, self.y = over(self._under, self._face, x, y)
        return is_over

    @cython.cfunc
    @cython.exceptval(check=False)
    def is_low(self, n: cython.Py_ssize_t) -> cython.bint:
        """Whether a point is one of the lower ones."""
        return self.height(n) < self._row[11]

    @cython.cfunc
    @cython.exceptval(check=False)
    def is_above(self, n: cython.Py_ssize_t) -> cython.bint:
        """Whether a point is no lower than the face."""
        return self._is_near and self.height(n) >= self._face[6]

    @cython.cfunc
    @cython.exceptval(check=False)
    def height(self, n: cython.Py_ssize_t) -> cython.double:
        """How high a point is (m, in the base)."""
        p, own = self._row, self._own
        return (p[6] * own[n, 0] + p[7] * own[n, 1] + p[8] * own[n, 2]) + p[11]

    @cython.cfunc
    @cython.exceptval(-1.0, check=True)
    def least_gap(
        self, pose: cython.double[::1], shapes: cython.double[:, ::1], kinds: cython.int[::1]
    ) -> cython.double:
        """How far (m) the part, at a pose, is at least from pressing on any of these."""
        least: cython.double = 1e9
        s: cython.Py_ssize_t
        if self.put(pose):
            for s in range(kinds.shape[0]):
                least = min(least, self.gap(shapes[s], kinds[s]))
        return least


@cython.cfunc
@cython.exceptval(check=False)
def footprint(
    row: cython.double[::1], kind: cython.int, found: cython.double[::1], side: cython.double
) -> cython.bint:
    """Find the footprint of a shape, with the height of its upper face (side 1) or its lower one (-1):
    whether that is level. Of a cylinder on its side it is a line."""
    axis: cython.int = 2
    if kind == _BOX:
        axis = 0
        for k in range(1, 3):
            if fabs(row[6 + k]) > fabs(row[6 + axis]):
                axis = k
    elif kind != _CYLINDER:
        return False
    found[2], found[3], found[4], found[5] = row[9], row[10], 1.0, 0.0
    if fabs(row[6 + axis]) >= _LEVEL:
        if kind == _CYLINDER:
            found[0], found[1] = row[12], -1.0
            found[6] = row[11] + side * row[13]
            return True
        i: cython.int = (axis + 1) % 3
        found[0], found[1] = row[12 + i], row[12 + (axis + 2) % 3]
        found[6] = row[11] + side * row[12 + axis]
    elif kind == _CYLINDER and fabs(row[8]) <= _SINE:
        i = 2
        found[0], found[1] = row[13], 0.0
        found[6] = row[11] + side * row[12]
    else:
        return False
    length: cython.double = sqrt(row[i] * row[i] + row[3 + i] * row[3 + i])
    found[4], found[5] = row[i] / length, row[3 + i] / length
    return True


@cython.cfunc
@cython.exceptval(check=False)
def beside(under: cython.double[::1], face: cython.double[::1]) -> cython.double:
    """How far (m) one footprint is at least beside the other: by how much the directions of their edges, and
    that between their middles, part them."""
    x, y = face[2] - under[2], face[3] - under[3]
    far: cython.double = sqrt(x * x + y * y)
    most: cython.double = -1e9
    for one in range(5):
        cx, cy = under[4], under[5]
        if one >= 2:
            cx, cy = face[4], face[5]
        if one % 2:
            cx, cy = -cy, cx
        if one == 4:
            if far == 0.0:
                continue
            cx, cy = x / far, y / far
        apart: cython.double = fabs(x * cx + y * cy) - along(under, cx, cy) - along(face, cx, cy)
        most = max(most, apart)
    return most


@cython.cfunc
@cython.exceptval(check=False)
def along(face: cython.double[::1], cx: cython.double, cy: cython.double) -> cython.double:
    """How far (m) a footprint reaches from its middle in a direction."""
    if face[1] < 0.0:  # a disc
        return face[0]
    across: cython.double = fabs(cy * face[4] - cx * face[5])
    return face[0] * fabs(cx * face[4] + cy * face[5]) + face[1] * across


@cython.cfunc
@cython.exceptval(check=False)
def over(
    under: cython.double[::1], face: cython.double[::1], x: cython.double, y: cython.double
) -> tuple[cython.bint, cython.double, cython.double]:
    """Where a point of a footprint, which is beside another one, comes nearest to it within both; whether
    there is such a place."""
    u, v = into(face, 0.0, x, y)
    if (u - x) * (u - x) + (v - y) * (v - y) <= _TOUCHES * _TOUCHES:
        return False, x, y
    for _ in range(_ROUNDS):
        x, y = into(face, _INSET, x, y)
        u, v = into(under, 0.0, x, y)
        if (u - x) * (u - x) + (v - y) * (v - y) <= _TOUCHES * _TOUCHES:
            return True, x, y
        x, y = u, v
    return False, x, y


@cython.cfunc
@cython.exceptval(check=False)
def into(
    face: cython.double[::1], inset: cython.double, x: cython.double, y: cython.double
) -> tuple[cython.double, cython.double]:
    """The place of a footprint, so far within its outline, that is nearest to one (m)."""
    x, y = x - face[2], y - face[3]
    if face[1] < 0.0:  # a disc
        far: cython.double = sqrt(x * x + y * y)
        most: cython.double = max(0.0, face[0] - inset)
        if far > most:
            x, y = x * most / far, y * most / far
        return x + face[2], y + face[3]
    a: cython.double = max(0.0, face[0] - inset)
    b: cython.double = max(0.0, face[1] - inset)
    along: cython.double = max(-a, min(a, x * face[4] + y * face[5]))
    across: cython.double = max(-b, min(b, y * face[4] - x * face[5]))
    return along * face[4] - across * face[5] + face[2], along * face[5] + across * face[4] + face[3]

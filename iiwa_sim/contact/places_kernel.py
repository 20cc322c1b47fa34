"""Where parts that lie meet what is beside them: places of one body that are in another, and how deep.

A body is seen as its outline: of a box its corners, and places near them, for one whose sides are flush with
another's; what stands and is round as a disc, a ball as a ball, a cylinder on its side by eight places, as
high as it meets the other first. What stands is met from beside only, at the heights where both are. What is
below a part, or less than `STEP_M` above the face on which it lies, it does not meet.

By which way a place has come into a body is remembered (`ways_in_kernel`), and how far friction's spring is
wound there, in a table, from when it comes near until it has gone away.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

import cython
from cython.cimports.libc.math import sqrt

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.depths_kernel import Depths
else:
    from iiwa_sim.contact.depths_kernel import Depths

STEP_M = 1e-3
"""A part goes over what is no higher than this."""
_STEP = cython.declare(cython.double, STEP_M)
_BELOW = cython.declare(cython.double, 0.9)  # of a direction: what pushes like that is below
_BOX = cython.declare(cython.int, 1)
_SPHERE = cython.declare(cython.int, 2)
_CYLINDER = cython.declare(cython.int, 3)
# Of a box seen from above: its corners, and near them.
_INNER = cython.declare(cython.double, 0.9)
_AT_ONCE = cython.declare(cython.double, 0.25)  # part of the stiffness at each place: several meet at once
_AT_CORNER = cython.declare(cython.double, 0.75)  # for three heights
_MOST_PLACES = cython.declare(cython.longlong, 64)  # of a pair
_PLACES = cython.declare(cython.longlong, 36)  # of a body in another: corners of a box, at three heights
_MOST_BODIES = cython.declare(cython.longlong, 1048576)


@cython.cclass
class Places(Depths):
    """Places at which bodies meet; the arrays are declared in the .pxd."""

    @cython.cfunc
    @cython.exceptval(check=True)
    def _meet(
        self,
        x: cython.Py_ssize_t,
        y: cython.Py_ssize_t,
        low: cython.double,
        high: cython.double,
        share: cython.double,
        rubs: cython.bint,
        reach: cython.double,
    ) -> cython.bint:
        """Note places of a body that are in another, or no farther (m) from it than `reach`, at the heights
        where both are; whether there are any."""
        p, size = self._pose, self._size
        kind: cython.int = self._kind[x]
        tall: cython.bint = self._upright[y] >= 0
        before: cython.Py_ssize_t = self._met
        k: cython.double = share / (1.0 / self._material[x, 0] + 1.0 / self._material[y, 0])
        z: cython.double = p[x, 11]
        i: cython.Py_ssize_t
        j: cython.Py_ssize_t
        u: cython.double
        v: cython.double
        lx: cython.double
        ly: cython.double
        weight: cython.double
        number: cython.longlong = 0
        if kind == _SPHERE or (kind == _CYLINDER and self._upright[x] < 0):
            if kind == _SPHERE:  # at the height of its middle, where that is beside
                tall = tall and self._span[y, 0] < z < self._span[y, 1]
                self._place(x, y, 0, 0.0, 0.0, 0.0, size[x, 0], 0, tall, k, rubs, reach)
            elif low <= high or y == self._held:
                if y == self._held:  # it may press from above
                    if tall and not self._span[y, 0] < z < self._span[y, 1]:
                        self._forget_pair(x, y)
                        return False
                    low = high = z
                z = self._widest(x, y, low, high)
                weight = sqrt(max(0.0, size[x, 0] * size[x, 0] - z * z))
                for a in range(-1, 2):
                    for b in range(-1, 2):
                        if a != 0 or b != 0:
                            u, v = a * size[x, 1], b * weight
                            lx, ly = u * p[x, 2] - v * p[x, 5], u * p[x, 5] + v * p[x, 2]
                            self._place(x, y, number, lx, ly, z, 0.0, 0, tall, _AT_ONCE * k, rubs, reach)
                        number += 1
            return self._met > before
        if low > high and not (low <= high + _STEP and self._is_met(x, y)):
            if y == self._held:
                self._forget_pair(x, y)
            return False
        heights: cython.int = 1 if tall else 3
        for level in range(heights):
            z = 0.5 * (low + high) if tall else low + 0.5 * level * (high - low)
            z -= p[x, 11]
            weight = 1.0 / heights
            if kind == _CYLINDER:
                self._place(x, y, number, 0.0, 0.0, z, size[x, 0], 1, tall, weight * k, rubs, reach)
                number += 1
            elif kind == _BOX and self._upright[x] >= 0:
                i = (self._upright[x] + 1) % 3
                j = (self._upright[x] + 2) % 3
                for corner in range(12):
                    u = size[x, i] * (1.0 if corner & 1 else -1.0)
                    v = size[x, j] * (1.0 if corner & 2 else -1.0)
                    if corner >= 8:
                        u *= _INNER
                    elif corner >= 4:
                        v *= _INNER
                    lx = p[x, i] * u + p[x, j] * v
                    ly = p[x, 3 + i] * u + p[x, 3 + j] * v
                    u = weight * k * (_AT_CORNER if corner < 4 else _AT_ONCE)
                    self._place(x, y, number, lx, ly, z, 0.0, 0, tall, u, rubs, reach)
                    number += 1
        if kind == _BOX and self._upright[x] < 0:
            for corner in range(8):
                u = size[x, 0] * (1.0 if corner & 1 else -1.0)
                v = size[x, 1] * (1.0 if corner & 2 else -1.0)
                z = size[x, 2] * (1.0 if corner & 4 else -1.0)
                lx = p[x, 0] * u + p[x, 1] * v + p[x, 2] * z
                ly = p[x, 3] * u + p[x, 4] * v + p[x, 5] * z
                z = p[x, 6] * u + p[x, 7] * v + p[x, 8] * z
                self._place(x, y, corner, lx, ly, z, 0.0, 0, False, _AT_ONCE * k, rubs, reach)
        return self._met > before

    @cython.cfunc
    @cython.exceptval(check=False)
    def _is_met(self, x: cython.Py_ssize_t, y: cython.Py_ssize_t) -> cython.bint:
        """Whether a body has places in the held one: these press as long as that is beside it, by however
        little, and do not come and go as it is pressed down."""
        if y != self._held:
            return False
        first: cython.longlong = (self._id[x] * _MOST_BODIES + self._id[y]) * _MOST_PLACES
        met: cython.bint = False
        for number in range(_PLACES):
            met = met or self._has_come_in(first + number)
        return met

    @cython.cfunc
    @cython.exceptval(check=False)
    def _forget_pair(self, x: cython.Py_ssize_t, y: cython.Py_ssize_t) -> cython.void:
        """A body is above or below another: how deep its places pressed in there must not press again."""
        first: cython.longlong = (self._id[x] * _MOST_BODIES + self._id[y]) * _MOST_PLACES
        for number in range(_PLACES):
            self._forget_place(first + number)

    @cython.cfunc
    def _place(
        self,
        x: cython.Py_ssize_t,
        y: cython.Py_ssize_t,
        number: cython.longlong,
        lx: cython.double,
        ly: cython.double,
        lz: cython.double,
        radius: cython.double,
        rim: cython.int,
        tall: cython.bint,
        stiffness: cython.double,
        rubs: cython.bint,
        reach: cython.double,
    ) -> object:
        """Note a place of a body, from its middle: a ball or a disc of a radius that may be in another."""
        key: cython.longlong = (self._id[x] * _MOST_BODIES + self._id[y]) * _MOST_PLACES + number
        if self._is_far(x, y, lx, ly, lz, radius + reach, tall) and not self._has_come_in(key):
            return None
        n: cython.Py_ssize_t = self._next(x, y, key)
        c = self._c
        self._i[n, 2], self._i[n, 3] = rim, 1 if tall else 0
        c[n, 0], c[n, 1], c[n, 2], c[n, 3] = lx, ly, lz, radius
        c[n, 4], c[n, 6] = stiffness, stiffness
        c[n, 5] = min(self._material[x, 1], self._material[y, 1]) if rubs else 0.0
        self._recall(n)
        if self._held >= 0 and (x == self._held or y == self._held):
            self._bring(n, -1.0)
        if self._touch(n, False, True) > -reach:
            if self._is_beside(n):
                self._met += 1
            else:  # how deep it pressed from beside must not press again
                self._forget_place(key)
        return None

    @cython.cfunc
    @cython.exceptval(check=False)
    def _bring(self, n: cython.Py_ssize_t, side: cython.double) -> cython.void:
        """The arm has brought the part that it holds to a place, of that by 1, or in that by -1."""
        c = self._c
        up: cython.double = self._by[2] if self._i[n, 3] else 0.0  # that brings nothing into a side
        c[n, 38] = sqrt(max(0.0, self._brought * self._brought - up * up))
        if c[n, 33] < 0.0:  # it was farther away a tick ago than is remembered
            c[n, 33] = 0.0
            for k in range(3):
                c[n, 34 + k] = side * self._by[k]

    @cython.cfunc
    @cython.exceptval(check=False)
    def _is_beside(self, n: cython.Py_ssize_t) -> cython.bint:
        """Whether neither body is below the other, but for what presses from above or below: the arm, and
        what it holds."""
        x: cython.Py_ssize_t = self._i[n, 0]
        y: cython.Py_ssize_t = self._i[n, 1]
        if 0 <= x < self._parts and self._c[n, 16] > _BELOW and x != self._held:
            return False
        return not (x >= 0 and self._c[n, 16] < -_BELOW and y < self._parts and y != self._held)

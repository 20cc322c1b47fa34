"""Where parts that lie meet what is beside them: places of one body that are in another, and how deep.

A body is seen as its outline: of a box its corners, and places near them, for one whose sides are flush with
another's; what stands and is round as a disc, a ball as a ball, a cylinder on its side by eight places, as
high as it meets the other first. What stands is met from beside only, at the heights where both are. What is
below a part, or less than `STEP_M` above the face on which it lies, it does not meet.

By which way a place has come into a body is remembered (`ways_in_kernel`), and how far friction's spring is
wound there, in a table, from when it comes near until it has gone away.

**No energy from nowhere.** A place presses at the beginning of a tick no deeper than it has been seen to at
the end of the one before: where it is deeper in a body, since a part has landed there, was put there, was
carried there or began there, that much more presses nothing, less as it comes out, and never more again. So
it holds up what would go in further, and gives nothing to what goes out.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.libc.math import sqrt

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.bodies_kernel import Bodies
    from cython.cimports.iiwa_sim.contact.ways_in_kernel import come_in
else:
    from iiwa_sim.contact.bodies_kernel import Bodies
    from iiwa_sim.contact.ways_in_kernel import come_in

STEP_M = 1e-3
"""A part goes over what is no higher than this."""
_STEP = cython.declare(cython.double, STEP_M)
_TALL = cython.declare(cython.double, 10.0)  # what stands has no upper nor lower end
_BELOW = cython.declare(cython.double, 0.9)  # of a direction: what pushes like that is below
_BOX = cython.declare(cython.int, 1)
_SPHERE = cython.declare(cython.int, 2)
_CYLINDER = cython.declare(cython.int, 3)
# Of a box seen from above: its corners, and near them.
_INNER = cython.declare(cython.double, 0.9)
_AT_ONCE = cython.declare(cython.double, 0.25)  # part of the stiffness at each place: several meet at once
_AT_CORNER = cython.declare(cython.double, 0.75)  # for three heights
_MOST_PLACES = cython.declare(cython.longlong, 64)  # of a pair
_MOST_BODIES = cython.declare(cython.longlong, 1048576)


@cython.cclass
class Places(Bodies):
    """Places at which bodies meet; the arrays are declared in the .pxd."""

    def __init__(self, count: int) -> None:
        """There are `count` parts; they are the first bodies, surfaces follow."""
        Bodies.__init__(self, count)
        least = max(count, 1)
        self._slot = np.full(least, -1, dtype=np.intp)
        self._t, self._e = np.zeros((least, 4)), np.zeros((least, 4))
        self._turn = np.zeros((least, 2))
        self._of, self._moved = np.zeros((512, 2), dtype=np.intp), np.zeros((512, 4))
        self._brought = 0.0

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
        if low > high:
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
            c[n, 38] = self._brought
        if self._touch(n, False, True) > -reach and self._is_beside(n):
            self._met += 1
        return None

    @cython.cfunc
    @cython.exceptval(check=False)
    def _is_beside(self, n: cython.Py_ssize_t) -> cython.bint:
        """Whether neither body is below the other, but for what presses from above: the arm, and what it
        holds."""
        x: cython.Py_ssize_t = self._i[n, 0]
        y: cython.Py_ssize_t = self._i[n, 1]
        if 0 <= x < self._parts and self._c[n, 16] > _BELOW and x != self._held:
            return False
        return not (self._c[n, 16] < -_BELOW and y < self._parts and y != self._held)

    @cython.cfunc
    @cython.exceptval(check=False)
    def _touch(self, n: cython.Py_ssize_t, moved: cython.bint, plane: cython.bint) -> cython.double:
        """How deep (m) a place is in the other body, before the parts have `moved` or after; that is noted,
        and for the `plane` of the place which way is out and where it touches."""
        c, p, size = self._c, self._pose, self._size
        x: cython.Py_ssize_t = self._i[n, 0]
        y: cython.Py_ssize_t = self._i[n, 1]
        slot: cython.Py_ssize_t
        px, py, pz = c[n, 0], c[n, 1], c[n, 2]
        qx, qy, qz = p[y, 9], p[y, 10], p[y, 11]
        s: cython.double = 0.0
        co: cython.double = 1.0
        if x >= 0:
            slot = self._slot[x] if moved and x < self._parts else -1
            if slot >= 0:
                cx, sx = self._turn[slot, 0], self._turn[slot, 1]
                px, py = cx * px - sx * py + self._e[slot, 0], sx * px + cx * py + self._e[slot, 1]
                pz += self._e[slot, 2]
            px, py, pz = px + p[x, 9], py + p[x, 10], pz + p[x, 11]
        slot = self._slot[y] if moved and y < self._parts else -1
        if slot >= 0:
            co, s = self._turn[slot, 0], self._turn[slot, 1]
            qx, qy, qz = qx + self._e[slot, 0], qy + self._e[slot, 1], qz + self._e[slot, 2]
        ex, ey, ez = px - qx, py - qy, pz - qz
        ux, uy = co * ex + s * ey, co * ey - s * ex
        a: cython.double = size[y, 0]
        b: cython.double = size[y, 1]
        d: cython.double = size[y, 2]
        if self._i[n, 3]:
            axis: cython.int = self._upright[y]
            if self._kind[y] == _CYLINDER:
                b += _TALL
            elif axis == 0:
                a += _TALL
            elif axis == 1:
                b += _TALL
            else:
                d += _TALL
        radius: cython.double = c[n, 3]
        distance, nx, ny, nz = come_in(
            self._kind[y],
            a,
            b,
            d,
            radius,
            p[y, 0] * ux + p[y, 3] * uy + p[y, 6] * ez,
            p[y, 1] * ux + p[y, 4] * uy + p[y, 7] * ez,
            p[y, 2] * ux + p[y, 5] * uy + p[y, 8] * ez,
            c[n, 7],
            c[n, 8],
            c[n, 9],
        )
        c[n, 22], c[n, 23], c[n, 24] = nx, ny, nz
        if not moved:
            c[n, 7], c[n, 8], c[n, 9] = nx, ny, nz
        ux = p[y, 0] * nx + p[y, 1] * ny + p[y, 2] * nz
        uy = p[y, 3] * nx + p[y, 4] * ny + p[y, 5] * nz
        uz = p[y, 6] * nx + p[y, 7] * ny + p[y, 8] * nz
        ux, uy = co * ux - s * uy, s * ux + co * uy
        c[n, 25], c[n, 26], c[n, 27] = ex, ey, ez
        level: cython.double = 1.0
        if self._i[n, 2]:
            level = sqrt(ux * ux + uy * uy)
        depth: cython.double = radius * level - distance
        if not moved:
            more: cython.double = depth - c[n, 31]
            c[n, 32] = max(0.0, more - c[n, 38], min(c[n, 37], more))
        c[n, 30] = min(c[n, 32], max(0.0, depth))
        depth -= c[n, 30]
        c[n, 28] = depth
        if not moved:
            c[n, 13] = depth
        if plane:
            c[n, 14], c[n, 15], c[n, 16] = ux, uy, uz
            # Where it touches, from where both middles were before.
            far: cython.double = radius if level == 1.0 else (radius / level if level > 0.0 else 0.0)
            px, py = px - far * ux, py - far * uy
            c[n, 19], c[n, 20] = px - p[y, 9], py - p[y, 10]
            if x >= 0:
                c[n, 17], c[n, 18] = px - p[x, 9], py - p[x, 10]
        return depth

    @cython.cfunc
    @cython.exceptval(check=False)
    def _depth(self, m: cython.Py_ssize_t) -> cython.double:
        """Depth (m) of a place, taken for a plane, when parts have gone the ways that are tried."""
        c, t, moved = self._c, self._t, self._moved
        depth: cython.double = c[m, 29]
        q: cython.Py_ssize_t
        for q in range(self._i[m, 4], self._i[m, 5]):
            k: cython.Py_ssize_t = self._of[q, 0]
            out: cython.double = c[m, 14] * t[k, 0] + c[m, 15] * t[k, 1] + c[m, 16] * t[k, 2]
            depth += moved[q, 0] * (out + moved[q, 3] * t[k, 3])
        return depth

    @cython.cfunc
    @cython.exceptval(check=False)
    def _rub(self, m: cython.Py_ssize_t) -> tuple[cython.double, cython.double, cython.double]:
        """How far friction's spring at a place would be wound (m) at the ways that are tried, if it held."""
        ux: cython.double = 0.0
        uy: cython.double = 0.0
        uz: cython.double = 0.0
        q: cython.Py_ssize_t
        for q in range(self._i[m, 4], self._i[m, 5]):
            k = self._of[q, 0]
            ux -= self._moved[q, 0] * (self._t[k, 0] - self._t[k, 3] * self._moved[q, 2])
            uy -= self._moved[q, 0] * (self._t[k, 1] + self._t[k, 3] * self._moved[q, 1])
            uz -= self._moved[q, 0] * self._t[k, 2]
        nx, ny, nz = self._c[m, 14], self._c[m, 15], self._c[m, 16]
        out = ux * nx + uy * ny + uz * nz
        return self._c[m, 10] + ux - out * nx, self._c[m, 11] + uy - out * ny, self._c[m, 12] + uz - out * nz

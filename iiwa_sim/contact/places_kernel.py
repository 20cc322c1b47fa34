"""Where parts that lie meet what is beside them: places of one body that are in another, and how deep.

A body is seen as its outline: of a box its corners, and places near them, for one whose sides are flush with
another's; what stands and is round as a disc, a ball as a ball, a cylinder on its side by eight places at the
height of its axis. What stands is met from beside only, at the heights where both are. What is below a part,
or less than `STEP_M` above the face on which it lies, it does not meet.

By which way a place has come into a body is remembered (`ways_in_kernel`), and how far friction's spring is
wound there, in a table, from when it comes near until it has gone away.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Any

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt

from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.ways_in_kernel import KINDS

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.ways_in_kernel import come_in
else:
    from iiwa_sim.contact.ways_in_kernel import come_in

STEP_M = 1e-3
"""A part goes over what is no higher than this."""
_STEP = cython.declare(cython.double, STEP_M)
_TALL = cython.declare(cython.double, 10.0)  # what stands has no upper nor lower end
_BELOW = cython.declare(cython.double, 0.9)  # of a direction: what pushes like that is below
_UPRIGHT = 1.0 - 1e-6
_BOX = cython.declare(cython.int, 1)
_SPHERE = cython.declare(cython.int, 2)
_CYLINDER = cython.declare(cython.int, 3)
# Of a box seen from above: its corners, and near them.
_INNER = cython.declare(cython.double, 0.9)
_AT_ONCE = cython.declare(cython.double, 0.25)  # part of the stiffness at each place: several meet at once
_AT_CORNER = cython.declare(cython.double, 0.75)  # for three heights
# Of a place that has gone farther (m) since it was seen last it is not known by which way it has come in.
_FORGETS = cython.declare(cython.double, 5e-3)
_MOST_PLACES = cython.declare(cython.longlong, 64)  # of a pair
_MOST_BODIES = cython.declare(cython.longlong, 1048576)
# Remembered of a place: the way out, where it was from the middle of the body, how far it rubbed.
_NUMBERS = cython.declare(cython.Py_ssize_t, 9)
WIDE = 31
"""Numbers of a place in this tick: where from the middle of its body, or in the base (3), radius; stiffness,
friction, friction's stiffness; by which way it has come in (3), how far it has rubbed (3); depth, way out
(3), lever in both bodies (2 each), limit of friction; as `_touch` finds it: what is to be remembered (3),
where from the middle of the other (3), depth; and how an angle of either changes the depth (2)."""


@cython.cclass
class Places:
    """Bodies, and places at which they meet; the arrays are declared in the .pxd."""

    def __init__(self, count: int) -> None:
        """For so many parts; they are the first bodies, surfaces follow."""
        self._parts = count
        self._held = -1
        self._make_room(count)
        self._met, self._room = 0, 256
        self._c = np.zeros((self._room, WIDE))
        self._i = np.zeros((self._room, 6), dtype=np.intp)
        self._k = np.zeros(self._room, dtype=np.int64)
        self.forget()
        least = max(count, 1)
        self._slot = np.full(least, -1, dtype=np.intp)
        self._t = np.zeros((least, 4))
        self._turn = np.zeros((least, 2))

    @cython.cfunc
    def _make_room(self, count: cython.Py_ssize_t) -> object:
        self._kind = np.zeros(count, dtype=np.intc)
        self._size = np.zeros((count, 3))
        self._pose = np.zeros((count, 12))
        self._upright = np.full(count, -1, dtype=np.intc)
        self._span = np.zeros((count, 2))
        self._reach = np.zeros((count, 3))
        self._material = np.zeros((count, 2))
        self._id = np.arange(count, dtype=np.int64)
        self._bodies = count
        return None

    def stand(self, surfaces: Sequence[Surface], ids: Sequence[int]) -> None:
        """These surfaces are there from now on; each is known by a number of its own, from that of parts
        on."""
        before: Any = [np.asarray(each)[: self._parts].copy() for each in self._all_arrays()]
        self._make_room(self._parts + len(surfaces))
        for now, old in zip(self._all_arrays(), before, strict=True):
            now[: self._parts] = old
        n: cython.Py_ssize_t = self._parts
        for surface, own in zip(surfaces, ids, strict=True):
            self._put_body(n, surface)
            self._id[n] = own
            n += 1

    def _all_arrays(self) -> Any:
        both = [self._kind, self._size, self._pose, self._upright, self._span, self._reach, self._material]
        return [np.asarray(each) for each in both]

    @cython.cfunc
    def _put_body(self, n: cython.Py_ssize_t, surface: Any) -> object:
        """A body is there, and is like that."""
        row: cython.Py_ssize_t
        rotation, place = surface.pose
        shape = surface.shape
        sizes = (*shape, 0.0, 0.0, 0.0)[:3]
        self._kind[n] = KINDS[type(shape)]
        for i in range(9):
            self._pose[n, i] = rotation[i]
        for i in range(3):
            self._pose[n, 9 + i] = place[i]
            self._size[n, i] = sizes[i]
        self._material[n, 0], self._material[n, 1] = surface.stiffness, surface.friction
        self._upright[n] = -1
        if isinstance(shape, Box):
            axis = max((0, 1, 2), key=lambda each: abs(rotation[6 + each]))
            if abs(rotation[6 + axis]) > _UPRIGHT:
                self._upright[n] = axis
        elif isinstance(shape, Cylinder) and abs(rotation[8]) > _UPRIGHT:
            self._upright[n] = 2
        rows = [rotation[0:3], rotation[3:6], rotation[6:9]]
        for row in range(3):
            r: Any = rows[row]
            if isinstance(shape, Box):
                far = sum(abs(a) * half for a, half in zip(r, shape, strict=True))
            elif isinstance(shape, Sphere):
                far = shape.radius
            elif isinstance(shape, Cylinder):
                far = abs(r[2]) * shape.half_z + shape.radius * max(0.0, 1.0 - r[2] * r[2]) ** 0.5
            else:
                far = inf
            self._reach[n, row] = far
        self._span[n, 0], self._span[n, 1] = place[2] - self._reach[n, 2], place[2] + self._reach[n, 2]
        return None

    @cython.cfunc
    @cython.exceptval(check=False)
    def _apart(self, x: cython.Py_ssize_t, y: cython.Py_ssize_t) -> cython.double:
        """Two bodies are no nearer to each other (m), by the boxes round them."""
        p, r = self._pose, self._reach
        most: cython.double = -1e300
        for i in range(3):
            most = max(most, fabs(p[x, 9 + i] - p[y, 9 + i]) - r[x, i] - r[y, i])
        return most

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
            # At the height of its middle, where that is beside.
            tall = tall and self._span[y, 0] < z < self._span[y, 1]
            if kind == _SPHERE:
                self._place(x, y, 0, 0.0, 0.0, 0.0, size[x, 0], 0, tall, k, rubs, reach)
            elif tall or self._upright[y] < 0:
                for a in range(-1, 2):
                    for b in range(-1, 2):
                        if a != 0 or b != 0:
                            u, v = a * size[x, 1], b * size[x, 0]
                            lx, ly = u * p[x, 2] - v * p[x, 5], u * p[x, 5] + v * p[x, 2]
                            self._place(x, y, number, lx, ly, 0.0, 0.0, 0, tall, _AT_ONCE * k, rubs, reach)
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
        n: cython.Py_ssize_t = self._next(x, y, key)
        c = self._c
        self._i[n, 2], self._i[n, 3] = rim, 1 if tall else 0
        c[n, 0], c[n, 1], c[n, 2], c[n, 3] = lx, ly, lz, radius
        c[n, 4], c[n, 5], c[n, 6] = stiffness, 0.0, stiffness
        if rubs:
            c[n, 5] = min(self._material[x, 1], self._material[y, 1])
        self._recall(n)
        if self._touch(n, False) > -reach and self._is_beside(n):
            self._met += 1
        return None

    @cython.cfunc
    @cython.exceptval(check=True)
    def _next(self, x: cython.Py_ssize_t, y: cython.Py_ssize_t, key: cython.longlong) -> cython.Py_ssize_t:
        """Where the next place is noted, of two bodies, under a key."""
        n: cython.Py_ssize_t = self._met
        if n == self._room:
            wide: Any = np.zeros((2 * n, WIDE))
            own: Any = np.zeros((2 * n, 6), dtype=np.intp)
            keys: Any = np.zeros(2 * n, dtype=np.int64)
            wide[:n], own[:n], keys[:n] = self._c, self._i, self._k
            self._c, self._i, self._k, self._room = wide, own, keys, 2 * n
        self._i[n, 0], self._i[n, 1], self._k[n] = x, y, key
        return n

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
    def _touch(self, n: cython.Py_ssize_t, moved: cython.bint) -> cython.double:
        """How deep (m) a place is in the other body, before the parts have `moved` or after; that, and which
        way is out, is noted, too."""
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
                px, py = cx * px - sx * py + self._t[slot, 0], sx * px + cx * py + self._t[slot, 1]
                pz += self._t[slot, 2]
            px, py, pz = px + p[x, 9], py + p[x, 10], pz + p[x, 11]
        slot = self._slot[y] if moved and y < self._parts else -1
        if slot >= 0:
            co, s = self._turn[slot, 0], self._turn[slot, 1]
            qx, qy, qz = qx + self._t[slot, 0], qy + self._t[slot, 1], qz + self._t[slot, 2]
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
        c[n, 28] = depth
        if not moved:
            c[n, 13], c[n, 14], c[n, 15], c[n, 16] = depth, ux, uy, uz
            # Where it touches, from both middles.
            far: cython.double = radius
            if self._i[n, 2]:
                far = radius / level if level > 0.0 else 0.0
            px, py = px - far * ux, py - far * uy
            c[n, 19], c[n, 20] = px - qx, py - qy
            if x >= 0:
                c[n, 17], c[n, 18] = px - p[x, 9], py - p[x, 10]
        return depth

    @cython.cfunc
    @cython.exceptval(check=False)
    def _find(self, key: cython.longlong) -> cython.Py_ssize_t:
        """Where in the table a key is, or would be."""
        mask: cython.Py_ssize_t = self._table - 1
        pair: cython.longlong = key // _MOST_PLACES
        slot: cython.Py_ssize_t = (31 * pair + 1009 * (pair // _MOST_BODIES) + key) & mask
        while self._keys[slot] != -1 and self._keys[slot] != key:
            slot = (slot + 1) & mask
        return slot

    @cython.cfunc
    @cython.exceptval(check=False)
    def _recall(self, n: cython.Py_ssize_t) -> cython.void:
        """What is remembered of a place, if it has not been elsewhere since."""
        c, m, i = self._c, self._memory, self._i
        for k in range(7, 13):
            c[n, k] = 0.0
        slot: cython.Py_ssize_t = self._find(self._k[n])
        if self._keys[slot] == -1:
            return
        x: cython.Py_ssize_t = i[n, 0]
        square: cython.double = 0.0
        off: cython.double
        for k in range(3):
            off = c[n, k] - self._pose[i[n, 1], 9 + k] - m[slot, 3 + k]
            if x >= 0:
                off += self._pose[x, 9 + k]
            square += off * off
        if square < _FORGETS * _FORGETS:
            for k in range(3):
                c[n, 7 + k], c[n, 10 + k] = m[slot, k], m[slot, 6 + k]

    @cython.cfunc
    def _remember(self, n: cython.Py_ssize_t, near_m: cython.double) -> object:
        """Note by which way a place has come in, as `_touch` has found it last, or that it has gone."""
        c, m = self._c, self._memory
        slot: cython.Py_ssize_t = self._find(self._k[n])
        if c[n, 28] <= -near_m:
            if self._keys[slot] != -1:
                for k in range(_NUMBERS):
                    m[slot, k] = 0.0
            return None
        if self._keys[slot] == -1:
            if 2 * self._used >= self._table:
                self._sift()
                m, slot = self._memory, self._find(self._k[n])
            self._keys[slot] = self._k[n]
            self._used += 1
        for k in range(3):
            m[slot, k], m[slot, 3 + k], m[slot, 6 + k] = c[n, 22 + k], c[n, 25 + k], c[n, 10 + k]
        return None

    @cython.cfunc
    def _sift(self) -> object:
        """Make room in the table: what has gone is dropped, and where little has, it gets larger."""
        self.restore(self.kept())
        return None

    def kept(self) -> Any:
        """What is remembered of all places, to be brought back."""
        keys, memory = np.asarray(self._keys), np.asarray(self._memory)
        there = (keys != -1) & memory[:, :3].any(axis=1)
        return keys[there].tobytes(), memory[there].tobytes()

    def restore(self, kept: Any) -> None:
        """Remember that again."""
        keys = np.frombuffer(kept[0], dtype=np.int64)
        memory = np.frombuffer(kept[1]).reshape(len(keys), _NUMBERS)
        size = 1024
        while size < 4 * len(keys):
            size *= 2
        self._table = size
        self._keys, self._memory = np.full(size, -1, dtype=np.int64), np.zeros((size, _NUMBERS))
        self._used = len(keys)
        n: cython.Py_ssize_t
        slot: cython.Py_ssize_t
        for n in range(len(keys)):
            slot = self._find(keys[n])
            self._keys[slot] = keys[n]
            for k in range(_NUMBERS):
                self._memory[slot, k] = memory[n, k]

    def forget(self) -> None:
        """No body has met another."""
        self.restore((b"", b""))

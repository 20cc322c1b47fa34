"""Bodies by their numbers, parts first, and the places at which they meet in a tick."""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Any

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt

from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.ways_in_kernel import KINDS

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.remembered_kernel import Remembered
else:
    from iiwa_sim.contact.remembered_kernel import Remembered

_UPRIGHT = cython.declare(cython.double, 1.0 - 1e-6)
_INF = cython.declare(cython.double, inf)
_BOX = cython.declare(cython.int, 1)
_SPHERE = cython.declare(cython.int, 2)
_CYLINDER = cython.declare(cython.int, 3)
_ROUNDING = cython.declare(cython.double, 1e-9)

WIDE = 59
"""Numbers of a place in this tick: where from the middle of its body, or in the base (3), radius; stiffness,
friction, friction's stiffness; by which way it has come in (3), how far it has rubbed (3); depth, way out
(3), lever in both bodies (2 each), limit of friction; as `_touch` finds it: what is to be remembered (3),
where from the middle of the other (3), depth; depth of its plane with all where they were before; how deep it
may press at first, and how deep it is in there without pressing; of the arm: how deep it was a tick ago, and
how far it has gone since (3); how much of its depth did not press, and how far it was brought since; of the
arm: where its line begins (3), and the way along that (3); way out (3) as `_touch` finds it; of the arm: how
far it has rubbed, and gone across (3); where it touches (2), and how deep it pressed, and was in without
pressing, before there was too little energy for that; of what is held: how that has turned (3); depth at the
ways that are tried."""

# Of a place that has gone farther (m) since it was seen last it is not known by which way it has come in.
_FORGETS = cython.declare(cython.double, 5e-3)


@cython.cclass
class Bodies(Remembered):
    """Bodies, and their places; the arrays are declared in the .pxd."""

    def __init__(self, count: int) -> None:
        """There are `count` parts; they are the first bodies, surfaces follow."""
        self._parts = count
        self._held = -1
        self._make_room(count)
        self._met, self._room = 0, 256
        self._c = np.zeros((self._room, WIDE))
        self._i = np.zeros((self._room, 8), dtype=np.intp)
        self._k = np.zeros(self._room, dtype=np.int64)
        self._contacts: Any = [None] * self._room
        Remembered.__init__(self)

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
        """Surfaces that are there from now on; each is known by a number of its own, above the numbers of
        parts."""
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
        self._upright[n] = self._axis_up(n)
        p, size = self._pose, self._size
        far: cython.double
        for row in range(3):
            along: cython.double = p[n, 3 * row + 2]
            if self._kind[n] == _BOX:
                far = fabs(p[n, 3 * row]) * size[n, 0] + fabs(p[n, 3 * row + 1]) * size[n, 1]
                far += fabs(along) * size[n, 2]
            elif self._kind[n] == _SPHERE:
                far = size[n, 0]
            elif self._kind[n] == _CYLINDER:
                far = fabs(along) * size[n, 1] + size[n, 0] * sqrt(max(0.0, 1.0 - along * along))
            else:
                far = _INF
            self._reach[n, row] = far
        self._span[n, 0], self._span[n, 1] = place[2] - self._reach[n, 2], place[2] + self._reach[n, 2]
        return None

    @cython.cfunc
    @cython.exceptval(check=False)
    def _axis_up(self, n: cython.Py_ssize_t) -> cython.int:
        """Which axis of a box or a cylinder that stands is vertical; -1 of all else."""
        p = self._pose
        axis: cython.int = 2
        if self._kind[n] == _BOX:
            axis = 0
            for each in range(1, 3):
                if fabs(p[n, 6 + each]) > fabs(p[n, 6 + axis]):
                    axis = each
        elif self._kind[n] != _CYLINDER:
            return -1
        return axis if fabs(p[n, 6 + axis]) > _UPRIGHT else -1

    @cython.cfunc
    @cython.exceptval(check=False)
    def _apart(self, x: cython.Py_ssize_t, y: cython.Py_ssize_t) -> cython.double:
        """Two bodies are no nearer to each other (m), by the boxes round them."""
        most: cython.double = -1e300
        for i in range(3):
            most = max(
                most,
                fabs(self._pose[x, 9 + i] - self._pose[y, 9 + i]) - self._reach[x, i] - self._reach[y, i],
            )
        return most

    @cython.cfunc
    @cython.exceptval(check=False)
    def _is_far(
        self,
        x: cython.Py_ssize_t,
        y: cython.Py_ssize_t,
        lx: cython.double,
        ly: cython.double,
        lz: cython.double,
        reach: cython.double,
        tall: cython.bint,
    ) -> cython.bint:
        """Whether a place of a body, from its middle, is farther (m) than that from the box round another,
        which may have neither upper nor lower end."""
        reach += _ROUNDING
        return (
            fabs(lx + self._pose[x, 9] - self._pose[y, 9]) > self._reach[y, 0] + reach
            or fabs(ly + self._pose[x, 10] - self._pose[y, 10]) > self._reach[y, 1] + reach
            or (not tall and fabs(lz + self._pose[x, 11] - self._pose[y, 11]) > self._reach[y, 2] + reach)
        )

    @cython.cfunc
    @cython.exceptval(check=False)
    def _widest(
        self, x: cython.Py_ssize_t, y: cython.Py_ssize_t, low: cython.double, high: cython.double
    ) -> cython.double:
        """How much higher (m) than its axis a cylinder on its side meets another body first, between two
        heights: at its axis, and another on its side where both would touch."""
        z: cython.double = self._pose[x, 11]
        at: cython.double = z
        if self._kind[y] == _CYLINDER and self._upright[y] < 0:
            at += (self._pose[y, 11] - z) * self._size[x, 0] / (self._size[x, 0] + self._size[y, 0])
        return max(low, min(high, at)) - z

    @cython.cfunc
    @cython.exceptval(check=True)
    def _next(self, x: cython.Py_ssize_t, y: cython.Py_ssize_t, key: cython.longlong) -> cython.Py_ssize_t:
        """Where the next place is noted, of two bodies, under a key."""
        n: cython.Py_ssize_t = self._met
        if n == self._room:
            wide: Any = np.zeros((2 * n, WIDE))
            own: Any = np.zeros((2 * n, 8), dtype=np.intp)
            keys: Any = np.zeros(2 * n, dtype=np.int64)
            wide[:n], own[:n], keys[:n] = self._c, self._i, self._k
            self._c, self._i, self._k, self._room = wide, own, keys, 2 * n
            self._contacts = self._contacts + [None] * n
        self._i[n, 0], self._i[n, 1], self._k[n], self._contacts[n] = x, y, key, None
        return n

    @cython.cfunc
    @cython.exceptval(check=False)
    def _recall(self, n: cython.Py_ssize_t) -> cython.void:
        """What is remembered of a place, if it has not been elsewhere since."""
        c, m, i = self._c, self._memory, self._i
        for k in range(7, 13):
            c[n, k] = 0.0
        c[n, 31], c[n, 33], c[n, 37], c[n, 38] = 0.0, -1.0, 0.0, 0.0
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
            c[n, 34 + k] = off
            square += off * off
        if square < _FORGETS * _FORGETS:
            for k in range(3):
                c[n, 7 + k], c[n, 10 + k] = m[slot, k], m[slot, 6 + k]
            c[n, 31] = c[n, 33] = max(0.0, m[slot, 9])
            c[n, 37] = m[slot, 10]

    @cython.cfunc
    def _remember(self, n: cython.Py_ssize_t, near_m: cython.double) -> object:
        """Note by which way a place has come in, as `_touch` has found it last, or that it has gone."""
        c = self._c
        if c[n, 28] <= -near_m:
            self._forget_place(self._k[n])
            return None
        slot: cython.Py_ssize_t = self._room_for(self._k[n])
        m = self._memory
        for k in range(3):
            m[slot, k], m[slot, 3 + k], m[slot, 6 + k] = c[n, 22 + k], c[n, 25 + k], c[n, 10 + k]
        m[slot, 9], m[slot, 10] = c[n, 28], c[n, 30]
        return None

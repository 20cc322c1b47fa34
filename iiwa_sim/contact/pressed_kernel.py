"""What of an arm presses on parts that lie: links, tool and jaws as balls, what is held as a body."""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cython
import numpy as np

from iiwa_sim.contact.crowd import PressingBall, Spring
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Vector

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.contact_kernel import Contact
    from cython.cimports.iiwa_sim.contact.stored_kernel import Stored
else:
    from iiwa_sim.contact.contact_kernel import Contact
    from iiwa_sim.contact.stored_kernel import Stored

_STEP = cython.declare(cython.double, 1e-3)
_ALL = cython.declare(cython.double, 1.0)  # deeper (m) than anything presses
_UP = cython.declare(cython.double, 0.9)  # of a direction: what pushes like that is below


@cython.cclass
class Pressed(Stored):
    """Parts that lie, and what of the arm may press on them in a tick; the attributes are declared in the
    .pxd."""

    def __init__(self, count: int, tick_s: float) -> None:
        """There are `count` parts."""
        Stored.__init__(self, count, tick_s)
        self._lies = np.zeros(max(count, 1), dtype=np.int8)
        self._balls: Any = {}
        self.on_held: Any = {}
        self.springs: Any = {}
        self.unpressed: Any = {}
        self.left: Any = []
        self.pressed: Any = set()

    def hold(
        self, part: int, solid: Surface | None, brought_m: float = 0.0, way: Vector = (0.0, 0.0, 0.0)
    ) -> None:
        """The arm holds a part there in this tick, which it has brought so far, its middle by that way (m, in
        the base), or none; nothing presses on parts yet."""
        n: cython.Py_ssize_t
        self._held, self._brought = (-1 if solid is None else part), brought_m
        for k in range(3):
            self._by[k] = way[k]
        if solid is not None:
            self._put_body(part, solid)
        self._balls, self.unpressed, self.pressed, self.left = {}, {}, set(), []
        self.on_held, self.springs = {}, {}
        for n in range(self._parts):
            self._deep[n] = 0.0

    def look(self, part: int, balls: Sequence[PressingBall]) -> float:
        """Note which balls may press on a part in this tick; gives how deep (m) the deepest of them, or of
        places of the part in the held one, is: less than 0 where none is in it."""
        n: cython.Py_ssize_t = part
        self._balls[part], self._met = balls, 0
        self._of_the_arm(n)
        deepest: cython.double = -1e9
        for c in range(self._met):
            deepest = max(deepest, self._c[c, 13])
            if self._k[c] == -2 and self._c[c, 13] > 0.0:
                self.pressed.add(part)
        self._deep[n] = max(0.0, deepest)
        return float(deepest)

    @cython.cfunc
    def _of_the_arm(self, n: cython.Py_ssize_t) -> object:
        """Note what arm and held part do to a part."""
        c: cython.Py_ssize_t
        h: cython.Py_ssize_t
        key: cython.longlong
        for each in self._balls.get(n, ()):
            middle, radius, stiffness, friction, holding, rubbed, came, held, place, *others = each
            was_deep, went, start, line, unpressed, contact, turned = others
            key = -2
            if held >= 0:
                h = held
                key = (self._id[h] * 1048576 + n) * 64 + 32 + place
            c = self._next(-1, n, key)
            self._i[c, 2] = self._i[c, 3] = 0
            self._contacts[c] = contact
            for k in range(3):
                self._c[c, k], self._c[c, 34 + k] = middle[k], went[k]
                self._c[c, 39 + k], self._c[c, 42 + k] = start[k], line[k]
                self._c[c, 55 + k] = turned[k]
            self._c[c, 3], self._c[c, 4] = radius, stiffness
            self._c[c, 5], self._c[c, 6] = friction, holding
            self._i[c, 6], self._c[c, 33], self._c[c, 37] = place, was_deep, unpressed
            if held >= 0:
                self._recall(c)
                self._bring(c, 1.0)
            for k in range(3):
                self._c[c, 7 + k], self._c[c, 10 + k], self._c[c, 48 + k] = came[k], rubbed[k], rubbed[k]
            self._touch(c, False, True)
            if held >= 0:
                self._leave_at(c)
            if self._is_beside(c):
                self._met += 1
            elif held >= 0:
                self._forget_place(key)
        if self._held >= 0 and self._apart(n, self._held) < 0.05:
            low = max(self._span[n, 0], self._span[self._held, 0])
            high = min(self._span[n, 1], self._span[self._held, 1]) - _STEP
            if self._upright[self._held] < 0:
                low, high = self._span[n, 0], self._span[n, 1] - _STEP
            elif self._upright[n] >= 0 and self._is_on(n) and not self._is_met(n, self._held):
                self._forget_pair(n, self._held)
                return None
            self._meet(n, self._held, low, high, 1.0, False, 0.05)
        return None

    @cython.cfunc
    @cython.exceptval(check=False)
    def _is_on(self, n: cython.Py_ssize_t) -> cython.bint:
        """Whether the held part presses on a part from above: so it is not beside that, however deep."""
        is_on: cython.bint = False
        for m in range(self._met):
            its: cython.bint = self._i[m, 1] == n and self._i[m, 0] < 0 and self._k[m] != -2
            is_on = is_on or (its and self._c[m, 13] > 0.0 and self._c[m, 16] > _UP)
        return is_on

    @cython.cfunc
    def _tell_the_arm(self) -> object:
        """Note what arm and held part press less since this tick, and what acts on the held part."""
        for m in range(self._met):
            if self._i[m, 1] == self._held:
                self._acts(m, self._held)
            elif self._i[m, 0] < 0 and self._k[m] != -2:
                self._leave_at(m)
                self._acts(m, self._i[m, 1])
            elif self._i[m, 0] < 0 and self._c[m, 30] > self._c[m, 37]:
                self.left.append((self._i[m, 1], self._i[m, 6], self._c[m, 30]))
        return None

    @cython.cfunc
    def _leave_at(self, m: cython.Py_ssize_t) -> object:
        """Note how deep a place of the held part is in another without pressing."""
        contact: Contact | None = self._contacts[m]
        deep: cython.double = self._c[m, 32]
        if contact is not None and self._c[m, 28] <= 0.0 and (contact._leans or contact.is_from_above()):
            deep = _ALL  # past the edge: where it presses from now on, it has pressed nothing before
        if deep > 1e-9 or (contact is not None and contact.unpressed > 0.0):
            self.unpressed[self._i[m, 1], self._i[m, 6]] = deep
        return None

    @cython.cfunc
    def _acts(self, m: cython.Py_ssize_t, part: cython.Py_ssize_t) -> object:
        """Note what a place does to the held part, where all have gone: with what acts in another part, or,
        for places of parts in the held one, in that."""
        c, p, h = self._c, self._pose, self._held
        f: cython.double = c[m, 4] * c[m, 28]
        if f <= 0.0 or h < 0:
            return None
        nx, ny, nz = c[m, 45], c[m, 46], c[m, 47]
        x, y, z = c[m, 25], c[m, 26], c[m, 27]
        way: cython.double = 1.0
        if part == h:
            fx, fy, fz = -f * nx, -f * ny, -f * nz
        else:
            way = -1.0
            rx, ry, rz = self._held_by_friction(m)
            fx, fy, fz = f * nx - c[m, 6] * rx, f * ny - c[m, 6] * ry, f * nz - c[m, 6] * rz
            x, y, z = c[m, 0] - p[h, 9], c[m, 1] - p[h, 10], c[m, 2] - p[h, 11]
            x, y, z = x - c[m, 3] * nx, y - c[m, 3] * ny, z - c[m, 3] * nz
        acts = np.array((fx, fy, fz, y * fz - z * fy, z * fx - x * fz, x * fy - y * fx))
        self.on_held[part] = self.on_held.get(part, 0.0) + acts
        into = (way * nx, way * ny, way * nz)
        self.springs.setdefault(part, []).append(Spring(c[m, 4], c[m, 28], into))
        return None

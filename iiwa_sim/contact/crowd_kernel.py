"""Parts that lie, and are pushed in a tick, all that touch each other at once: which of them meet, and where
they end.

Where they go is found in `balance_kernel`, how that moves what lies on them in `carried_kernel`, what is
stored then in `stored_kernel`.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cython
import numpy as np

from iiwa_sim.contact.crowd import LyingPart, PartMotion, PressingBall
from iiwa_sim.contact.moments import GRAVITY_M_S2
from iiwa_sim.contact.stored_kernel import NEAR_M
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Vector

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.stored_kernel import Stored
else:
    from iiwa_sim.contact.stored_kernel import Stored

_GRAVITY = cython.declare(cython.double, GRAVITY_M_S2)
_NEAR = cython.declare(cython.double, NEAR_M)
_STEP = cython.declare(cython.double, 1e-3)
_HALF = cython.declare(cython.double, 0.5)  # of the stiffness: two parts meet at places of both


@cython.final
@cython.cclass
class Crowd(Stored):
    """Parts that lie, and what stands among them."""

    stored_j: float = cython.declare(cython.double, visibility="readonly")
    """What springs between bodies store, of all that were pushed last (J)."""
    unpressed: Any = cython.declare(object, visibility="readonly")
    """How deep (m) the held part is in others without pressing, by the numbers of part and place."""
    pressed: Any = cython.declare(object, visibility="readonly")
    """The numbers of parts on which links, tool or jaws press."""
    _lies: cython.char[::1]
    _rubs: cython.char[::1]  # whether friction's springs below it are wound
    _balls: Any  # by the parts on which they press
    _bound: cython.double[::1]  # how far each of those that may move may go (m)

    def __init__(self, count: int, tick_s: float) -> None:
        """There are `count` parts."""
        Stored.__init__(self, count, tick_s)
        least = max(count, 1)
        self.stored_j = self._stored = self._share = self._slower = 0.0
        self._lies, self._rubs = np.zeros((2, least), dtype=np.int8)
        self._bound = np.zeros(least)
        self._balls, self.unpressed, self.pressed = {}, {}, set()

    def lay(self, part: int, laid: LyingPart | None) -> None:
        """A part lies there, or does not lie."""
        n: cython.Py_ssize_t = part
        self._lies[n] = laid is not None
        if laid is None:
            self._on[n] = -1
            return
        self._put_body(n, laid.solid)
        for i in range(4):
            self._velocity[n, i] = laid.velocity[i]
        self._rubs[n] = len(laid.wound) > 0
        for i in range(8):
            self._wound[n, i] = laid.wound[i] if self._rubs[n] else 0.0
        self._on[n] = laid.on
        carries: cython.double = laid.carries_kg * _GRAVITY
        # What it carries presses it down, not deeper: by so much the spring below it begins higher.
        self._below[n, 0], self._below[n, 3] = laid.below, laid.top - self._span[n, 0]
        self._below[n, 1] = self._below[n, 3] + carries / laid.below
        self._below[n, 2] = laid.mass_kg * _GRAVITY + carries
        self._rest_on(n, laid.mass_kg, laid.carries_kg, laid.carries_kgm2)

    def hold(self, part: int, solid: Surface | None, brought_m: float = 0.0) -> None:
        """The arm holds a part there in this tick, which it has brought so far, or none; nothing presses on
        parts yet."""
        n: cython.Py_ssize_t
        self._held, self._brought = (-1 if solid is None else part), brought_m
        if solid is not None:
            self._put_body(part, solid)
        self._balls, self.unpressed, self.pressed = {}, {}, set()
        for n in range(self._parts):
            self._deep[n] = 0.0

    def look(self, part: int, balls: Sequence[PressingBall], still: bool) -> float:
        """Note which balls may press on a part in this tick; gives how deep (m) the deepest of them, or of
        places of the part in the held one, is: less than 0 where none is in it.

        Balls do not count where a part rests and none is in it: whether somebody looks must change nothing.
        """
        n: cython.Py_ssize_t = part
        self._balls[part], self._met = balls, 0
        self._of_the_arm(n)
        deepest: cython.double = -1e9
        for c in range(self._met):
            deepest = max(deepest, self._c[c, 13])
            if self._k[c] == -2 and self._c[c, 13] > 0.0:
                self.pressed.add(part)
        self._deep[n] = max(0.0, deepest)
        if still and deepest <= 0.0:
            del self._balls[part]
        return float(deepest)

    @cython.cfunc
    def _of_the_arm(self, n: cython.Py_ssize_t) -> object:
        """Note what arm and held part do to a part."""
        c: cython.Py_ssize_t
        h: cython.Py_ssize_t
        key: cython.longlong
        for each in self._balls.get(n, ()):
            middle, radius, stiffness, friction, holding, rubbed, came, held, place, was_deep, went = each
            key = -2
            if held >= 0:
                h = held
                key = (self._id[h] * 1048576 + n) * 64 + 32 + place
            c = self._next(-1, n, key)
            self._i[c, 2] = self._i[c, 3] = 0
            for k in range(3):
                self._c[c, k], self._c[c, 34 + k] = middle[k], went[k]
            self._c[c, 3], self._c[c, 4] = radius, stiffness
            self._c[c, 5], self._c[c, 6] = friction, holding
            self._c[c, 31], self._c[c, 33] = 1e9, was_deep  # what the arm itself is in is known elsewhere
            if held >= 0:
                self._recall(c)
                self._c[c, 38] = self._brought
            for k in range(3):
                self._c[c, 7 + k], self._c[c, 10 + k] = came[k], rubbed[k]
            self._touch(c, False, True)
            if held >= 0 and self._c[c, 30] > 1e-9:
                self.unpressed[n, place] = self._c[c, 30]
            if self._is_beside(c):
                self._met += 1
        if self._held >= 0 and self._apart(n, self._held) < 0.05:
            low = max(self._span[n, 0], self._span[self._held, 0])
            high = min(self._span[n, 1], self._span[self._held, 1]) - _STEP
            if self._upright[self._held] < 0:
                low, high = self._span[n, 0], self._span[n, 1] - _STEP
            self._meet(n, self._held, low, high, 1.0, False, 0.05)
        return None

    def push(self, parts: Sequence[int]) -> list[PartMotion]:
        """A tick of parts that are pushed, or move, and of all that they push: those that stay as they are,
        or slide for themselves, are not told."""
        found: list[PartMotion] = []
        self.stored_j = 0.0
        n: cython.Py_ssize_t
        farthest: cython.double = 0.0
        for n in range(self._parts):
            farthest = max(farthest, self._far_with(n))
        for part in sorted(parts, key=self._height):
            n = part
            if self._slot[n] == -1 and self._lies[n]:
                self._gather(n, farthest)
                if self._is_pushed():
                    self._join()
                    self._balance()
                    self._go()
                    for k in range(self._many):
                        self._tell(self._order[k], found)
                for k in range(self._many):
                    self._slot[self._group[k]] = -2 - k  # done
        self._slot[:] = -1
        return found

    @cython.cfunc
    def _gather(self, part: cython.Py_ssize_t, farthest: cython.double) -> object:
        """Find all that a part may meet in this tick, in which none goes farther (m) than the `farthest`, and
        these again; and the places at which they do."""
        self._met = self._many = 0
        self._add(part, 0.0)
        k: cython.Py_ssize_t = 0
        n: cython.Py_ssize_t
        o: cython.Py_ssize_t
        while k < self._many:
            n = self._group[k]
            k += 1
            self._of_the_arm(n)
            self._bound[k - 1] = max(self._bound[k - 1], self._far_with(n))
            reach: cython.double = _NEAR + self._bound[k - 1]
            for o in range(self._bodies):
                apart: cython.double = self._apart(n, o)
                if apart > reach + farthest:
                    continue
                if o < self._parts:
                    if not self._lies[o] or 0 <= self._slot[o] < k or o == self._held:
                        continue
                    if self._carries(n, o) or self._carries(o, n):
                        if self._on[o] == n:
                            self._add(o, self._bound[k - 1])
                        continue
                elif self._on[n] == o:
                    continue
                goes = self._far_with(o) if o < self._parts else 0.0
                near: cython.bint = apart <= reach + goes and self._beside(n, o, reach + goes)
                if near and o < self._parts:
                    self._add(o, self._bound[k - 1])
        return None

    @cython.cfunc
    def _add(self, part: cython.Py_ssize_t, bound: cython.double) -> object:
        """A part may move in this tick, so far (m) at least; and so may what carries it, if that goes."""
        if self._slot[part] != -1:
            return None
        self._slot[part] = self._many
        self._group[self._many], self._bound[self._many] = part, bound
        self._many += 1
        at: cython.Py_ssize_t = self._on[part]
        while 0 <= at < self._parts:
            if self._deep[at] > 0.0 or self._rubs[at] or self._far(at) > 0.0:
                self._add(at, bound)
            at = self._on[at]
        return None

    @cython.cfunc
    def _beside(self, n: cython.Py_ssize_t, o: cython.Py_ssize_t, reach: cython.double) -> cython.bint:
        """Note where a part meets another, or a surface; whether it does."""
        s = self._span
        lift: cython.double = _STEP + max(0.0, self._below[n, 1])
        low: cython.double = s[n, 0] + lift
        high: cython.double = s[n, 1] - _STEP
        share: cython.double = 1.0
        if self._upright[o] >= 0:
            low, high = max(low, s[o, 0]), min(high, s[o, 1])
        if o < self._parts:
            low = max(low, s[o, 0] + _STEP + max(0.0, self._below[o, 1]))
            high = min(high, s[o, 1] - _STEP)
            share = _HALF
        near: cython.bint = self._meet(n, o, low, high, share, True, reach)
        back: cython.bint = self._meet(o, n, low, high, share, True, reach)
        return near or back

    @cython.cfunc
    @cython.exceptval(check=False)
    def _is_pushed(self) -> cython.bint:
        """Whether anything of what has been gathered presses, or moves other than for itself."""
        for c in range(self._met):
            if self._c[c, 13] > 0.0:
                return True
        moves: cython.bint = False
        for k in range(self._many):
            n = self._group[k]
            if self._rubs[n]:
                return True
            for i in range(4):
                moves = moves or self._velocity[n, i] != 0.0
        return moves and (self._met > 0 or self._velocity[self._group[0], 3] != 0.0)

    @cython.cfunc
    def _tell(self, k: cython.Py_ssize_t, found: Any) -> object:
        """Note how a part ends, unless it stays at rest as it is."""
        n = self._group[k]
        t = self._t
        way = (t[k, 0], t[k, 1], t[k, 2], t[k, 3])
        if k == 0:
            self.stored_j += self._stored
        if not any(way) and not self._rubs[n]:
            resting: cython.bint = True
            for i in range(4):
                resting = resting and self._velocity[n, i] == 0.0
            if resting:
                return None
        per: cython.double = self._slower / self._tick
        velocity = (per * way[0], per * way[1], per * way[2], per * way[3])
        wound: list[float] = []
        for j in range(4):
            wound += self._winds(k, j, self._share == 1.0)
        pressed: cython.bint = False
        for at in range(self._first[k], self._first[k + 1]):
            pressed = pressed or self._c[self._of[self._mine[at], 1], 28] > 0.0
        found.append(PartMotion(n, way, velocity, tuple(wound), bool(pressed)))
        return None

    def on_held(self) -> tuple[Vector, Vector]:
        """What places of parts that have been looked at, or pushed, in this tick do to the held part, where
        they are now: force (N), and torque (Nm) about its middle, in the base."""
        force, torque = [0.0] * 3, [0.0] * 3
        c = self._c
        for n in range(self._parts):
            if self._held < 0 or not self._lies[n] or self._apart(n, self._held) >= 0.0:
                continue
            balls, self._balls, self._met = self._balls, {}, 0
            self._of_the_arm(n)
            self._balls = balls
            for m in range(self._met):
                f: cython.double = c[m, 4] * c[m, 13]
                if f <= 0.0:
                    continue
                fx, fy, fz = -f * c[m, 14], -f * c[m, 15], -f * c[m, 16]
                x, y, z = c[m, 25], c[m, 26], c[m, 27]
                levers = (y * fz - z * fy, z * fx - x * fz, x * fy - y * fx)
                force = [a + b for a, b in zip(force, (fx, fy, fz), strict=True)]
                torque = [a + b for a, b in zip(torque, levers, strict=True)]
        return (force[0], force[1], force[2]), (torque[0], torque[1], torque[2])

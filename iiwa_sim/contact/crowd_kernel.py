"""Parts that lie, and are pushed in a tick, all that touch each other at once: which of them meet, and where
they end.

What of the arm presses on them is said in `pressed_kernel`, where they go in `balance_kernel`, how that moves
what lies on them in `carried_kernel`, what is stored then in `stored_kernel`.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cython
import numpy as np

from iiwa_sim.contact.crowd import LyingPart, PartMotion
from iiwa_sim.contact.moments import GRAVITY_M_S2
from iiwa_sim.contact.stored_kernel import NEAR_M

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.pressed_kernel import Pressed
else:
    from iiwa_sim.contact.pressed_kernel import Pressed

_GRAVITY = cython.declare(cython.double, GRAVITY_M_S2)
_NEAR = cython.declare(cython.double, NEAR_M)
_STEP = cython.declare(cython.double, 1e-3)
_HALF = cython.declare(cython.double, 0.5)  # of the stiffness: two parts meet at places of both


@cython.final
@cython.cclass
class Crowd(Pressed):
    """Parts that lie, and what stands among them."""

    stored_j: float = cython.declare(cython.double, visibility="readonly")
    """What springs between bodies store, of all that were pushed last (J)."""
    _rubs: cython.char[::1]  # whether friction's springs below it are wound
    _bound: cython.double[::1]  # how far each of those that may move may go (m)
    _farthest: cython.double[::1]  # how far each part may go in this tick, with what carries it (m)

    def __init__(self, count: int, tick_s: float) -> None:
        """There are `count` parts."""
        Pressed.__init__(self, count, tick_s)
        least = max(count, 1)
        self.stored_j = 0.0
        self._rubs = np.zeros(least, dtype=np.int8)
        self._bound, self._farthest = np.zeros(least), np.zeros(least)

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

    def push(self, parts: Sequence[int]) -> list[PartMotion]:
        """A tick of parts that are pushed, or move, and of all that they push: those that stay as they are,
        or slide for themselves, are not told."""
        found: list[PartMotion] = []
        self.stored_j = 0.0
        n: cython.Py_ssize_t
        farthest: cython.double = 0.0
        for n in range(self._parts):
            self._farthest[n] = self._far_with(n)
            farthest = max(farthest, self._farthest[n])
        for part in sorted(parts, key=self._height):
            n = part
            if self._slot[n] == -1 and self._lies[n]:
                self._gather(n, farthest)
                if self._is_pushed():
                    self._join()
                    self._balance()
                    self._go()
                    self._tell_the_arm()
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
            self._bound[k - 1] = max(self._bound[k - 1], self._farthest[n])
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
                goes: cython.double = self._farthest[o] if o < self._parts else 0.0
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
            wound += self._winds(k, j)
        pressed: cython.bint = False
        for at in range(self._first[k], self._first[k + 1]):
            pressed = pressed or self._c[self._of[self._mine[at], 1], 28] > 0.0
        found.append(PartMotion(n, way, velocity, tuple(wound), bool(pressed)))
        return None

"""How parts that lie give way in a tick, all that touch each other at once: each goes the way on which it
ends where all that presses is in balance.

A part goes a way dx dy dz (m) and turns by an angle about z (rad), together four numbers. Where two bodies
meet there is a spring that presses along a line, and by Coulomb's friction across it, of a spring that slips
at its limit. What a part lies on presses up, and rubs at four points below it. The ways are those for which

    sum m (way - velocity t)^2 / 2 t^2  +  what the springs store at the end  +  what friction takes

is least, which is an implicit step of Euler's with all forces as they are at its end: whatever the stiffness
and the tick, parts and springs have no more energy after it than before. The function is convex and without
kinks: steps of Newton's for one part after the other, along a row and back, find the least.

There all that presses is seen as planes. Then what is stored at the end is counted as it really is: what
would be too much is taken from the parts' speed, and if that is not enough, from their way.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt

from iiwa_sim.contact.moments import GRAVITY_M_S2
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.ways_in_kernel import NOT_IN
from iiwa_sim.frames import Vector

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.places_kernel import Places
    from cython.cimports.iiwa_sim.robot.trigonometry_kernel import cosine, sine
else:
    from iiwa_sim.contact.places_kernel import Places
    from iiwa_sim.robot.trigonometry_kernel import cosine, sine

_GRAVITY = cython.declare(cython.double, GRAVITY_M_S2)
NEAR_M = 2e-4
"""What is no farther than this, and than it may come in the tick, is met."""
_NEAR = cython.declare(cython.double, NEAR_M)
STILL_M = 1e-9
"""A part that would go a shorter way in a tick stays."""
_STILL = cython.declare(cython.double, STILL_M)
_STEP = cython.declare(cython.double, 1e-3)
# So often the ways of parts that touch are found anew, and steps (m) that end that; and of a part alone.
_SWEEPS = cython.declare(cython.Py_ssize_t, 12)
_SMALL = cython.declare(cython.double, 1e-8)
_STEPS = cython.declare(cython.Py_ssize_t, 40)
_SMALLEST = cython.declare(cython.double, 1e-11)
_HALVINGS = cython.declare(cython.Py_ssize_t, 12)
_TRIES = cython.declare(cython.Py_ssize_t, 30)
_HALF = cython.declare(cython.double, 0.5)  # of the stiffness: two parts meet at places of both
_SPHERE = cython.declare(cython.int, 2)
_CYLINDER = cython.declare(cython.int, 3)
# Of half an edge: points there have the moments of a face.
_THIRD = cython.declare(cython.double, 0.5773502691896258)


class Laid(NamedTuple):
    """A part that lies, in numbers."""

    solid: Surface
    velocity: tuple[float, float, float, float]
    """m/s three times, rad/s"""
    wound: Sequence[float]
    """How far friction's springs below it are wound: x and y of four places (m); empty for not at all."""
    mass_kg: float
    on: int
    """The number of the body on which it lies: parts first, then surfaces."""
    top: float
    """How high the face is on which it lies (m)."""
    below: float
    """Stiffness of both in a row (N/m)."""
    carries_kg: float
    """What lies on it, and its moment of inertia (kg m^2) about the vertical through the part's middle."""
    carries_kgm2: float


class Presses(NamedTuple):
    """A ball that presses on a part: of the arm, or of what it holds."""

    middle: Vector
    radius: float
    stiffness: float
    """N/m, of both in a row."""
    friction: float = 0.0
    holding: float = 1.0
    """Stiffness (N/m) of friction's spring."""
    rubbed: Vector = (0.0, 0.0, 0.0)
    """How far it has gone along the part (m), as friction holds that."""
    came: Vector = NOT_IN
    """By which way it has come into the part, if that is remembered elsewhere."""
    held: int = -1
    """The number of the held part to which it belongs, and which of its places it is."""
    place: int = 0


class Gone(NamedTuple):
    """A part after a tick."""

    part: int
    way: tuple[float, float, float, float]
    velocity: tuple[float, float, float, float]
    wound: tuple[float, ...]
    pressed: bool
    """Whether anything presses on it."""


@cython.final
@cython.cclass
class Crowd(Places):
    """Parts that lie, and what stands among them."""

    stored_j: float = cython.declare(cython.double, visibility="readonly")
    """What springs between bodies store, of all that were pushed last (J)."""
    _tick: cython.double
    _stored: cython.double
    _limit: cython.double  # of friction at each point below the part that is looked at (N)
    _lies: cython.char[::1]
    _rubs: cython.char[::1]  # whether friction's springs below it are wound
    _velocity: cython.double[:, ::1]
    _wound: cython.double[:, ::1]
    _points: cython.double[:, ::1]  # four below each, from its middle (m)
    _mass: cython.double[:, ::1]  # m, m, m, I with what it carries
    _below: cython.double[:, ::1]  # stiffness, depth, weight, and that of what it carries
    _on: cython.Py_ssize_t[::1]
    _deep: cython.double[::1]  # how deep what presses on it is in it (m)
    _balls: Any  # by the parts on which they press
    _many: cython.Py_ssize_t  # parts that may move, and which these are
    _group: cython.Py_ssize_t[::1]
    _bound: cython.double[::1]  # how far each may go (m)
    _d: cython.double[:, ::1]  # their ways
    _first: cython.Py_ssize_t[::1]  # where the places of each begin
    _mine: cython.Py_ssize_t[::1]
    _open: cython.char[::1]  # whether the way of each is still to be found
    _h: cython.double[:, ::1]  # second derivatives
    _b: cython.double[::1]  # first ones
    _s: cython.double[::1]  # the next step

    def __init__(self, count: int, tick_s: float) -> None:
        """For so many parts."""
        Places.__init__(self, count)
        least = max(count, 1)
        self._tick = tick_s
        self.stored_j = 0.0
        self._lies: Any = np.zeros(least, dtype=np.int8)
        self._velocity, self._wound = np.zeros((least, 4)), np.zeros((least, 8))
        self._rubs: Any = np.zeros(least, dtype=np.int8)
        self._points = np.zeros((least, 8))
        self._mass = np.zeros((least, 4))
        self._stored = self._limit = 0.0
        self._below = np.zeros((least, 4))
        self._on = np.full(least, -1, dtype=np.intp)
        self._deep = np.zeros(least)
        self._d, self._group = np.zeros((least, 4)), np.zeros(least, dtype=np.intp)
        self._many = 0
        self._bound = np.zeros(least)
        self._open: Any = np.zeros(least, dtype=np.int8)
        self._h, self._b, self._s = np.zeros((4, 4)), np.zeros(4), np.zeros(4)
        self._first, self._mine = np.zeros(least + 1, dtype=np.intp), np.zeros(512, dtype=np.intp)
        self._balls: Any = {}

    def lay(self, part: int, laid: Laid | None) -> None:
        """A part lies there, or does not lie."""
        n: cython.Py_ssize_t = part
        self._lies[n] = laid is not None
        if laid is None:
            return
        self._put_body(n, laid.solid)
        for i in range(4):
            self._velocity[n, i] = laid.velocity[i]
        self._rubs[n] = len(laid.wound) > 0
        for i in range(8):
            self._wound[n, i] = laid.wound[i] if self._rubs[n] else 0.0
        self._on[n] = laid.on
        mass: cython.double = laid.mass_kg
        self._below[n, 0], self._below[n, 1] = laid.below, laid.top - self._span[n, 0]
        self._below[n, 2], self._below[n, 3] = mass * _GRAVITY, laid.carries_kg * _GRAVITY
        self._rest_on(n, mass, laid.carries_kg, laid.carries_kgm2)

    @cython.cfunc
    @cython.exceptval(check=False)
    def _rest_on(
        self, n: cython.Py_ssize_t, mass: cython.double, more: cython.double, about: cython.double
    ) -> cython.void:
        """The four points at which a part rubs on what it lies on, with the moments of its face, and its
        inertia."""
        p, size, g = self._pose, self._size, self._points
        ax: cython.double = 0.0
        ay: cython.double = 0.0
        bx: cython.double = 0.0
        by: cython.double = 0.0
        turning: cython.double
        if self._kind[n] == _SPHERE:
            turning = 0.4 * mass * size[n, 0] * size[n, 0]
        elif self._kind[n] == _CYLINDER and self._upright[n] >= 0:
            ax = by = 0.5 * size[n, 0]
            turning = 0.5 * mass * size[n, 0] * size[n, 0]
        elif self._kind[n] == _CYLINDER:
            ax, ay = _THIRD * size[n, 1] * p[n, 2], _THIRD * size[n, 1] * p[n, 5]
            turning = mass * (0.25 * size[n, 0] * size[n, 0] + size[n, 1] * size[n, 1] / 3.0)
        else:
            up: cython.Py_ssize_t = self._upright[n] if self._upright[n] >= 0 else 2
            i: cython.Py_ssize_t = (up + 1) % 3
            j: cython.Py_ssize_t = (up + 2) % 3
            ax, ay = _THIRD * size[n, i] * p[n, i], _THIRD * size[n, i] * p[n, 3 + i]
            bx, by = _THIRD * size[n, j] * p[n, j], _THIRD * size[n, j] * p[n, 3 + j]
            turning = mass * (size[n, i] * size[n, i] + size[n, j] * size[n, j]) / 3.0
        g[n, 0], g[n, 1], g[n, 2], g[n, 3] = ax + bx, ay + by, bx - ax, by - ay
        g[n, 4], g[n, 5], g[n, 6], g[n, 7] = -ax - bx, -ay - by, ax - bx, ay - by
        for k in range(3):
            self._mass[n, k] = mass + more
        self._mass[n, 3] = turning + about

    def hold(self, part: int, solid: Surface | None) -> None:
        """In this tick the arm holds a part there, or none; nothing presses on parts yet."""
        n: cython.Py_ssize_t
        self._held = -1 if solid is None else part
        if solid is not None:
            self._put_body(part, solid)
        self._balls: Any = {}
        for n in range(self._parts):
            self._deep[n] = 0.0

    def look(self, part: int, balls: Sequence[Presses], still: bool) -> float:
        """These may press on a part in this tick; how deep (m) the deepest of them, or of places of the part
        in the held one, is, less than 0 where none is in it.

        They do not count where a part rests and none is in it: whether somebody looks must change nothing.
        """
        n: cython.Py_ssize_t = part
        self._balls[part] = balls
        self._met = 0
        self._of_the_arm(n)
        deepest: cython.double = -1e9
        for c in range(self._met):
            deepest = max(deepest, self._c[c, 13])
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
            middle, radius, stiffness, friction, holding, rubbed, came, held, place = each
            key = -2
            if held >= 0:
                h = held
                key = (self._id[h] * 1048576 + n) * 64 + 32 + place
            c = self._next(-1, n, key)
            self._i[c, 2] = self._i[c, 3] = 0
            for k in range(3):
                self._c[c, k] = middle[k]
            self._c[c, 3], self._c[c, 4] = radius, stiffness
            self._c[c, 5], self._c[c, 6] = friction, holding
            if held >= 0:
                self._recall(c)
            else:
                for k in range(3):
                    self._c[c, 7 + k], self._c[c, 10 + k] = came[k], rubbed[k]
            self._touch(c, False)
            if self._is_beside(c):
                self._met += 1
        if self._held >= 0 and self._apart(n, self._held) < 0.05:
            low = max(self._span[n, 0], self._span[self._held, 0])
            high = min(self._span[n, 1], self._span[self._held, 1]) - _STEP
            if self._upright[self._held] < 0:
                low, high = self._span[n, 0], self._span[n, 1] - _STEP
            self._meet(n, self._held, low, high, 1.0, False, 0.05)
        return None

    def push(self, parts: Sequence[int]) -> list[Gone]:
        """A tick of parts that are pushed, or move, and of all that they push: those that stay as they are,
        or slide for themselves, are not told."""
        found: list[Gone] = []
        self.stored_j = 0.0
        n: cython.Py_ssize_t
        for part in parts:
            n = part
            if self._slot[n] == -1 and self._lies[n]:
                self._gather(n)
                if self._is_pushed():
                    self._balance()
                    self._go(found)
                for k in range(self._many):
                    self._slot[self._group[k]] = -2 - k  # done
        for k in range(self._parts):
            self._slot[k] = -1
        return found

    @cython.cfunc
    def _gather(self, part: cython.Py_ssize_t) -> object:
        """Find all that a part may meet in this tick, and these again; and the places at which they do."""
        self._met, self._many = 0, 1
        self._group[0], self._bound[0] = part, 0.0
        self._slot[part] = 0
        k: cython.Py_ssize_t = 0
        n: cython.Py_ssize_t
        o: cython.Py_ssize_t
        near: cython.bint
        while k < self._many:
            n = self._group[k]
            k += 1
            self._of_the_arm(n)
            self._bound[k - 1] = max(self._bound[k - 1], self._far(n))
            reach: cython.double = _NEAR + self._bound[k - 1]
            for o in range(self._bodies):
                if o < self._parts:
                    if not self._lies[o] or 0 <= self._slot[o] < k or o == self._held:
                        continue
                    if self._carries(n, o) or self._carries(o, n):
                        continue
                elif self._on[n] == o:
                    continue
                if self._apart(n, o) > reach + (self._far(o) if o < self._parts else 0.0):
                    continue
                near = self._beside(n, o, reach + (self._far(o) if o < self._parts else 0.0))
                if near and o < self._parts and self._slot[o] == -1:
                    self._slot[o] = self._many
                    self._group[self._many], self._bound[self._many] = o, self._bound[k - 1]
                    self._many += 1
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
    def _far(self, n: cython.Py_ssize_t) -> cython.double:
        """How far (m) a part may go in this tick."""
        v = self._velocity
        fast: cython.double = sqrt(v[n, 0] * v[n, 0] + v[n, 1] * v[n, 1] + v[n, 2] * v[n, 2])
        fast += fabs(v[n, 3]) * (self._reach[n, 0] + self._reach[n, 1])
        return self._tick * fast + max(0.0, self._deep[n])

    @cython.cfunc
    @cython.exceptval(check=False)
    def _carries(self, n: cython.Py_ssize_t, o: cython.Py_ssize_t) -> cython.bint:
        """Whether a part lies on another, or on what lies on that."""
        at: cython.Py_ssize_t = self._on[o]
        while 0 <= at < self._parts:
            if at == n:
                return True
            at = self._on[at]
        return False

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
                if self._velocity[n, i] != 0.0:
                    moves = True
        return moves and (self._met > 0 or self._velocity[self._group[0], 3] != 0.0)

    @cython.cfunc
    @cython.exceptval(check=False)
    def _moves(self, n: cython.Py_ssize_t) -> cython.Py_ssize_t:
        """The number of a body among those that may move; -1 for one that does not."""
        if 0 <= n < self._parts and self._slot[n] >= 0:
            return self._slot[n]
        return -1

    @cython.cfunc
    def _balance(self) -> object:
        """Find the ways."""
        c, t = self._c, self._t
        if self._mine.shape[0] < 2 * self._room:
            self._mine = np.zeros(2 * self._room, dtype=np.intp)
        count: cython.Py_ssize_t = 0
        side: cython.Py_ssize_t
        for k in range(self._many):
            self._first[k] = 0
            for i in range(4):
                t[k, i] = self._tick * self._velocity[self._group[k], i]
        for m in range(self._met):
            c[m, 29] = c[m, 17] * c[m, 15] - c[m, 18] * c[m, 14]
            c[m, 30] = c[m, 19] * c[m, 15] - c[m, 20] * c[m, 14]
            c[m, 21] = 0.0
            for side in range(2):
                k = self._moves(self._i[m, side])
                self._i[m, 4 + side] = k
                if k >= 0:
                    self._first[k] += 1
        for k in range(self._many):
            count += self._first[k]
            self._first[k] = count
        self._first[self._many] = count
        for m in range(self._met - 1, -1, -1):
            for side in range(2):
                k = self._i[m, 4 + side]
                if k >= 0:
                    self._first[k] -= 1
                    self._mine[self._first[k]] = m
        for m in range(self._met):
            out: cython.double = c[m, 10] * c[m, 14] + c[m, 11] * c[m, 15] + c[m, 12] * c[m, 16]
            for i in range(3):
                c[m, 10 + i] -= out * c[m, 14 + i]
        most: cython.double
        for k in range(self._many):
            self._open[k] = 1
        small: cython.double = _SMALLEST if self._many == 1 else _SMALL
        for sweep in range(_STEPS if self._many == 1 else _SWEEPS):
            again: cython.bint = False
            for at in range(self._many):
                k = at if sweep & 1 == 0 else self._many - 1 - at
                if self._open[k]:
                    again = True
                    self._open[k] = 0
                    if self._better(k) > small:
                        self._wake(k)
            if not again:
                break
        for k in range(self._many):
            most = 0.0
            for i in range(3):
                most = max(most, fabs(t[k, i]))
            n = self._group[k]
            most = max(most, fabs(t[k, 3]) * (self._reach[n, 0] + self._reach[n, 1]))
            if most < _STILL:
                for i in range(4):
                    t[k, i] = 0.0
            for i in range(4):
                self._d[k, i] = t[k, i]
        return None

    @cython.cfunc
    @cython.exceptval(check=False)
    def _wake(self, k: cython.Py_ssize_t) -> cython.void:
        """A part goes another way than before: it is looked at again, and so is what it touches."""
        self._open[k] = 1
        for at in range(self._first[k], self._first[k + 1]):
            m = self._mine[at]
            if self._c[m, 21] > 0.0 or self._depth(m) > 0.0 or self._c[m, 13] > 0.0:
                other = self._i[m, 4] if self._i[m, 5] == k else self._i[m, 5]
                if other >= 0:
                    self._open[other] = 1

    @cython.cfunc
    @cython.exceptval(check=False)
    def _better(self, k: cython.Py_ssize_t) -> cython.double:
        """A step of Newton's for one part; how far (m) it goes."""
        t, s, b = self._t, self._s, self._b
        n = self._group[k]
        carried: cython.double = (
            max(0.0, self._below[n, 0] * (self._below[n, 1] - t[k, 2])) + self._below[n, 3]
        )
        self._limit = 0.25 * self._material[n, 1] * carried
        value: cython.double = self._value(k, True)
        self._solve()
        slope: cython.double = 0.0
        size: cython.double = self._reach[n, 0] + self._reach[n, 1]
        far: cython.double = fabs(s[3]) * size
        for i in range(4):
            slope += s[i] * b[i]
            if i < 3:
                far = max(far, fabs(s[i]))
        if far < 0.1 * _SMALLEST or slope >= 0.0:
            return 0.0
        part: cython.double = 1.0
        before_0, before_1, before_2, before_3 = t[k, 0], t[k, 1], t[k, 2], t[k, 3]
        for _try in range(_TRIES):
            t[k, 0], t[k, 1] = before_0 + part * s[0], before_1 + part * s[1]
            t[k, 2], t[k, 3] = before_2 + part * s[2], before_3 + part * s[3]
            if self._value(k, False) <= value + 1e-4 * part * slope:
                return part * far
            part *= 0.5
        t[k, 0], t[k, 1], t[k, 2], t[k, 3] = before_0, before_1, before_2, before_3
        return 0.0

    @cython.cfunc
    @cython.inline
    @cython.exceptval(check=False)
    def _depth(self, m: cython.Py_ssize_t) -> cython.double:
        """Of a place, as a plane, at the ways that are tried."""
        c, t = self._c, self._t
        depth: cython.double = c[m, 13]
        k = self._i[m, 4]
        if k >= 0:
            depth -= c[m, 14] * t[k, 0] + c[m, 15] * t[k, 1] + c[m, 16] * t[k, 2] + c[m, 29] * t[k, 3]
        k = self._i[m, 5]
        if k >= 0:
            depth += c[m, 14] * t[k, 0] + c[m, 15] * t[k, 1] + c[m, 16] * t[k, 2] + c[m, 30] * t[k, 3]
        return depth

    @cython.cfunc
    @cython.exceptval(check=False)
    def _rub(self, m: cython.Py_ssize_t) -> tuple[cython.double, cython.double, cython.double]:
        """How far friction's spring at a place would be wound (m), if it held all, at the ways that are
        tried."""
        c, t = self._c, self._t
        ux: cython.double = 0.0
        uy: cython.double = 0.0
        uz: cython.double = 0.0
        k = self._i[m, 4]
        if k >= 0:
            ux, uy, uz = t[k, 0] - t[k, 3] * c[m, 18], t[k, 1] + t[k, 3] * c[m, 17], t[k, 2]
        k = self._i[m, 5]
        if k >= 0:
            ux -= t[k, 0] - t[k, 3] * c[m, 20]
            uy -= t[k, 1] + t[k, 3] * c[m, 19]
            uz -= t[k, 2]
        nx, ny, nz = c[m, 14], c[m, 15], c[m, 16]
        out = ux * nx + uy * ny + uz * nz
        return c[m, 10] + ux - out * nx, c[m, 11] + uy - out * ny, c[m, 12] + uz - out * nz

    @cython.cfunc
    @cython.exceptval(check=False)
    def _value(self, k: cython.Py_ssize_t, derive: cython.bint) -> cython.double:
        """What shall be least, as far as one part is concerned; with its derivatives there."""
        t, b, h, c, g = self._t, self._b, self._h, self._c, self._points
        n = self._group[k]
        total: cython.double = 0.0
        mass: cython.double
        off: cython.double
        for i in range(4):
            mass = self._mass[n, i] / (self._tick * self._tick)
            off = t[k, i] - self._tick * self._velocity[n, i]
            total += 0.5 * mass * off * off
            if derive:
                b[i] = mass * off
                for j in range(4):
                    h[i, j] = 0.0
                h[i, i] = mass
        stiffness: cython.double = self._below[n, 0]
        total += self._below[n, 2] * t[k, 2]
        depth: cython.double = self._below[n, 1] - t[k, 2]
        if depth > 0.0:
            total += 0.5 * stiffness * depth * depth
        if derive:
            b[2] += self._below[n, 2]
            if depth > 0.0:
                b[2] -= stiffness * depth
                h[2, 2] += stiffness
        # Friction below.
        holding: cython.double = 0.25 * stiffness
        f: cython.double
        p: cython.double
        q: cython.double
        if self._limit > 0.0:
            for j in range(4):
                gx, gy = g[n, 2 * j], g[n, 2 * j + 1]
                x = self._wound[n, 2 * j] + t[k, 0] - t[k, 3] * gy
                y = self._wound[n, 2 * j + 1] + t[k, 1] + t[k, 3] * gx
                length = sqrt(x * x + y * y)
                if holding * length <= self._limit:
                    total += 0.5 * holding * length * length
                    f, p, q = holding, holding, 0.0
                else:
                    total += self._limit * length - 0.5 * self._limit * self._limit / holding
                    f = self._limit / length
                    p, q = f, f / (length * length)
                if derive:
                    b[0] += f * x
                    b[1] += f * y
                    b[3] += f * (gx * y - gy * x)
                    xx, xy, yy = p - q * x * x, -q * x * y, p - q * y * y
                    h[0, 0] += xx
                    h[1, 0] += xy
                    h[1, 1] += yy
                    ax, ay = gx * xy - gy * xx, gx * yy - gy * xy
                    h[3, 0] += ax
                    h[3, 1] += ay
                    h[3, 3] += gx * ay - gy * ax
        # All that presses.
        side: cython.double
        lx: cython.double
        ly: cython.double
        turn: cython.double
        for at in range(self._first[k], self._first[k + 1]):
            m = self._mine[at]
            nx, ny, nz = c[m, 14], c[m, 15], c[m, 16]
            if self._i[m, 4] == k:
                side, lx, ly, turn = -1.0, c[m, 17], c[m, 18], c[m, 29]
            else:
                side, lx, ly, turn = 1.0, c[m, 19], c[m, 20], c[m, 30]
            depth = self._depth(m)
            if depth > 0.0:
                f = c[m, 4] * depth
                total += 0.5 * f * depth
                if derive:
                    f *= side
                    b[0] += f * nx
                    b[1] += f * ny
                    b[2] += f * nz
                    b[3] += f * turn
                    p = c[m, 4]
                    h[0, 0] += p * nx * nx
                    h[1, 0] += p * nx * ny
                    h[1, 1] += p * ny * ny
                    h[2, 0] += p * nx * nz
                    h[2, 1] += p * ny * nz
                    h[2, 2] += p * nz * nz
                    h[3, 0] += p * nx * turn
                    h[3, 1] += p * ny * turn
                    h[3, 2] += p * nz * turn
                    h[3, 3] += p * turn * turn
            if derive:
                c[m, 21] = c[m, 5] * c[m, 4] * depth if depth > 0.0 else 0.0
            limit: cython.double = c[m, 21]
            if limit <= 0.0:
                continue
            holding = c[m, 6]
            x, y, z = self._rub(m)
            length = sqrt(x * x + y * y + z * z)
            if holding * length <= limit:
                total += 0.5 * holding * length * length
                f, p, q = holding, holding, 0.0
            else:
                total += limit * length - 0.5 * limit * limit / holding
                f = limit / length
                p, q = f, f / (length * length)
            if derive:
                w = lx * y - ly * x
                b[0] -= side * f * x
                b[1] -= side * f * y
                b[2] -= side * f * z
                b[3] -= side * f * w
                h[0, 0] += p * (1.0 - nx * nx) - q * x * x
                h[1, 0] += -p * nx * ny - q * x * y
                h[1, 1] += p * (1.0 - ny * ny) - q * y * y
                h[2, 0] += -p * nx * nz - q * x * z
                h[2, 1] += -p * ny * nz - q * y * z
                h[2, 2] += p * (1.0 - nz * nz) - q * z * z
                h[3, 0] += p * (-ly - turn * nx) - q * w * x
                h[3, 1] += p * (lx - turn * ny) - q * w * y
                h[3, 2] += -p * turn * nz - q * w * z
                h[3, 3] += p * (lx * lx + ly * ly - turn * turn) - q * w * w
        return total

    @cython.cfunc
    @cython.exceptval(check=False)
    def _solve(self) -> cython.void:
        """The step of Newton's, by Cholesky's decomposition in place; the inertia makes it definite."""
        h, b, s = self._h, self._b, self._s
        total: cython.double
        for i in range(4):
            for k in range(i + 1):
                total = h[i, k]
                for j in range(k):
                    total -= h[i, j] * h[k, j]
                if i == k:
                    h[i, i] = sqrt(max(total, 1e-300))
                else:
                    h[i, k] = total / h[k, k]
        for i in range(4):
            total = -b[i]
            for j in range(i):
                total -= h[i, j] * s[j]
            s[i] = total / h[i, i]
        for m in range(4):
            i = 3 - m
            total = s[i]
            for j in range(i + 1, 4):
                total -= h[j, i] * s[j]
            s[i] = total / h[i, i]

    @cython.cfunc
    def _go(self, found: Any) -> object:
        """Have all go as far as what is really stored then allows, and tell it."""
        moving: cython.double = 0.0
        share: cython.double = 1.0
        slower: cython.double = 0.0
        for k in range(self._many):
            moving += self._energy(k, 0.0)
        for _half in range(_HALVINGS):
            self._put(share)
            left: cython.double = moving - self._gained(share == 1.0)
            if left >= 0.0:
                fast: cython.double = 0.0
                for k in range(self._many):
                    fast += self._energy(k, share)
                slower = 1.0 if fast <= left else sqrt(left / fast)
                break
            share *= 0.5
        else:
            share = 0.0
            self._put(0.0)
            self._gained(False)
        for m in range(self._met):
            self._keep(m)
        for k in range(self._many):
            self._tell(k, share, slower, found)
        return None

    @cython.cfunc
    @cython.exceptval(check=False)
    def _put(self, share: cython.double) -> cython.void:
        """All are where a share of their way ends."""
        for k in range(self._many):
            for i in range(4):
                self._t[k, i] = share * self._d[k, i]
            self._turn[k, 0], self._turn[k, 1] = cosine(self._t[k, 3]), sine(self._t[k, 3])

    @cython.cfunc
    @cython.exceptval(check=False)
    def _energy(self, k: cython.Py_ssize_t, share: cython.double) -> cython.double:
        """Of motion (J): before, or for a share of the way."""
        n = self._group[k]
        total: cython.double = 0.0
        fast: cython.double
        for i in range(4):
            fast = self._velocity[n, i] if share == 0.0 else share * self._d[k, i] / self._tick
            total += 0.5 * self._mass[n, i] * fast * fast
        return total

    @cython.cfunc
    @cython.exceptval(check=False)
    def _gained(self, winds: cython.bint) -> cython.double:
        """By how much more is stored where all are now than before (J): by height, and in all springs;
        friction only takes. What is stored is noted."""
        total: cython.double = 0.0
        stored: cython.double = 0.0
        c = self._c
        one: cython.double
        two: cython.double
        limit: cython.double
        for k in range(self._many):
            n = self._group[k]
            one = max(0.0, self._below[n, 1])
            two = max(0.0, self._below[n, 1] - self._t[k, 2])
            total += self._below[n, 2] * self._t[k, 2] + 0.5 * self._below[n, 0] * (two * two - one * one)
            one = two = 0.0
            for j in range(4):
                one += self._wound[n, 2 * j] ** 2 + self._wound[n, 2 * j + 1] ** 2
                x, y = self._winds(k, j, winds)
                two += x * x + y * y
            total += 0.125 * self._below[n, 0] * (two - one)
        for m in range(self._met):
            one, two = max(0.0, c[m, 13]), max(0.0, self._touch(m, True))
            total += 0.5 * c[m, 4] * (two * two - one * one)
            stored += 0.5 * c[m, 4] * two * two
            limit = c[m, 5] * c[m, 4] * two
            if limit > 0.0:
                x, y, z = self._rub(m)
                total += _held(c[m, 6], limit, sqrt(x * x + y * y + z * z))
                x, y, z = c[m, 10], c[m, 11], c[m, 12]
                total -= _held(c[m, 6], limit, sqrt(x * x + y * y + z * z))
        self._stored = stored
        return total

    @cython.cfunc
    @cython.exceptval(check=False)
    def _winds(
        self, k: cython.Py_ssize_t, j: cython.Py_ssize_t, winds: cython.bint
    ) -> tuple[cython.double, cython.double]:
        """How far friction's spring at one of the points below a part is wound (m) where that is now."""
        n = self._group[k]
        x: cython.double = self._wound[n, 2 * j]
        y: cython.double = self._wound[n, 2 * j + 1]
        moves: cython.bint = False
        for i in range(4):
            moves = moves or self._t[k, i] != 0.0
        if not winds or not moves:
            return x, y
        x += self._t[k, 0] - self._t[k, 3] * self._points[n, 2 * j + 1]
        y += self._t[k, 1] + self._t[k, 3] * self._points[n, 2 * j]
        carried: cython.double = self._below[n, 0] * max(0.0, self._below[n, 1] - self._t[k, 2])
        most: cython.double = self._material[n, 1] * (carried + self._below[n, 3]) / self._below[n, 0]
        length = sqrt(x * x + y * y)
        if length > most:
            x, y = x * most / length, y * most / length
        return x, y

    @cython.cfunc
    def _keep(self, m: cython.Py_ssize_t) -> object:
        """Remember a place as it is where all are now."""
        if self._k[m] == -2:
            return None
        c = self._c
        longest: cython.double = c[m, 5] * c[m, 4] * max(0.0, c[m, 28]) / c[m, 6]
        x, y, z = self._rub(m)
        length = sqrt(x * x + y * y + z * z)
        share: cython.double = 1.0 if length <= longest else longest / length
        c[m, 10], c[m, 11], c[m, 12] = share * x, share * y, share * z
        self._stored += 0.5 * c[m, 6] * (c[m, 10] ** 2 + c[m, 11] ** 2 + c[m, 12] ** 2)
        self._remember(m, _NEAR)
        return None

    @cython.cfunc
    def _tell(self, k: cython.Py_ssize_t, share: cython.double, slower: cython.double, found: Any) -> object:
        """Note how a part ends, unless it stays at rest as it is."""
        n = self._group[k]
        t = self._t
        way = (t[k, 0], t[k, 1], t[k, 2], t[k, 3])
        moved: cython.bint = any(way)
        if k == 0:
            self.stored_j += self._stored
        if not moved and not self._rubs[n]:
            resting: cython.bint = True
            for i in range(4):
                resting = resting and self._velocity[n, i] == 0.0
            if resting:
                return None
        per: cython.double = slower / self._tick
        velocity = (per * way[0], per * way[1], per * way[2], per * way[3])
        wound = []
        for j in range(4):
            x, y = self._winds(k, j, share == 1.0)
            wound += [x, y]
        pressed: cython.bint = False
        for at in range(self._first[k], self._first[k + 1]):
            pressed = pressed or self._c[self._mine[at], 28] > 0.0
        found.append(Gone(n, way, velocity, tuple(wound), bool(pressed)))
        return None

    def on_held(self) -> tuple[Vector, Vector]:
        """What places of parts that have been looked at, or pushed, in this tick do to the held part, where
        they are now: force (N), and torque (Nm) about its middle, in the base."""
        force = [0.0] * 3
        torque = [0.0] * 3
        if self._held < 0:
            return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        c = self._c
        for n in range(self._parts):
            if not self._lies[n] or self._apart(n, self._held) >= 0.0:
                continue
            balls, self._balls = self._balls, {}
            self._met = 0
            self._of_the_arm(n)
            self._balls = balls
            for m in range(self._met):
                f: cython.double = c[m, 4] * c[m, 13]
                if f <= 0.0:
                    continue
                fx, fy, fz = -f * c[m, 14], -f * c[m, 15], -f * c[m, 16]
                x, y, z = c[m, 25], c[m, 26], c[m, 27]
                for i, each in enumerate((fx, fy, fz)):
                    force[i] += each
                for i, each in enumerate((y * fz - z * fy, z * fx - x * fz, x * fy - y * fx)):
                    torque[i] += each
        return (force[0], force[1], force[2]), (torque[0], torque[1], torque[2])


@cython.cfunc
@cython.exceptval(check=False)
def _held(holding: cython.double, limit: cython.double, length: cython.double) -> cython.double:
    """What friction's spring stores, and takes where it slips (J)."""
    if holding * length <= limit:
        return 0.5 * holding * length * length
    return limit * length - 0.5 * limit * limit / holding

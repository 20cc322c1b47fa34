"""An arm beside parts that lie: what of it is near them, how far it has gone, and how far it is from them."""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import cython
import numpy as np
from cython.cimports.libc.math import sqrt

from iiwa_sim.contact.ways_in_kernel import NOT_IN
from iiwa_sim.contact.worn import PARTS
from iiwa_sim.frames import Vector

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.link_forces_kernel import LinkForces
else:
    from iiwa_sim.contact.link_forces_kernel import LinkForces

NEAR_M = 0.02
"""Distance (m) beyond which only a bound of it is found for a pair of link and part."""
_NEAR_M = cython.declare(cython.double, NEAR_M)
_TOUCHES_M = cython.declare(cython.double, 1e-3)  # who asks whether a part may be touched needs no more
_PARTS = cython.declare(cython.int, PARTS)


class Ball(NamedTuple):
    """Ball of a link, or of what the arm wears, that is nearest to a part."""

    middle: Vector
    """m, in the base"""
    radius: float
    """m"""
    rubbed: Vector
    """How far (m, in the base) it has gone with the part, as far as friction holds that; along it counts."""
    share: float
    """What it feels of the part's stiffness."""
    came: Vector
    """By which way it has come into the part, as `ways_in_kernel` remembers it."""
    was_deep: float
    """m, a tick ago"""
    went: Vector
    """How far (m, in the base) its point next to the part has gone since then, as seen from there."""
    link: int
    """Its number, each thing that is worn for itself."""
    unpressed: float
    """How deep (m) it is in without pressing."""
    rubs: bool
    """Whether friction is felt: not in the tick in which it comes to touch."""
    start: Vector
    """Where the line begins on which it may be (m, in the base), and the way from there to the other end."""
    line: Vector


@cython.cclass
class LinksBeside(LinkForces):
    """The links of an arm, and what it wears, as parts that lie beside it see them."""

    @cython.cfunc
    @cython.exceptval(-1.0, check=True)
    def _carry(self, n: cython.Py_ssize_t, start: Any, end: Any) -> cython.double:
        """A capsule that is worn has its ends there in the flange now (m); gives how far it has moved (m).
        Its levers are then no longer than when it was put on, and how far it has been from there."""
        x: cython.double
        y: cython.double
        z: cython.double
        place: cython.double
        square: cython.double
        from_there: cython.double
        row: cython.Py_ssize_t
        moved: cython.double = 0.0
        off: cython.double = 0.0
        f, local = self._fixed, self._local
        flange: cython.Py_ssize_t = self._count
        for j in range(0, 6, 3):
            x, y, z = end if j else start
            square = from_there = 0.0
            for i in range(j, j + 3):
                row = 3 * (i - j)
                place = f[flange, 9 + i - j] + (
                    f[flange, row] * x + f[flange, row + 1] * y + f[flange, row + 2] * z
                )
                square += (place - local[n, i]) * (place - local[n, i])
                from_there += (place - self._put_on[n, i]) * (place - self._put_on[n, i])
                local[n, i] = place
            moved, off = max(moved, sqrt(square)), max(off, sqrt(from_there))
        self._is_there = False
        for k in range(self._count):
            self._levers[k] = max(self._levers[k], self._put_on_levers[k] + off)
        return moved

    @cython.cfunc
    def _speeds(self, joints: Any, tick_s: cython.double) -> object:
        """Velocities of the joints (rad/s) since the last tick."""
        if tick_s <= 0.0:
            return [0.0] * self._count
        return [(joints[k] - self._before[k]) / tick_s for k in range(self._count)]

    def balls(self, name: str, joints: Sequence[float], tick_s: float, near_m: float) -> list[Ball]:
        """What of the arm, at joint positions (rad), is no farther than this from a part that lies."""
        s: cython.Py_ssize_t = self._numbers[name]
        found: list[Ball] = []
        self.go_to(joints)
        if self._muted[s]:
            return found
        known: cython.bint = self._before[0] == self._before[0]
        speeds = self._speeds(joints, tick_s if known else 0.0)
        nearest: cython.double = 1e9
        where: cython.double = 0.0
        which: cython.Py_ssize_t = 0
        e, r = self._ends, self._rubbed
        for c in range(self._capsule_count):
            if self._feels_now(c, s):
                self._recall(c, s)
                gap, part = self.gap(c, s, max(0.0, min(nearest, near_m)))
                if gap < near_m:
                    part = self.middle(c, s, part)
                self._remember(c, s, gap, part)
                if gap < nearest:
                    nearest, where, which = gap, part, c
            if c + 1 == self._capsule_count or self._link[c + 1] != self._link[c]:
                if nearest < near_m:
                    x = e[which, 0] + where * (e[which, 3] - e[which, 0])
                    y = e[which, 1] + where * (e[which, 4] - e[which, 1])
                    z = e[which, 2] + where * (e[which, 5] - e[which, 2])
                    self._recall(which, s)
                    self.distance(s, x, y, z)
                    nx, ny, nz = self._nx, self._ny, self._nz
                    radius = self._radius[which]
                    rubbed = (0.0, 0.0, 0.0)
                    link = self._link[which]
                    wx, wy, wz = self._gone(
                        which, s, x - radius * nx, y - radius * ny, z - radius * nz, speeds, tick_s
                    )
                    went = (wx, wy, wz)
                    touches: cython.bint = self._touches[link, s] != 0
                    if touches:
                        rubbed = (r[link, s, 0] + wx, r[link, s, 1] + wy, r[link, s, 2] + wz)
                    came = (self._ox, self._oy, self._oz) if nearest < 0.0 else NOT_IN
                    start = (e[which, 0], e[which, 1], e[which, 2])
                    line = (e[which, 3] - start[0], e[which, 4] - start[1], e[which, 5] - start[2])
                    place = (x, y, z), radius, rubbed, self._share[which], came
                    spare = min(self._unpressed[link, s], max(0.0, -nearest))
                    found.append(Ball(*place, self._depth[link, s], went, link, spare, touches, start, line))
                nearest = 1e9
        return found

    def goes(self, joints: Sequence[float]) -> float:
        """No point of the arm, now at joint positions (rad), nor of what it wears, has gone farther (m) since
        this was asked last; 0 where it never was."""
        return float(self.gone(joints))

    @cython.cfunc
    @cython.exceptval(-1.0, check=True)
    def gone(self, joints: Any) -> cython.double:
        """`goes` for kernels."""
        self.go_to(joints)
        return self._since(self._ends_before)

    @cython.cfunc
    @cython.exceptval(check=False)
    def _since(self, before: cython.double[:, ::1]) -> cython.double:
        """No point of the arm is farther (m) from where it was with the ends of capsules there; those of now
        are put there."""
        e, b = self._ends, before
        most: cython.double = 0.0
        for c in range(self._capsule_count):
            for j in range(0, 6, 3):
                dx, dy, dz = e[c, j] - b[c, j], e[c, j + 1] - b[c, j + 1], e[c, j + 2] - b[c, j + 2]
                most = max(most, dx * dx + dy * dy + dz * dz)
                for i in range(3):
                    b[c, j + i] = e[c, j + i]
        return sqrt(most)

    @cython.cfunc
    @cython.exceptval(-1.0, check=True)
    def gap_at(self, s: cython.Py_ssize_t) -> cython.double:
        """How far (m) the arm, where `goes` was told that it is, is at least from the part of that number,
        less than 0 in it; at most 0 where it stands in that without being pushed out, until it has been
        out."""
        least: cython.double = 1e9
        enough: cython.double
        if self._muted[s]:
            return 0.0
        e, m = self._ends, self._came
        for c in range(self._capsule_count):
            if self._can_feel(c, s):
                enough = min(least, _TOUCHES_M)
                if m[c, s, 0] == 0.0 and m[c, s, 1] == 0.0 and m[c, s, 2] == 0.0:  # as most are: first
                    ax, ay, az = e[c, 0], e[c, 1], e[c, 2]
                    dx, dy, dz = e[c, 3] - ax, e[c, 4] - ay, e[c, 5] - az
                    square = dx * dx + dy * dy + dz * dz
                    gap = self._at_least(s, ax, ay, az, dx, dy, dz, square) - self._radius[c]
                    if gap > enough:
                        least = min(least, gap)
                        continue
                self._recall(c, s)
                gap, _part = self.gap(c, s, enough)
                least = min(least, gap)
        return least

    def away(self, middle: Vector, joints: Sequence[float]) -> float:
        """How far (m) the nearest capsule of the arm, at joint positions (rad), is from a place in the base;
        the base of the arm does not count."""
        self.go_to(joints)
        least: cython.double = 1e9
        px: cython.double
        py: cython.double
        pz: cython.double
        ax: cython.double
        ay: cython.double
        az: cython.double
        px, py, pz = middle
        e = self._ends
        for c in range(self._capsule_count):
            if self._moved_by[c] == 0 or self._feels[c] < _PARTS:
                continue
            ax, ay, az = e[c, 0] - px, e[c, 1] - py, e[c, 2] - pz
            dx, dy, dz = e[c, 3] - e[c, 0], e[c, 4] - e[c, 1], e[c, 5] - e[c, 2]
            square = dx * dx + dy * dy + dz * dz
            part: cython.double = 0.0
            if square > 0.0:
                part = min(max(-(ax * dx + ay * dy + az * dz) / square, 0.0), 1.0)
            ax, ay, az = ax + part * dx, ay + part * dy, az + part * dz
            least = min(least, sqrt(ax * ax + ay * ay + az * az) - self._radius[c])
        return float(least)

    @cython.cfunc
    def _bring(self, was: cython.Py_ssize_t[::1], remembered: Any) -> object:
        """Remember of each surface what was remembered of the one of that number; -1 for a new one."""
        muted: cython.char[:, ::1]
        came: cython.double[:, :, ::1]
        pushing: cython.double[:, ::1]
        depth: cython.double[:, ::1]
        touches: cython.char[:, ::1]
        rubbed: cython.double[:, :, ::1]
        dragging: cython.double[:, :, ::1]
        deaf: cython.char[:, ::1]
        unpressed: cython.double[:, ::1]
        muted, came, pushing, depth, touches, rubbed, dragging, deaf, unpressed = remembered
        o: cython.Py_ssize_t
        capsules: cython.Py_ssize_t = min(came.shape[0], self._came.shape[0])  # fewer or more than before
        links: cython.Py_ssize_t = min(depth.shape[0], self._depth.shape[0])
        for s in range(was.shape[0]):
            o = was[s]
            if o < 0:
                continue
            self._muted[s] = muted[0, o]
            for c in range(capsules):
                self._deaf[c, s] = deaf[c, o]
                for k in range(3):
                    self._came[c, s, k] = came[c, o, k]
            for m in range(links):
                self._pushing[m, s], self._depth[m, s] = pushing[m, o], depth[m, o]
                self._touches[m, s], self._unpressed[m, s] = touches[m, o], unpressed[m, o]
                for k in range(3):
                    self._rubbed[m, s, k] = rubbed[m, o, k]
                    self._dragging[m, s, k] = dragging[m, o, k]
        return None

    @cython.cfunc
    def _remembered(self) -> object:
        """All that is remembered of surfaces, as arrays: the second index is that of the surface."""
        muted: Any = np.asarray(self._muted)
        return (
            muted[np.newaxis],
            np.asarray(self._came),
            np.asarray(self._pushing),
            np.asarray(self._depth),
            np.asarray(self._touches),
            np.asarray(self._rubbed),
            np.asarray(self._dragging),
            np.asarray(self._deaf),
            np.asarray(self._unpressed),
        )

    @cython.cfunc
    def _is_out(self, s: cython.Py_ssize_t, base_m: cython.double) -> cython.bint:
        """Whether no link is in a surface, and the base not deeper than so."""
        for c in range(self._capsule_count):
            if self._moved_by[c] > 0 and not self._feels_now(c, s):
                continue
            self._recall(c, s)
            if self.gap(c, s, _NEAR_M)[0] < (-base_m if self._moved_by[c] == 0 else 0.0):
                return False
        return True

"""The surfaces near a part that is held, as it feels them, and how far away they are."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from typing import Any

import cython
import numpy as np
from cython.cimports.libc.math import sqrt

from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.ways_in_kernel import KINDS
from iiwa_sim.handling.part import Part
from iiwa_sim.handling.points import points_of

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.contact_kernel import Contact
    from cython.cimports.iiwa_sim.contact.ways_in_kernel import nearest
    from cython.cimports.iiwa_sim.contact.world_kernel import World
    from cython.cimports.iiwa_sim.handling.over_kernel import Over
else:
    from iiwa_sim.contact.contact_kernel import Contact
    from iiwa_sim.contact.ways_in_kernel import nearest
    from iiwa_sim.contact.world_kernel import World
    from iiwa_sim.handling.over_kernel import Over

NEAR_M = 0.02
"""Surfaces farther away are not looked at until the part has come so far."""
_NEAR = cython.declare(cython.double, NEAR_M)
# Of surfaces farther away than this (m) it is not asked how far which point is.
_FAR = cython.declare(cython.double, 0.02)
# Points that are twice as far from all of them (m), and are pushed by none, come to them as if for the first
# time.
_CLOSE = cython.declare(cython.double, 0.005)


@cython.cclass
class Near:
    """What is near one part, and the points at which it touches that; the attributes are declared in the
    .pxd."""

    def __init__(self, part: Part, upright: bool) -> None:
        """Nothing is; a cylinder that is `upright` touches with its rims."""
        self._part = part
        self.points = points_of(part, upright)
        self._own = np.array(self.points.places)
        self._radius = self.points.radius_m
        self._extent = part.shape.extent
        self._looked = np.zeros(3)
        self._has_looked = False
        self._near: dict[str, Surface] = {}
        self.worlds: dict[int, World] = {}
        self._all: Any = None
        self._found: dict[str, Surface] = {}
        self._over, self._is_over = Over(self._own, KINDS[type(part.shape)], part.shape), False
        self._measured = np.zeros(12)
        self._has_measured, self._known = False, 0.0
        self._has_been: Any = np.zeros(len(self._own), dtype=np.int8)
        self._take_near({})

    @cython.cfunc
    @cython.exceptval(-1, check=True)
    def _look(self, x: cython.double, y: cython.double, z: cython.double, surfaces: Any) -> cython.bint:
        """Find the surfaces that may be touched before it has gone `NEAR_M` from there: whether they are
        others than before."""
        self._looked[0], self._looked[1], self._looked[2] = x, y, z
        self._has_looked = True
        if surfaces is not self._all:
            self._see(surfaces)
        reach: cython.double = self._extent + 2.0 * _NEAR
        part, at_once, r = self._part, self.points.at_once, self._all_shapes
        pushing = {name for world in self.worlds.values() for name in world.pushing()}
        near, found, rows = {}, {}, []
        for s in range(self._all_kinds.shape[0]):
            px, py, pz = x - r[s, 9], y - r[s, 10], z - r[s, 11]
            far: cython.bint = sqrt(px * px + py * py + pz * pz) - self._extents[s] > reach
            far = far or away_from(r, self._all_kinds, s, x, y, z) > reach
            if far and not (pushing and surfaces[s].name in pushing):
                continue
            each = surfaces[s]
            name = each.name
            same: cython.bint = each is self._found.get(name) and name in self._near
            found[name] = each
            rows.append(s)
            if same:
                near[name] = self._near[name]
                continue
            stiffness = 1.0 / (1.0 / each.stiffness + 1.0 / part.stiffness) / at_once
            near[name] = each._replace(stiffness=stiffness, friction=part.friction)
        self._found = found
        if near == self._near:
            return False
        if self.worlds:
            self._change(near)
        self._near = near
        self._shapes, self._kinds = np.asarray(r)[rows], np.asarray(self._all_kinds)[rows]
        return True

    @cython.cfunc
    def _change(self, after: Any) -> object:
        """Other surfaces are near; points that were near those before remember what they do."""
        before = self._near
        gone = [name for name in before if name not in after]
        for name, now in after.items():
            was = before.get(name)
            if now is was:
                continue
            new: cython.bint = was is None or now != was._replace(pose=now.pose)
            for world in self.worlds.values():
                if new:
                    world.put(now)
                else:
                    world.take(now)
        for name in gone:
            for world in self.worlds.values():
                world.remove(name)
        return None

    @cython.cfunc
    def _see(self, surfaces: Any) -> object:
        """Take the numbers of all surfaces; of those that are the same as before they are there."""
        before, self._all = self._all, surfaces
        if before is None or len(before) != len(surfaces):
            self._all_shapes, self._all_kinds = _numbers_of(surfaces)
            self._extents = np.array([each.shape.extent for each in surfaces])
            return None
        for s in range(self._all_kinds.shape[0]):
            each = surfaces[s]
            if each is before[s]:
                continue
            for k, number in enumerate(_row(each)):
                self._all_shapes[s, k] = number
            self._all_kinds[s], self._extents[s] = KINDS[type(each.shape)], each.shape.extent
        return None

    @cython.cfunc
    def _measure(self, pose: cython.double[::1]) -> object:
        """Find which points are close to surfaces, and how far the others may go before that changes."""
        count: cython.Py_ssize_t = len(self._near)
        n: cython.Py_ssize_t
        s: cython.Py_ssize_t
        least: cython.double
        away: cython.double
        for k in range(12):
            self._measured[k] = pose[k]
        self._has_measured = True
        p, own, radius = pose, self._own, self._radius
        close: list[int] = []
        others: cython.double = 1e9
        for s in range(count):
            least = away_from(self._shapes, self._kinds, s, p[9], p[10], p[11]) - self._extent
            if least <= radius + _FAR:
                close.append(s)
            else:
                others = min(others, least)
        if len(close) == count:
            others = radius + 2.0 * _NEAR
        known: cython.double = _NEAR
        away = self._over.least_gap(p, self._shapes, self._kinds) if radius == 0.0 else 1e9
        if self._is_over and away > 2.0 * _CLOSE:
            self._stand()
        self._is_over = away <= 2.0 * _CLOSE
        known = min(known, _CLOSE if self._is_over else away - _CLOSE)
        for n in range(own.shape[0]):
            x: cython.double = (p[0] * own[n, 0] + p[1] * own[n, 1] + p[2] * own[n, 2]) + p[9]
            y: cython.double = (p[3] * own[n, 0] + p[4] * own[n, 1] + p[5] * own[n, 2]) + p[10]
            z: cython.double = (p[6] * own[n, 0] + p[7] * own[n, 1] + p[8] * own[n, 2]) + p[11]
            away = others
            for s in close:
                away = min(away, away_from(self._shapes, self._kinds, s, x, y, z))
            away -= radius
            world = self.worlds.get(n)
            presses: cython.bint = self._is_over and self._over.is_low(n)
            presses = presses or (world is not None and world.pushing())
            if away > 2.0 * _CLOSE and not presses:
                known = min(known, away - _CLOSE)
                self.worlds.pop(n, None)
                self._has_been[n] = 0
            else:
                known = min(known, _CLOSE)
                if world is None:
                    self.worlds[n] = World(self._near.values(), radius)
        self._known = known
        return None

    @cython.cfunc
    def _stand(self) -> object:
        """Have no point press beside where it is any more."""
        world: World
        contact: Contact
        for world in self.worlds.values():
            for contact in world._all:
                contact.lean(False, 0.0, 0.0)
        return None

    @cython.cfunc
    def _take_near(self, near: Any) -> object:
        """Set the surfaces that are near."""
        self._near = near
        self._shapes, self._kinds = _numbers_of(near.values())
        return None


@cython.cfunc
def _row(surface: Any) -> object:
    return (*surface.pose[0], *surface.pose[1], *(*surface.shape, 0.0, 0.0, 0.0)[:3])


@cython.cfunc
def _numbers_of(surfaces: Any) -> object:
    """Rows of surfaces (rotation, place, three sizes), and their kinds."""
    rows = [_row(each) for each in surfaces]
    kinds = np.array([KINDS[type(each.shape)] for each in surfaces], dtype=np.intc)
    return np.array(rows).reshape(len(rows), 15), kinds


@cython.cfunc
@cython.exceptval(check=False)
def away_from(
    shapes: cython.double[:, ::1],
    kinds: cython.int[::1],
    s: cython.Py_ssize_t,
    x: cython.double,
    y: cython.double,
    z: cython.double,
) -> cython.double:
    """How far (m) a place is from one of these shapes, less than 0 in it."""
    r = shapes
    x, y, z = x - r[s, 9], y - r[s, 10], z - r[s, 11]
    distance, _nx, _ny, _nz = nearest(
        kinds[s],
        r[s, 12],
        r[s, 13],
        r[s, 14],
        r[s, 0] * x + r[s, 3] * y + r[s, 6] * z,
        r[s, 1] * x + r[s, 4] * y + r[s, 7] * z,
        r[s, 2] * x + r[s, 5] * y + r[s, 8] * z,
    )
    return distance

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
    from cython.cimports.iiwa_sim.contact.ways_in_kernel import nearest
    from cython.cimports.iiwa_sim.contact.world_kernel import World
else:
    from iiwa_sim.contact.ways_in_kernel import nearest
    from iiwa_sim.contact.world_kernel import World

NEAR_M = 0.05
"""Surfaces farther away are not looked at until the part has come so far."""
_NEAR = cython.declare(cython.double, NEAR_M)


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
                    world.move(name, now.pose)
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

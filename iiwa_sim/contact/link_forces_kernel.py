"""What a surface does to one link that touches it, or to one tool or jaw.

**What a link feels.** A surface pushes the point of a link that is deepest in it with its stiffness times the
depth, damped as at the TCP; that makes torques on the joints that move the link. What tools and jaws feel
makes a wrench at the TCP.

**Ways in.** It is pushed out the way it has come in, however deep it is pressed, until it is out again, or
beside what it has come in by: more is said in `ways_in_kernel`.

**A robot that yields** gives way to the same forces, but for what keeps it calm at any tick: the force is the
one that the surface will have at the end of the next tick, if the link has the least mass that it can have
there, and if what else pushes it goes on as it has on the average of the last ticks. At rest it is the same.

What rubs along the surface is found in `link_friction_kernel`.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import cython
import numpy as np

from iiwa_sim.contact.link_friction_kernel import FOLLOWS, LEAST_INERTIA_KGM2, STIFFEST_N_PER_M
from iiwa_sim.frames import Vector

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.link_friction_kernel import LinkFriction
else:
    from iiwa_sim.contact.link_friction_kernel import LinkFriction

_LEAST_INERTIA = cython.declare(cython.double, LEAST_INERTIA_KGM2)
_FOLLOWS = cython.declare(cython.double, FOLLOWS)
_STIFFEST = cython.declare(cython.double, STIFFEST_N_PER_M)
# A smaller average (N) of a link that touches nothing is none.
_LEAST_PUSH_N = cython.declare(cython.double, 1e-3)


class LinkContact(NamedTuple):
    """A link, a tool or a jaw that touches a surface or a part."""

    link: str
    surface: str
    point: Vector
    """Point of the link at which the surface acts (m, in the base)."""
    force: Vector
    """N, in the base, acting on the robot."""


@cython.cclass
class LinkForces(LinkFriction):
    """The capsules of one arm, and the forces between them and what they touch; the arrays are declared in
    the .pxd."""

    def part_all(self, link_count: int, laws: Sequence[tuple[float, float, float]]) -> None:
        """Nothing touches: so many links, and each tool and jaw for itself, and surfaces by their stiffness
        (N/m), damping (s/m) and friction."""
        least = max(len(laws), 1)
        self._law: Any = np.array(laws).reshape(len(laws), 3)
        self._pushing: Any = np.zeros((link_count, least))
        self._depth: Any = np.zeros((link_count, least))
        self._touches: Any = np.zeros((link_count, least), dtype=np.int8)
        self._rubbed: Any = np.zeros((link_count, least, 3))
        self._dragging: Any = np.zeros((link_count, least, 3))
        self._came: Any = np.zeros((self._capsule_count, least, 3))

    @cython.cfunc
    @cython.exceptval(check=False)
    def _recall(self, c: cython.Py_ssize_t, s: cython.Py_ssize_t) -> cython.void:
        """Have `gap` and `distance` be those of a capsule that has come into a surface by the way
        that is remembered, from now on."""
        m = self._came
        self._mx, self._my, self._mz = m[c, s, 0], m[c, s, 1], m[c, s, 2]
        self._around = self._radius[c]

    @cython.cfunc
    @cython.exceptval(check=False)
    def _remember(
        self, c: cython.Py_ssize_t, s: cython.Py_ssize_t, gap: cython.double, part: cython.double
    ) -> cython.void:
        """Note by which way a capsule is in a surface, so far from it (m) at a part of its line; none where
        it is out of it."""
        m, e = self._came, self._ends
        if gap >= 0.0:
            m[c, s, 0] = m[c, s, 1] = m[c, s, 2] = 0.0
            return
        self.distance(
            s,
            e[c, 0] + part * (e[c, 3] - e[c, 0]),
            e[c, 1] + part * (e[c, 4] - e[c, 1]),
            e[c, 2] + part * (e[c, 5] - e[c, 2]),
        )
        m[c, s, 0], m[c, s, 1], m[c, s, 2] = self._ox, self._oy, self._oz

    @cython.cfunc
    def _press(
        self,
        c: cython.Py_ssize_t,
        s: cython.Py_ssize_t,
        part: cython.double,
        depth: cython.double,
        speeds: Any,
        tick_s: cython.double,
        torques: Any,
        pushing: Any,
        worn: Any,
    ) -> object:
        """Add what a surface does to a capsule that is so deep (m) in it, at a part of its line.

        Less than 0 is for one that is out of it since a robot that yields has been pushed by it.
        """
        e = self._ends
        x = e[c, 0] + part * (e[c, 3] - e[c, 0])
        y = e[c, 1] + part * (e[c, 4] - e[c, 1])
        z = e[c, 2] + part * (e[c, 5] - e[c, 2])
        self._recall(c, s)
        self.distance(s, x, y, z)
        nx, ny, nz = self._nx, self._ny, self._nz
        radius = self._radius[c]
        x, y, z = x - radius * nx, y - radius * ny, z - radius * nz
        levers = []
        speed: cython.double = 0.0
        square: cython.double = 0.0
        lever: cython.double
        moves: cython.bint = any(speeds)
        a, p = self._axes, self._points
        for k in range(self._moved_by[c]):
            dx, dy, dz = x - p[k, 0], y - p[k, 1], z - p[k, 2]
            lever = (
                nx * (a[k, 1] * dz - a[k, 2] * dy)
                + ny * (a[k, 2] * dx - a[k, 0] * dz)
                + nz * (a[k, 0] * dy - a[k, 1] * dx)
            )
            levers.append(lever)
            square += lever * lever
            speed += lever * cython.cast(cython.double, speeds[k])
        stiffness: cython.double = self._share[c] * self._law[s, 0]
        damped: cython.double = 1.0 - self._law[s, 1] * speed
        force: cython.double = stiffness * depth * damped if depth > 0.0 and damped > 0.0 else 0.0
        # Of all contacts together no mode is stiffer than the sum of them.
        per_kg: cython.double = max(1, len(self.contacts)) * square / _LEAST_INERTIA
        stiff: cython.double = stiffness * tick_s * tick_s * per_kg
        link = self._link[c]
        self._depth[link, s] = max(depth, 0.0)
        push: cython.double = stiffness * (depth - tick_s * speed) + stiff * self._pushing[link, s]
        push = max(push, 0.0) / (1.0 + stiff)
        if moves:
            self._pushing[link, s] += _FOLLOWS * (push - self._pushing[link, s])
            if depth <= 0.0 and push == 0.0 and self._pushing[link, s] < _LEAST_PUSH_N:
                self._pushing[link, s] = 0.0
        else:
            self._pushing[link, s] = push = force
        fx, fy, fz = force * nx, force * ny, force * nz
        # A robot that yields is pushed by g.
        gx, gy, gz = push * nx, push * ny, push * nz
        rubs: cython.bint = self._law[s, 2] > 0.0 and force > 0.0
        if rubs:
            wx, wy, wz = self._gone(c, x, y, z, speeds, tick_s)
            self._rub(c, s, wx, wy, wz, force)
            r = self._rubbed
            along: cython.double = min(stiffness, self._share[c] * _STIFFEST)
            rx: cython.double = -along * r[link, s, 0]
            ry: cython.double = -along * r[link, s, 1]
            rz: cython.double = -along * r[link, s, 2]
            fx, fy, fz = fx + rx, fy + ry, fz + rz
            if moves:
                rx, ry, rz = self._drag(c, s, (x, y, z), (wx, wy, wz), tick_s, push)
            else:
                self._dragging[link, s, 0] = rx
                self._dragging[link, s, 1] = ry
                self._dragging[link, s, 2] = rz
            gx, gy, gz = gx + rx, gy + ry, gz + rz
        else:
            self._touches[link, s] = 0
        for k in range(self._moved_by[c]):
            if rubs:
                dx, dy, dz = x - p[k, 0], y - p[k, 1], z - p[k, 2]
                lx = a[k, 1] * dz - a[k, 2] * dy
                ly = a[k, 2] * dx - a[k, 0] * dz
                lz = a[k, 0] * dy - a[k, 1] * dx
                pushing[k] += gx * lx + gy * ly + gz * lz
                lever = fx * lx + fy * ly + fz * lz
            else:
                lever = levers[k]
                pushing[k] += lever * push
                lever = lever * force
            if link < self._own_count:
                torques[k] += lever
        if link >= self._own_count:
            whole = (fx, fy, fz, y * fz - z * fy, z * fx - x * fz, x * fy - y * fx)
            for i in range(6):
                worn[i] += whole[i]
        return LinkContact(self._capsules[c].link, self._names[s], (x, y, z), (fx, fy, fz))

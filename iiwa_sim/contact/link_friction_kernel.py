"""Friction between one link and a surface that it touches.

What a link has gone along the surface winds a spring, whose force is at most the friction times the normal
force; what is beyond that is lost. It is unwound by going back, and gone where the link leaves the surface.
It is as stiff as the surface, up to `STIFFEST_N_PER_M`. A robot that yields gives way to the force that the
spring will have at the end of the next tick, as `link_forces_kernel` says of what presses.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

from typing import Any

import cython
from cython.cimports.libc.math import sqrt

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.capsules_kernel import Capsules
else:
    from iiwa_sim.contact.capsules_kernel import Capsules

# No arm that yields has a smaller moment of inertia about a joint (kg m^2), but near singular poses: as
# `motion/springs.py` has it; a held one has more.
LEAST_INERTIA_KGM2 = 0.2
_LEAST_INERTIA = cython.declare(cython.double, LEAST_INERTIA_KGM2)
# Part by which the average of a push follows it in a tick.
FOLLOWS = 0.1
_FOLLOWS = cython.declare(cython.double, FOLLOWS)
# Friction's spring on a link is no stiffer (N/m): a robot that yields would swing on it.
STIFFEST_N_PER_M = 5e3
_STIFFEST = cython.declare(cython.double, STIFFEST_N_PER_M)


@cython.cclass
class LinkFriction(Capsules):
    """The capsules of one arm, and what rubs on them; the arrays are declared in the .pxd."""

    @cython.cfunc
    def _rub(
        self,
        c: cython.Py_ssize_t,
        s: cython.Py_ssize_t,
        wx: cython.double,
        wy: cython.double,
        wz: cython.double,
        normal_n: cython.double,
    ) -> object:
        """Wind the spring of friction of a capsule that touches a surface, and has gone so far (m); which way
        is out is in n."""
        r = self._rubbed
        link = self._link[c]
        if not self._touches[link, s]:
            self._touches[link, s] = 1
            r[link, s, 0] = r[link, s, 1] = r[link, s, 2] = 0.0
            d = self._dragging
            d[link, s, 0] = d[link, s, 1] = d[link, s, 2] = 0.0
            return None
        ex: cython.double
        ey: cython.double
        ez: cython.double
        nx, ny, nz = self._nx, self._ny, self._nz
        ex, ey, ez = r[link, s, 0] + wx, r[link, s, 1] + wy, r[link, s, 2] + wz
        out = ex * nx + ey * ny + ez * nz
        ex, ey, ez = ex - out * nx, ey - out * ny, ez - out * nz
        length = sqrt(ex * ex + ey * ey + ez * ez)
        holding: cython.double = self._share[c] * min(self._law[s, 0], _STIFFEST)
        longest: cython.double = self._law[s, 2] * normal_n / holding
        if length > longest:
            share = longest / length
            ex, ey, ez = share * ex, share * ey, share * ez
        r[link, s, 0], r[link, s, 1], r[link, s, 2] = ex, ey, ez
        return None

    @cython.cfunc
    def _drag(
        self,
        c: cython.Py_ssize_t,
        s: cython.Py_ssize_t,
        place: tuple[cython.double, cython.double, cython.double],
        gone: tuple[cython.double, cython.double, cython.double],
        tick_s: cython.double,
        push_n: cython.double,
    ) -> tuple[cython.double, cython.double, cython.double]:
        """Friction (N) as a robot that yields gives way to it at a place (m), as far as that has gone (m);
        found as its normal force is."""
        wx: cython.double
        wy: cython.double
        wz: cython.double
        x, y, z = place
        wx, wy, wz = gone
        a, p, r, d = self._axes, self._points, self._rubbed, self._dragging
        link = self._link[c]
        stiffness: cython.double = self._share[c] * min(self._law[s, 0], _STIFFEST)
        square: cython.double = 0.0
        for k in range(self._moved_by[c]):
            dx, dy, dz = x - p[k, 0], y - p[k, 1], z - p[k, 2]
            lx = a[k, 1] * dz - a[k, 2] * dy
            ly = a[k, 2] * dx - a[k, 0] * dz
            lz = a[k, 0] * dy - a[k, 1] * dx
            square += lx * lx + ly * ly + lz * lz
        stiff: cython.double = (
            stiffness * tick_s * tick_s * max(1, len(self.contacts)) * square / _LEAST_INERTIA
        )
        nx, ny, nz = self._nx, self._ny, self._nz
        out = wx * nx + wy * ny + wz * nz
        share: cython.double = 1.0 / (1.0 + stiff)
        wx = share * (stiff * d[link, s, 0] - stiffness * (r[link, s, 0] + wx - out * nx))
        wy = share * (stiff * d[link, s, 1] - stiffness * (r[link, s, 1] + wy - out * ny))
        wz = share * (stiff * d[link, s, 2] - stiffness * (r[link, s, 2] + wz - out * nz))
        length = sqrt(wx * wx + wy * wy + wz * wz)
        longest: cython.double = self._law[s, 2] * push_n
        if length > longest:
            share = longest / length
            wx, wy, wz = share * wx, share * wy, share * wz
        d[link, s, 0] += _FOLLOWS * (wx - d[link, s, 0])
        d[link, s, 1] += _FOLLOWS * (wy - d[link, s, 1])
        d[link, s, 2] += _FOLLOWS * (wz - d[link, s, 2])
        return wx, wy, wz

    @cython.cfunc
    def _gone(
        self,
        c: cython.Py_ssize_t,
        x: cython.double,
        y: cython.double,
        z: cython.double,
        speeds: Any,
        tick_s: cython.double,
    ) -> tuple[cython.double, cython.double, cython.double]:
        """How far (m) the material of a capsule at that place has gone since the last look."""
        wx: cython.double = 0.0
        wy: cython.double = 0.0
        wz: cython.double = 0.0
        turn: cython.double
        a, p = self._axes, self._points
        for k in range(self._moved_by[c]):
            turn = tick_s * cython.cast(cython.double, speeds[k])
            dx, dy, dz = x - p[k, 0], y - p[k, 1], z - p[k, 2]
            wx += turn * (a[k, 1] * dz - a[k, 2] * dy)
            wy += turn * (a[k, 2] * dx - a[k, 0] * dz)
            wz += turn * (a[k, 0] * dy - a[k, 1] * dx)
        return wx, wy, wz

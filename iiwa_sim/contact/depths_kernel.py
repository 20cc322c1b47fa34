"""How deep places are in other bodies, before and after parts have gone their ways in a tick.

**No energy from nowhere.** A place presses at the beginning of a tick no deeper than it has been seen to at
the end of the one before: where it is deeper in a body, since a part has landed there, was put there, was
carried there or began there, that much more presses nothing, less as it comes out, and never more again. So
it holds up what would go in further, and gives nothing to what goes out.

A ball of the arm lies on the line of a capsule, and is always at that place of it that is deepest.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.bodies_kernel import Bodies
    from cython.cimports.iiwa_sim.contact.contact_kernel import Contact
    from cython.cimports.iiwa_sim.contact.lines_kernel import middle_along, nearest_along
    from cython.cimports.iiwa_sim.contact.ways_in_kernel import come_in
else:
    from iiwa_sim.contact.bodies_kernel import Bodies
    from iiwa_sim.contact.contact_kernel import Contact
    from iiwa_sim.contact.lines_kernel import middle_along, nearest_along
    from iiwa_sim.contact.ways_in_kernel import come_in

_CYLINDER = cython.declare(cython.int, 3)
_TALL = cython.declare(cython.double, 10.0)  # what stands has no upper nor lower end
# What is farther from a body (m) is not looked for along its line.
_CLOSE = cython.declare(cython.double, 1e-3)
_OUT = cython.declare(cython.double, 0.5)  # part of a way along the way out
# What is out by more (m) is so whatever the order in which ways of up to 1 m are added up.
_SURELY = cython.declare(cython.double, 1e-9)


@cython.cclass
class Depths(Bodies):
    """Places of bodies, and how deep they are in others; the arrays are declared in the .pxd."""

    def __init__(self, count: int) -> None:
        """There are `count` parts; they are the first bodies, surfaces follow."""
        Bodies.__init__(self, count)
        least = max(count, 1)
        self._slot = np.full(least, -1, dtype=np.intp)
        self._t, self._e = np.zeros((least, 4)), np.zeros((least, 4))
        self._turn = np.zeros((least, 2))
        self._of, self._moved = np.zeros((512, 2), dtype=np.intp), np.zeros((512, 4))
        self._adds, self._before = np.zeros(512), np.zeros(512)
        self._brought, self._by = 0.0, np.zeros(3)

    @cython.cfunc
    @cython.exceptval(-1e300, check=True)
    def _touch(self, n: cython.Py_ssize_t, moved: cython.bint, plane: cython.bint) -> cython.double:
        """How deep (m) a place is in the other body, before the parts have `moved` or after; that is noted,
        and for the `plane` of the place which way is out and where it touches."""
        c, p, size = self._c, self._pose, self._size
        x: cython.Py_ssize_t = self._i[n, 0]
        y: cython.Py_ssize_t = self._i[n, 1]
        slot: cython.Py_ssize_t
        px, py, pz = c[n, 0], c[n, 1], c[n, 2]
        qx, qy, qz = p[y, 9], p[y, 10], p[y, 11]
        s: cython.double = 0.0
        co: cython.double = 1.0
        if x >= 0:
            slot = self._slot[x] if moved and x < self._parts else -1
            if slot >= 0:
                cx, sx = self._turn[slot, 0], self._turn[slot, 1]
                px, py = cx * px - sx * py + self._e[slot, 0], sx * px + cx * py + self._e[slot, 1]
                pz += self._e[slot, 2]
            px, py, pz = px + p[x, 9], py + p[x, 10], pz + p[x, 11]
        slot = self._slot[y] if moved and y < self._parts else -1
        if slot >= 0:
            co, s = self._turn[slot, 0], self._turn[slot, 1]
            qx, qy, qz = qx + self._e[slot, 0], qy + self._e[slot, 1], qz + self._e[slot, 2]
        a: cython.double = size[y, 0]
        b: cython.double = size[y, 1]
        d: cython.double = size[y, 2]
        if self._i[n, 3]:
            axis: cython.int = self._upright[y]
            if self._kind[y] == _CYLINDER:
                b += _TALL
            elif axis == 0:
                a += _TALL
            elif axis == 1:
                b += _TALL
            else:
                d += _TALL
        radius: cython.double = c[n, 3]
        kind: cython.int = self._kind[y]
        ex, ey, ez = px - qx, py - qy, pz - qz
        u, v, w = self._seen(y, co, s, ex, ey, ez)
        mx, my, mz = c[n, 7], c[n, 8], c[n, 9]
        contact: Contact | None = self._contacts[n]
        if contact is not None:
            distance, nx, ny, nz = contact.away(u, v, w)
        else:
            distance, nx, ny, nz = come_in(kind, a, b, d, radius, u, v, w, mx, my, mz)
        has_line: cython.bint = x < 0 and (c[n, 42] != 0.0 or c[n, 43] != 0.0 or c[n, 44] != 0.0)
        if has_line and distance - radius < _CLOSE:
            u, v, w = self._seen(y, co, s, c[n, 39] - qx, c[n, 40] - qy, c[n, 41] - qz)
            ux, uy, uz = self._seen(y, co, s, c[n, 42], c[n, 43], c[n, 44])
            least, part = nearest_along(kind, a, b, d, radius, u, v, w, ux, uy, uz, mx, my, mz)
            part = middle_along(kind, a, b, d, radius, u, v, w, ux, uy, uz, mx, my, mz, part)
            u, v, w = u + part * ux, v + part * uy, w + part * uz
            distance, nx, ny, nz = come_in(kind, a, b, d, radius, u, v, w, mx, my, mz)
            distance = least
            px, py, pz = c[n, 39] + part * c[n, 42], c[n, 40] + part * c[n, 43], c[n, 41] + part * c[n, 44]
            ex, ey, ez = px - qx, py - qy, pz - qz
        c[n, 22], c[n, 23], c[n, 24] = nx, ny, nz
        if not moved:
            c[n, 7], c[n, 8], c[n, 9] = nx, ny, nz
        ux = p[y, 0] * nx + p[y, 1] * ny + p[y, 2] * nz
        uy = p[y, 3] * nx + p[y, 4] * ny + p[y, 5] * nz
        uz = p[y, 6] * nx + p[y, 7] * ny + p[y, 8] * nz
        ux, uy = co * ux - s * uy, s * ux + co * uy
        c[n, 25], c[n, 26], c[n, 27] = ex, ey, ez
        level: cython.double = 1.0
        if self._i[n, 2]:
            level = sqrt(ux * ux + uy * uy)
        depth: cython.double = radius * level - distance
        if not moved:
            more: cython.double = depth - c[n, 31]
            brought: cython.double = c[n, 38]
            out: cython.double = ux * c[n, 34] + uy * c[n, 35] + uz * c[n, 36]
            if out > _OUT * brought:
                brought = 0.0  # what has gone out has been brought no deeper
            elif contact is not None and contact._leans:
                brought = min(brought, max(0.0, -out))  # nor what presses elsewhere now, over the edge
            c[n, 32] = max(0.0, more - brought, min(c[n, 37], depth))
            if self._k[n] == -2:  # what the arm itself is in is known elsewhere
                c[n, 32] = c[n, 37]
        c[n, 30] = min(c[n, 32], max(0.0, depth))
        depth -= c[n, 30]
        c[n, 28] = depth
        if not moved:
            c[n, 13] = depth
        far: cython.double = radius if level == 1.0 else (radius / level if level > 0.0 else 0.0)
        px, py = px - far * ux, py - far * uy
        c[n, 45], c[n, 46], c[n, 47], c[n, 51], c[n, 52] = ux, uy, uz, px, py
        if plane:
            c[n, 14], c[n, 15], c[n, 16] = ux, uy, uz
            # Where it touches, from where both middles were before.
            c[n, 19], c[n, 20] = px - p[y, 9], py - p[y, 10]
            if x >= 0:
                c[n, 17], c[n, 18] = px - p[x, 9], py - p[x, 10]
        return depth

    @cython.cfunc
    @cython.exceptval(check=False)
    def _seen(
        self,
        y: cython.Py_ssize_t,
        co: cython.double,
        s: cython.double,
        ex: cython.double,
        ey: cython.double,
        ez: cython.double,
    ) -> tuple[cython.double, cython.double, cython.double]:
        """A way (m) in the base as a body has it that has turned about z by an angle of that cosine and
        sine."""
        p = self._pose
        ux, uy = co * ex + s * ey, co * ey - s * ex
        return (
            p[y, 0] * ux + p[y, 3] * uy + p[y, 6] * ez,
            p[y, 1] * ux + p[y, 4] * uy + p[y, 7] * ez,
            p[y, 2] * ux + p[y, 5] * uy + p[y, 8] * ez,
        )

    @cython.cfunc
    @cython.exceptval(check=False)
    def _depth(self, m: cython.Py_ssize_t) -> cython.double:
        """Depth (m) of a place, taken for a plane, when parts have gone the ways that are tried."""
        c, t, moved = self._c, self._t, self._moved
        depth: cython.double = c[m, 29]
        q: cython.Py_ssize_t
        for q in range(self._i[m, 4], self._i[m, 5]):
            k: cython.Py_ssize_t = self._of[q, 0]
            out: cython.double = c[m, 14] * t[k, 0] + c[m, 15] * t[k, 1] + c[m, 16] * t[k, 2]
            depth += moved[q, 0] * (out + moved[q, 3] * t[k, 3])
        return depth

    @cython.cfunc
    @cython.exceptval(check=False)
    def _find_depth(self, m: cython.Py_ssize_t) -> cython.void:
        """Note what each part adds to that depth."""
        c, t, moved = self._c, self._t, self._moved
        depth: cython.double = c[m, 29]
        q: cython.Py_ssize_t
        for q in range(self._i[m, 4], self._i[m, 5]):
            k: cython.Py_ssize_t = self._of[q, 0]
            out: cython.double = c[m, 14] * t[k, 0] + c[m, 15] * t[k, 1] + c[m, 16] * t[k, 2]
            self._before[q], self._adds[q] = depth, moved[q, 0] * (out + moved[q, 3] * t[k, 3])
            depth += self._adds[q]
        c[m, 58], self._i[m, 7] = depth, self._i[m, 5]

    @cython.cfunc
    @cython.exceptval(check=False)
    def _depth_with(self, q: cython.Py_ssize_t) -> cython.double:
        """Depth (m) of a place when parts have gone the ways that are tried, to the last bit where the place
        is in a body; where it is out, any number below 0. Only the part of this row of `_of` may have tried
        another way since the sum was noted last."""
        c, t, moved, m = self._c, self._t, self._moved, self._of[q, 1]
        k: cython.Py_ssize_t = self._of[q, 0]
        out: cython.double = c[m, 14] * t[k, 0] + c[m, 15] * t[k, 1] + c[m, 16] * t[k, 2]
        adds: cython.double = moved[q, 0] * (out + moved[q, 3] * t[k, 3])
        was: cython.double = self._adds[q]
        self._adds[q] = adds
        # What those before it add has not changed, and of a place that is surely out no sum is needed.
        first: cython.Py_ssize_t = min(q, self._i[m, 7])
        depth: cython.double = c[m, 58] + (adds - was)
        if depth < -_SURELY and max(fabs(adds), fabs(was)) < 1.0:
            self._i[m, 7] = first
        else:
            depth = self._before[first]
            for r in range(first, self._i[m, 5]):
                self._before[r] = depth
                depth += self._adds[r]
            self._i[m, 7] = self._i[m, 5]
        c[m, 58] = depth
        return depth

    @cython.cfunc
    @cython.exceptval(check=False)
    def _rub(self, m: cython.Py_ssize_t) -> tuple[cython.double, cython.double, cython.double]:
        """How far friction's spring at a place would be wound (m) at the ways that are tried, if it held."""
        ux: cython.double = 0.0
        uy: cython.double = 0.0
        uz: cython.double = 0.0
        q: cython.Py_ssize_t
        for q in range(self._i[m, 4], self._i[m, 5]):
            k = self._of[q, 0]
            ux -= self._moved[q, 0] * (self._t[k, 0] - self._t[k, 3] * self._moved[q, 2])
            uy -= self._moved[q, 0] * (self._t[k, 1] + self._t[k, 3] * self._moved[q, 1])
            uz -= self._moved[q, 0] * self._t[k, 2]
        nx, ny, nz = self._c[m, 14], self._c[m, 15], self._c[m, 16]
        out = ux * nx + uy * ny + uz * nz
        return self._c[m, 10] + ux - out * nx, self._c[m, 11] + uy - out * ny, self._c[m, 12] + uz - out * nz

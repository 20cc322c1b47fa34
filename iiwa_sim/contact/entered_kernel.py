"""How deep a sphere round the TCP is in one surface, and by which way it has come in.

**Ways in.** A TCP that has come into a body through a face is pushed back through it, however deep it is
pressed, until it is out again, or beside the face's outline; so it is in a round body, from half-way to its
middle on. So a force does not turn round within a thin plate or rod, nor behind it. What is stored in the
spring then is lost beside the outline: nothing is gained by it. More is said in `shapes`.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from typing import Any

import cython
from cython.cimports.libc.math import fabs

from iiwa_sim.contact.shapes import Box, Plane
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.ways_in_kernel import KINDS

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.ways_in_kernel import nearest
else:
    from iiwa_sim.contact.ways_in_kernel import nearest


@cython.cclass
class Entered:
    """A surface, and by which way the TCP has come in; the numbers are declared in the .pxd."""

    def __init__(self, surface: Surface, radius: float) -> None:
        """`radius` (m) is that of the sphere round the TCP, which has touched nothing."""
        self._radius = radius
        reach = surface.shape.extent + radius
        self._reach_squared = reach * reach
        shape = surface.shape
        self._kind = KINDS[type(shape)]
        self._is_plane, self._is_box = isinstance(shape, Plane), isinstance(shape, Box)
        self._half_x, self._half_y, self._half_z = (*shape, 0.0, 0.0, 0.0)[:3]
        self._known = False
        self._wx = self._wy = self._wz = 0.0
        self._come(None)
        self._gx = self._gy = self._gz = self._gap = 0.0
        self._put(surface)

    def _put(self, surface: Surface) -> None:
        """The surface is here."""
        self.surface = surface
        rotation, place = surface.pose
        self._r0, self._r1, self._r2, self._r3, self._r4, self._r5, self._r6, self._r7, self._r8 = rotation
        self._ox, self._oy, self._oz = place
        self._nx, self._ny, self._nz = self._r2, self._r5, self._r8
        self._height = self._nx * self._ox + self._ny * self._oy + self._nz * self._oz + self._radius

    @cython.cfunc
    @cython.exceptval(check=True)
    def _find_depth(
        self, px: cython.double, py: cython.double, pz: cython.double, remember: cython.bint
    ) -> cython.void:
        """How deep (m) the sphere is in the surface, 0 where it is not, and the direction out of it."""
        x: cython.double = px - self._ox
        y: cython.double = py - self._oy
        z: cython.double = pz - self._oz
        self._depth = 0.0
        ax: cython.double = self._r0 * x + self._r3 * y + self._r6 * z
        ay: cython.double = self._r1 * x + self._r4 * y + self._r7 * z
        az: cython.double = self._r2 * x + self._r5 * y + self._r8 * z
        if self._is_off(ax, ay, az):
            if remember:
                self._known, self._wx, self._wy, self._wz = True, ax, ay, az
            return
        distance, x, y, z = self._follow(ax, ay, az)
        if remember:
            if self._next is not self._came:
                self._come(self._next)
            self._known, self._wx, self._wy, self._wz = True, ax, ay, az
        if self._radius - distance <= 0.0:
            if remember:  # else the way here has begun elsewhere
                self._gx, self._gy, self._gz, self._gap = ax, ay, az, distance - self._radius
            return
        self._depth = self._radius - distance
        self._nx = self._r0 * x + self._r1 * y + self._r2 * z
        self._ny = self._r3 * x + self._r4 * y + self._r5 * z
        self._nz = self._r6 * x + self._r7 * y + self._r8 * z

    @cython.cfunc
    @cython.exceptval(check=True)
    def away(
        self, x: cython.double, y: cython.double, z: cython.double
    ) -> tuple[cython.double, cython.double, cython.double, cython.double]:
        """Distance (m) of a place from the shape, in the frame of that, and the way out, for a TCP that goes
        there straight from where it is; nothing remembers that."""
        distance, nx, ny, nz = 0.0, 0.0, 0.0, 0.0
        if self._is_off(x, y, z):
            distance, nx, ny, nz = nearest(self._kind, self._half_x, self._half_y, self._half_z, x, y, z)
        else:
            distance, nx, ny, nz = self._follow(x, y, z)
        return distance, nx, ny, nz

    @cython.cfunc
    @cython.exceptval(check=False)
    def _is_off(self, x: cython.double, y: cython.double, z: cython.double) -> cython.bint:
        """Whether the sphere touches nothing with the TCP at a place in the frame of the shape, nor has on
        the way there, which has begun within the same ball: so it is in most ticks."""
        if self._came is not None:
            return False
        gx: cython.double = x - self._gx
        gy: cython.double = y - self._gy
        gz: cython.double = z - self._gz
        near: cython.bint = gx * gx + gy * gy + gz * gz < self._gap * self._gap
        return near or x * x + y * y + z * z >= self._reach_squared

    @cython.cfunc
    @cython.exceptval(check=True)
    def _follow(
        self, x: cython.double, y: cython.double, z: cython.double
    ) -> tuple[cython.double, cython.double, cython.double, cython.double]:
        """`away` for a place near which it may touch; by which way it has come in then is in `_next`."""
        self._next: Any = self._came
        if self._axis >= 0 and self._is_behind(x, y, z):
            return self._behind, self._out_x, self._out_y, self._out_z
        was = (self._wx, self._wy, self._wz) if self._known else None
        found, self._next = self.surface.shape.follow(self._came, was, (x, y, z), self._radius)
        distance, nx, ny, nz = found
        return distance, nx, ny, nz

    @cython.cfunc
    def _come(self, came: Any) -> object:
        """The TCP has come in by this way."""
        self._came: Any = came
        self._axis = -1
        if came is not None and self._is_box:
            self._axis, self._side = came
            self._out_x, self._out_y, self._out_z = [self._side * (self._axis == k) for k in range(3)]
        return None

    @cython.cfunc
    @cython.exceptval(check=False)
    def _is_behind(self, x: cython.double, y: cython.double, z: cython.double) -> cython.bint:
        """Whether a place is behind the face of a box by which the TCP has come in, as `Box.behind`; its
        distance (m) is in `_behind`."""
        off_x: cython.bint = fabs(x) > self._half_x
        off_y: cython.bint = fabs(y) > self._half_y
        off_z: cython.bint = fabs(z) > self._half_z
        if self._axis == 0:
            self._behind = self._side * x - self._half_x
            return self._behind <= 0.0 and not (off_y or off_z)
        if self._axis == 1:
            self._behind = self._side * y - self._half_y
            return self._behind <= 0.0 and not (off_x or off_z)
        self._behind = self._side * z - self._half_z
        return self._behind <= 0.0 and not (off_x or off_y)

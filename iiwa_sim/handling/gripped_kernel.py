"""Where a part between jaws is: in the TCP, in the base, and how its mass is spread in the TCP."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from typing import Any

import cython
import numpy as np
from cython.cimports.libc.math import sqrt

from iiwa_sim.contact.at_tcp_kernel import velocity_between
from iiwa_sim.frames import Transform, Vector, apply
from iiwa_sim.handling.grip import grip_width
from iiwa_sim.handling.part import Part

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.at_tcp_kernel import as_transform, farthest, put_together, take
else:
    from iiwa_sim.contact.at_tcp_kernel import as_transform, farthest, put_together, take


@cython.cclass
class Gripped:
    """One part in jaws, its middle between them; the attributes are declared in the .pxd."""

    def __init__(self, part: Part, in_tcp: Transform, tcp: Transform, tick_s: float) -> None:
        """At a pose in the TCP, but in the middle between the jaws, with the TCP at rest at a pose."""
        self.part = part
        self._mass, self._tick = part.mass_kg, tick_s
        self._tcp: Any = np.zeros(12)
        self._was: Any = np.zeros(12)
        self._in, self._at, self._aside, self._there = np.zeros((4, 12))
        x, _, z = in_tcp.translation
        take(Transform(in_tcp.rotation, (x, 0.0, z)), self._in)
        take(tcp, self._tcp)
        self._placed: Any = False
        self._pose: Transform | None = None
        self._in_tcp: Transform | None = None
        self._stay()
        self.width_m = grip_width(part, self.in_tcp)
        self._about = np.array(part.moments(Transform(in_tcp.rotation, (0.0, 0.0, 0.0))))
        self._moments = np.zeros(10)
        self._shift()

    @cython.ccall
    @cython.exceptval(-1, check=True)
    def stays(self, tcp: Transform, coming: Transform | None) -> cython.bint:
        """Whether the TCP is where it has been, and stays there as far as is known."""
        take(tcp, self._there)
        for k in range(12):
            if self._there[k] != self._tcp[k]:
                return False
        return coming is None or bool(coming == tcp)

    @property
    def in_tcp(self) -> Transform:
        """The pose of its middle in the TCP; the same object until it has slid."""
        if self._in_tcp is None:
            self._in_tcp = as_transform(self._in)
        pose: Transform = self._in_tcp
        return pose

    @property
    def pose(self) -> Transform:
        """Pose of the part's middle, in the base; the same object until it has moved."""
        if self._pose is None:
            self._place()
            self._pose = as_transform(self._at)
        pose: Transform = self._pose
        return pose

    @property
    def velocity(self) -> Vector:
        """Velocity of the part's middle in the last tick (m/s), in the base."""
        before = apply(as_transform(self._was), (self._was_x, 0.0, self._was_z))
        return velocity_between(before, self.pose.translation, self._tick)

    def way_since(self, tcp: Transform, in_tcp: Transform, now: Transform) -> float:
        """No point of it has gone farther (m) since it was at `in_tcp` in the TCP, from where that was to
        where it is `now`."""
        take(tcp, self._aside)
        take(now, self._there)
        x, _, z = in_tcp.translation
        return float(self.way(self._aside, x, z, self._there))

    @cython.cfunc
    @cython.exceptval(check=False)
    def way(
        self, tcp: cython.double[::1], x: cython.double, z: cython.double, now: cython.double[::1]
    ) -> cython.double:
        """`way_since` for kernels."""
        x, z = x - self._in[9], z - self._in[11]
        return farthest(tcp, now, self._reach) + sqrt(x * x + z * z)

    @cython.cfunc
    @cython.exceptval(check=False)
    def _place(self) -> cython.void:
        """Find where it is."""
        if not self._placed:
            put_together(self._tcp, self._in, self._at)
            self._placed = True

    @cython.cfunc
    def _shift(self) -> object:
        """Note that the part is elsewhere in the TCP: find how far it reaches from there, and its moments."""
        m, a = self._moments, self._about
        mass: cython.double = self._mass
        x, z = self._in[9], self._in[11]
        self._reach = sqrt(x * x + z * z) + cython.cast(cython.double, self.part.shape.extent)
        m[0], m[1], m[2], m[3] = mass, mass * x, 0.0, mass * z
        m[4], m[5], m[6] = a[4] + mass * x * x, a[5], a[6] + mass * z * z
        m[7], m[8], m[9] = a[7], a[8] + mass * x * z, a[9]
        return None

    @cython.cfunc
    def _at_middle(self, fx: cython.double, fy: cython.double, fz: cython.double) -> object:
        """A force (N) at its middle, as the TCP has it."""
        x, y, z = self._in[9], self._in[10], self._in[11]
        return (fx, fy, fz, y * fz - z * fy, z * fx - x * fz, x * fy - y * fx)

    @cython.cfunc
    @cython.exceptval(check=False)
    def _stay(self) -> cython.void:
        """Take the part to have been a tick ago where it is now."""
        for k in range(12):
            self._was[k] = self._tcp[k]
        self._was_x, self._was_z = self._in[9], self._in[11]
        self._placed = False

    @cython.cfunc
    @cython.exceptval(check=False)
    def _go(self, x: cython.double, z: cython.double, u: cython.double, w: cython.double) -> cython.void:
        """Put the part where a tick brings it from (x, z) in the TCP (m) at velocities u and w (m/s)."""
        self._in[9], self._in[11] = x + u * self._tick, z + w * self._tick
        self._placed, self._pose = False, None

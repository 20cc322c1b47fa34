"""One surface that the TCP touches: how it pushes back and holds on to it.

**Normal force.** k d (1 + b d'): stiffness times depth, and a damping that grows with the depth (Hunt and
Crossley, 1975, with a linear spring), never less than 0. A spring and a dashpot side by side would jump from
0 to the dashpot's force in the tick of the impact, where a threshold would feel the speed, not the surface,
and they would pull at the end. Here the power lost is k b d d'^2, so no motion gains energy.

**Friction.** A spring of the surface's stiffness between the TCP and an anchor, at first where the TCP came
down. Its force is at most mu times the normal force: beyond that the anchor is dragged along. So a TCP that
stands still keeps the friction it has, and one that turns back unloads the spring first. What the limit cuts
off is lost, nothing is gained. The anchor depends on where the TCP has been, not on how often it was asked.
It acts where the sphere touches, so the spring follows the sphere there: it rolls (`Contact.roll`). On a bent
surface the part of the spring that points out of it is dropped as the TCP moves on.

How deep it is, and which way is out, is found in `entered_kernel`.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

from typing import Any

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt

from iiwa_sim.contact.surface import Surface

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.entered_kernel import Entered
else:
    from iiwa_sim.contact.entered_kernel import Entered

# The anchor is dragged where it is farther away by this than it can be held. Rounding alone would otherwise
# move it while the TCP stands still.
_SLIP_M = cython.declare(cython.double, 1e-12)


@cython.cfunc
@cython.exceptval(check=False)
def turn_between(
    before: cython.double[::1], after: cython.double[::1]
) -> tuple[cython.double, cython.double, cython.double]:
    """The turn between two rotations, as a vector along its axis as long as its angle (rad), if that is
    small: by parts of 1e-12 of 0.1 rad."""
    a0, a1, a2, a3, a4 = before[0], before[1], before[2], before[3], before[4]
    a5, a6, a7, a8 = before[5], before[6], before[7], before[8]
    b0, b1, b2, b3, b4 = after[0], after[1], after[2], after[3], after[4]
    b5, b6, b7, b8 = after[5], after[6], after[7], after[8]
    # Half the cross products of the axes before and now: the turn's axis times the sine of its angle.
    x = 0.5 * (a3 * b6 - a6 * b3 + a4 * b7 - a7 * b4 + a5 * b8 - a8 * b5)
    y = 0.5 * (a6 * b0 - a0 * b6 + a7 * b1 - a1 * b7 + a8 * b2 - a2 * b8)
    z = 0.5 * (a0 * b3 - a3 * b0 + a1 * b4 - a4 * b1 + a2 * b5 - a5 * b2)
    # The arcsine: what is turned to and fro by large and by small steps has to come back to where it was.
    sine2 = x * x + y * y + z * z
    angle = 1.0 + sine2 * (1.0 / 6.0 + sine2 * (3.0 / 40.0 + sine2 * (5.0 / 112.0 + sine2 * (35.0 / 1152.0))))
    return angle * x, angle * y, angle * z


@cython.cclass
class Contact(Entered):
    """A surface, and what holds the TCP on it; the numbers are declared in the .pxd."""

    def __init__(self, surface: Surface, radius: float) -> None:
        """`radius` (m) is that of the sphere round the TCP."""
        Entered.__init__(self, surface, radius)
        self._stiffness, self._damping, self._friction = surface.stiffness, surface.damping, surface.friction
        self.touched = self._anchored = False
        self._ax = self._ay = self._az = 0.0
        self._ux = self._uy = self._uz = 0.0

    def move(self, surface: Surface) -> None:
        """The surface is moved to another pose, and takes along what holds the TCP on it. The sphere, which
        has not turned, rolls back where the surface has."""
        before, after = self.surface.pose, surface.pose
        if not self._anchored:
            self._put(surface)
            return
        x, y, z = self._ax, self._ay, self._az
        ox, oy, oz = self._ox, self._oy, self._oz
        ax: cython.double = (self._r0 * x + self._r3 * y + self._r6 * z) - (
            self._r0 * ox + self._r3 * oy + self._r6 * oz
        )
        ay: cython.double = (self._r1 * x + self._r4 * y + self._r7 * z) - (
            self._r1 * ox + self._r4 * oy + self._r7 * oz
        )
        az: cython.double = (self._r2 * x + self._r5 * y + self._r8 * z) - (
            self._r2 * ox + self._r5 * oy + self._r8 * oz
        )
        x, y, z = self._ux, self._uy, self._uz
        ux: cython.double = self._r0 * x + self._r3 * y + self._r6 * z
        uy: cython.double = self._r1 * x + self._r4 * y + self._r7 * z
        uz: cython.double = self._r2 * x + self._r5 * y + self._r8 * z
        self._put(surface)
        self._ax = self._r0 * ax + self._r1 * ay + self._r2 * az + self._ox
        self._ay = self._r3 * ax + self._r4 * ay + self._r5 * az + self._oy
        self._az = self._r6 * ax + self._r7 * ay + self._r8 * az + self._oz
        self._ux = self._r0 * ux + self._r1 * uy + self._r2 * uz
        self._uy = self._r3 * ux + self._r4 * uy + self._r5 * uz
        self._uz = self._r6 * ux + self._r7 * uy + self._r8 * uz
        if self._radius > 0.0:
            wx, wy, wz = turn_between(np.array(before.rotation), np.array(after.rotation))
            self.roll(-wx, -wy, -wz)

    @cython.cfunc
    @cython.exceptval(check=False)
    def roll(self, wx: cython.double, wy: cython.double, wz: cython.double) -> cython.void:
        """The TCP has turned by a rotation vector (rad, in the base), and with it the sphere."""
        if self._anchored:
            self._ax += self._radius * (wy * self._uz - wz * self._uy)
            self._ay += self._radius * (wz * self._ux - wx * self._uz)
            self._az += self._radius * (wx * self._uy - wy * self._ux)

    def memory(self) -> Any:
        """What the surface remembers of the TCP. Where a tick leaves that as it is, and the TCP stands, so
        does the next one."""
        held = (self._anchored, self._ax, self._ay, self._az, self._ux, self._uy, self._uz)
        return (held, self._wx, self._wy, self._wz, self._came)

    def kept(self) -> Any:
        """All that the surface remembers, to be brought back."""
        held: Any = [bool(self.touched), bool(self._anchored), bool(self._known), self._came]
        held += [self._ax, self._ay, self._az, self._ux, self._uy, self._uz]
        return [*held, self._wx, self._wy, self._wz]

    def restore(self, kept: Any) -> None:
        """Remember that again."""
        self.touched, self._anchored, self._known, came = kept[:4]
        self._come(came)
        self._ax, self._ay, self._az, self._ux, self._uy, self._uz = kept[4:10]
        self._wx, self._wy, self._wz = kept[10:]

    @cython.cfunc
    @cython.exceptval(-1, check=True)
    def press(
        self,
        px: cython.double,
        py: cython.double,
        pz: cython.double,
        vx: cython.double,
        vy: cython.double,
        vz: cython.double,
        remember: cython.bint,
    ) -> cython.bint:
        """Whether the TCP touches the surface at a place (m) with a velocity (m/s); what acts is in f, t."""
        if self._is_plane:
            self._depth = self._height - (self._nx * px + self._ny * py + self._nz * pz)
        else:
            self._find_depth(px, py, pz, remember)
        if remember:
            self.touched = self._depth > 0.0
        if self._depth <= 0.0:
            if remember:
                self._anchored = False
            return False
        nx, ny, nz = self._nx, self._ny, self._nz
        damped: cython.double = 1.0 - self._damping * (vx * nx + vy * ny + vz * nz)
        normal: cython.double = self._stiffness * self._depth * damped if damped > 0.0 else 0.0
        self.fx, self.fy, self.fz = normal * nx, normal * ny, normal * nz
        self.tx = self.ty = self.tz = 0.0
        if self._friction == 0.0:
            return True
        if not self._anchored:
            if remember:
                self._ux, self._uy, self._uz = nx, ny, nz
                self._anchored = True
                self._ax, self._ay, self._az = px, py, pz
            return True
        # Friction: along the surface, and at most so much.
        limit: cython.double = self._friction * normal
        longest: cython.double = limit / self._stiffness
        ax, ay, az = self._ax, self._ay, self._az
        x, y, z = ax - px, ay - py, az - pz
        out: cython.double
        if not self._is_plane:
            # On a bent surface the way along it is half that in the tangent plane before, half that in this.
            out = 0.5 * (x * self._ux + y * self._uy + z * self._uz)
            x, y, z = x - out * self._ux, y - out * self._uy, z - out * self._uz
            if remember:
                self._ux, self._uy, self._uz = nx, ny, nz
        out = x * nx + y * ny + z * nz
        x, y, z = x - out * nx, y - out * ny, z - out * nz
        length: cython.double = sqrt(x * x + y * y + z * z)
        if remember and not self._is_plane and fabs(out) > _SLIP_M:
            # Where the surface is bent, what is out of it here would later count as along it.
            ax, ay, az = px + x, py + y, pz + z
            self._ax, self._ay, self._az = ax, ay, az
        if remember and length > longest + _SLIP_M:
            # What follows is found from the new anchor, as it will be when the TCP is still here.
            share = longest / length
            ax, ay, az = px + share * x, py + share * y, pz + share * z
            self._ax, self._ay, self._az = ax, ay, az
            x, y, z = ax - px, ay - py, az - pz
            out = x * nx + y * ny + z * nz
            x, y, z = x - out * nx, y - out * ny, z - out * nz
            length = sqrt(x * x + y * y + z * z)
        held: cython.double = self._stiffness if length <= longest else limit / length
        x, y, z = held * x, held * y, held * z
        self.fx, self.fy, self.fz = normal * nx + x, normal * ny + y, normal * nz + z
        self.tx = self._radius * (nz * y - ny * z)
        self.ty = self._radius * (nx * z - nz * x)
        self.tz = self._radius * (ny * x - nx * y)
        return True

"""The world the TCP touches: surfaces that push back and hold on to it.

**Normal force.** k d (1 + b d'): stiffness times depth, and a damping that grows with the depth (Hunt and
Crossley, 1975, with a linear spring), never less than 0. A spring and a dashpot side by side would jump from
0 to the dashpot's force in the tick of the impact, where a threshold would feel the speed, not the surface,
and they would pull at the end. Here the power lost is k b d d'^2, so no motion gains energy.

**Friction.** A spring of the surface's stiffness between the TCP and an anchor, at first where the TCP came
down. Its force is at most mu times the normal force: beyond that the anchor is dragged along. So a TCP that
stands still keeps the friction it has, and one that turns back unloads the spring first. What the limit cuts
off is lost, nothing is gained. The anchor depends on where the TCP has been, not on how often it was asked.

**Faces.** A TCP that has come into a box, or a cylinder's end, through a face is pushed back through it,
however deep it is pressed, until it is out again, or beside the face's outline. So a force does not turn
round within a thin plate, nor behind it. What is stored in the spring then is lost beside the outline:
nothing is gained here either.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import cython
from cython.cimports.libc.math import sqrt

from iiwa_sim.contact.shapes import Plane, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Vector
from iiwa_sim.wrench import NO_TOUCH, Touch

# The anchor is dragged where it is farther away by this than it can be held. Rounding alone would otherwise
# move it while the TCP stands still.
_SLIP_M = cython.declare(cython.double, 1e-12)


AT_REST: Vector = (0.0, 0.0, 0.0)
_new = tuple.__new__  # calling the class costs twice as much


@cython.cclass
class Contact:
    """A surface, what holds the TCP on it, and through which face the TCP has come in."""

    surface: Any = cython.declare(object, visibility="readonly")
    _radius: cython.double
    _reach_squared: cython.double
    _stiffness: cython.double
    _damping: cython.double
    _friction: cython.double
    _is_plane: cython.bint
    # The rotation of the shape, row by row, and its place (m).
    _r0: cython.double
    _r1: cython.double
    _r2: cython.double
    _r3: cython.double
    _r4: cython.double
    _r5: cython.double
    _r6: cython.double
    _r7: cython.double
    _r8: cython.double
    _ox: cython.double
    _oy: cython.double
    _oz: cython.double
    # Which way is out, how deep the TCP is (m), and how far from the base a sphere lies on a plane (m).
    _nx: cython.double
    _ny: cython.double
    _nz: cython.double
    _depth: cython.double
    _height: cython.double
    # The anchor (m), if there is one.
    _anchored: cython.bint
    _ax: cython.double
    _ay: cython.double
    _az: cython.double
    # What the surface does.
    fx: cython.double
    fy: cython.double
    fz: cython.double
    tx: cython.double
    ty: cython.double
    tz: cython.double
    # Of a shape that is no plane: the TCP in its frame when it was near last, and the face it has come in by.
    _was: Any
    _face: Any

    def __init__(self, surface: Surface, radius: float) -> None:
        """`radius` (m) is that of the sphere round the TCP."""
        self.surface = surface
        self._radius = radius
        reach = surface.shape.extent + radius
        self._reach_squared = reach * reach
        self._stiffness, self._damping, self._friction = surface.stiffness, surface.damping, surface.friction
        rotation, place = surface.pose
        self._r0, self._r1, self._r2, self._r3, self._r4, self._r5, self._r6, self._r7, self._r8 = rotation
        self._ox, self._oy, self._oz = place
        self._is_plane = isinstance(surface.shape, Plane)
        self._nx, self._ny, self._nz = self._r2, self._r5, self._r8
        self._height = self._nx * self._ox + self._ny * self._oy + self._nz * self._oz + self._radius
        self._anchored = False
        self._ax = self._ay = self._az = 0.0
        self._was = None
        self._face = None

    def memory(self) -> Any:
        """What the surface remembers of the TCP. Where a tick leaves that as it is, and the TCP stands, so
        does the next one."""
        return (self._anchored, self._ax, self._ay, self._az, self._was, self._face)

    @cython.cfunc
    @cython.exceptval(check=True)
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
                self._anchored = True
                self._ax, self._ay, self._az = px, py, pz
            return True
        # Friction: along the surface, and at most so much.
        limit: cython.double = self._friction * normal
        longest: cython.double = limit / self._stiffness
        ax, ay, az = self._ax, self._ay, self._az
        x, y, z = ax - px, ay - py, az - pz
        out: cython.double = x * nx + y * ny + z * nz
        x, y, z = x - out * nx, y - out * ny, z - out * nz
        length: cython.double = sqrt(x * x + y * y + z * z)
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
        if self._face is None and x * x + y * y + z * z >= self._reach_squared:
            if remember:
                self._was = None
            return
        ax: cython.double = self._r0 * x + self._r3 * y + self._r6 * z
        ay: cython.double = self._r1 * x + self._r4 * y + self._r7 * z
        az: cython.double = self._r2 * x + self._r5 * y + self._r8 * z
        found, face = self._seen(ax, ay, az)
        if remember:
            self._was, self._face = (ax, ay, az), face
        distance: cython.double
        distance, x, y, z = found
        if self._radius - distance <= 0.0:
            return
        self._depth = self._radius - distance
        self._nx = self._r0 * x + self._r1 * y + self._r2 * z
        self._ny = self._r3 * x + self._r4 * y + self._r5 * z
        self._nz = self._r6 * x + self._r7 * y + self._r8 * z

    @cython.cfunc
    def _seen(self, x: float, y: float, z: float) -> Any:
        """The distance to the surface and the way out of it, and the face through which the TCP is in it."""
        shape, face = self.surface.shape, self._face
        if isinstance(shape, Plane | Sphere):
            return shape.nearest(x, y, z), None
        if face is not None:
            through = shape.behind(face, x, y, z)
            return (shape.nearest(x, y, z), None) if through is None else (through, face)
        nearest = shape.nearest(x, y, z)
        if self._was is not None:
            was_x, was_y, was_z = self._was
            dx, dy, dz, distance = x - was_x, y - was_y, z - was_z, nearest[0]
            # It has come in, or through, since then: not where it is farther away than it has gone.
            if distance <= 0.0 or distance * distance < dx * dx + dy * dy + dz * dz:
                face = shape.entered(self._was, (x, y, z))
                through = None if face is None else shape.behind(face, x, y, z)
                if through is not None:
                    return through, face
        return nearest, None


@cython.cclass
class World:
    """Surfaces, and a sphere round the TCP that touches them.

    Each surface acts for itself: where two overlap, or meet flush, their forces add up. The sphere does not
    roll: how the tool turns about the TCP makes no friction.
    """

    radius_m: float = cython.declare(cython.double, visibility="readonly")
    changes: int = cython.declare(cython.int, visibility="readonly")
    """How many times a surface has been put or taken away."""
    _contacts: dict[str, Contact]
    _all: list[Contact]

    def __init__(self, surfaces: Iterable[Surface], radius_m: float) -> None:
        """`radius_m` is that of the sphere; 0 makes it a point. Each surface has a name of its own."""
        self.radius_m = radius_m
        self.changes = 0
        self._contacts = {}
        self._all = []
        for surface in surfaces:
            self.put(surface)

    @property
    def surfaces(self) -> dict[str, Surface]:
        """By their names."""
        return {name: contact.surface for name, contact in self._contacts.items()}

    def put(self, surface: Surface) -> None:
        """Add a surface, or have it take the place of the one of its name, as one not touched before."""
        self._contacts[surface.name] = Contact(surface, self.radius_m)
        self._all = list(self._contacts.values())
        self.changes += 1

    def remove(self, name: str) -> None:
        """Take a surface away, which must be there."""
        del self._contacts[name]
        self._all = list(self._contacts.values())
        self.changes += 1

    def forget(self) -> None:
        """No surface has been touched before."""
        for surface in self.surfaces.values():
            self.put(surface)

    def memory(self) -> Any:
        """What all surfaces remember of the TCP, to be compared."""
        return [contact.memory() for contact in self._all]

    @property
    def empty(self) -> bool:
        """Whether there is nothing to touch."""
        return not self._contacts

    def feel(self, position: Vector, velocity: Vector, dt_s: float) -> Touch:
        """What is felt with the TCP at a position (m) and a velocity (m/s), in the base.

        Friction remembers that the TCP has been here; with a time `dt_s` of 0 it does not. In free space all
        is exactly 0.
        """
        px: cython.double
        py: cython.double
        pz: cython.double
        vx: cython.double
        vy: cython.double
        vz: cython.double
        px, py, pz = position
        vx, vy, vz = velocity
        remember: cython.bint = dt_s > 0.0
        touched: cython.bint = False
        fx = fy = fz = tx = ty = tz = 0.0
        contact: Contact
        for contact in self._all:
            if contact.press(px, py, pz, vx, vy, vz, remember):
                touched = True
                fx, fy, fz = fx + contact.fx, fy + contact.fy, fz + contact.fz
                tx, ty, tz = tx + contact.tx, ty + contact.ty, tz + contact.tz
        if not touched:
            return NO_TOUCH
        return _new(Touch, ((fx, fy, fz), (tx, ty, tz)))

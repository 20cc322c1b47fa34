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

from collections.abc import Iterable
from math import sqrt
from typing import NamedTuple

from iiwa_sim.contact.shapes import Face, Nearest, Plane, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Vector

SLIP_M = 1e-12
"""The anchor is dragged where it is farther away by this than it can be held. Rounding alone would otherwise
move it while the TCP stands still."""


class Touch(NamedTuple):
    """What surfaces do to the robot: N, and Nm about the TCP, along the axes of the base."""

    force: Vector
    torque: Vector


_new = tuple.__new__  # calling the class costs twice as much
_FAR: Nearest = (0.0, 0.0, 0.0, 0.0)

NOTHING = Touch((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


class World:
    """Surfaces, and a sphere round the TCP that touches them.

    Each surface acts for itself: where two overlap, or meet flush, their forces add up. The sphere does not
    roll: how the tool turns about the TCP makes no friction.
    """

    def __init__(self, surfaces: Iterable[Surface], radius_m: float) -> None:
        """`radius_m` is that of the sphere; 0 makes it a point. Each surface has a name of its own."""
        self.radius_m = radius_m
        self._contacts = {surface.name: _Contact(surface, radius_m) for surface in surfaces}

    @property
    def surfaces(self) -> dict[str, Surface]:
        """By their names."""
        return {name: contact.surface for name, contact in self._contacts.items()}

    def put(self, surface: Surface) -> None:
        """Add a surface, or have it take the place of the one of its name, as one not touched before."""
        self._contacts[surface.name] = _Contact(surface, self.radius_m)

    def remove(self, name: str) -> None:
        """Take a surface away, which must be there."""
        del self._contacts[name]

    def forget(self) -> None:
        """No surface has been touched before."""
        for surface in self.surfaces.values():
            self.put(surface)

    @property
    def empty(self) -> bool:
        """Whether there is nothing to touch."""
        return not self._contacts

    def feel(self, position: Vector, velocity: Vector, dt_s: float) -> Touch:
        """What is felt with the TCP at a position (m) and a velocity (m/s), in the base.

        Friction remembers that the TCP has been here; with a time `dt_s` of 0 it does not. In free space all
        is exactly 0.
        """
        remember = dt_s > 0.0
        felt: Touch | None = None
        for contact in self._contacts.values():
            found = contact.press(position, velocity, remember)
            if found is not None:
                felt = found if felt is None else _sum(felt, found)
        return NOTHING if felt is None else felt


class _Contact:
    """A surface, what holds the TCP on it, and through which face the TCP has come in."""

    def __init__(self, surface: Surface, radius: float) -> None:
        self.surface = surface
        self._radius = radius
        self._reach_squared = (surface.shape.extent + radius) ** 2
        self._anchor: Vector | None = None
        self._was: Vector | None = None  # the TCP in the shape's frame, when it was near last
        self._face: Face | None = None  # through which the TCP has come in
        # What every tick needs, taken out once.
        self._plane = _plane(surface, radius) if isinstance(surface.shape, Plane) else None
        self._place = (*surface.pose.rotation, *surface.pose.translation)
        self._material = surface.stiffness, surface.damping, surface.friction

    def press(self, position: Vector, velocity: Vector, remember: bool) -> Touch | None:
        """What this surface does to the robot; None if it is not touched."""
        px, py, pz = position
        if self._plane is not None:
            nx, ny, nz, height = self._plane
            depth = height - (nx * px + ny * py + nz * pz)
        else:
            depth, nx, ny, nz = self._depth(px, py, pz, remember)
        if depth <= 0.0:
            if remember:
                self._anchor = None
            return None
        vx, vy, vz = velocity
        stiffness, damping, friction = self._material
        damped = 1.0 - damping * (vx * nx + vy * ny + vz * nz)
        normal = stiffness * depth * damped if damped > 0.0 else 0.0
        if friction == 0.0:
            return Touch((normal * nx, normal * ny, normal * nz), (0.0, 0.0, 0.0))
        anchor = self._anchor
        if anchor is None:
            if remember:
                self._anchor = position
            return Touch((normal * nx, normal * ny, normal * nz), (0.0, 0.0, 0.0))
        # Friction: along the surface, and at most so much.
        limit = friction * normal
        longest = limit / stiffness
        x, y, z, length = _along(nx, ny, nz, position, anchor)
        if remember and length > longest + SLIP_M:
            # What follows is found from the new anchor, as it will be when the TCP is still here.
            share = longest / length
            self._anchor = anchor = (px + share * x, py + share * y, pz + share * z)
            x, y, z, length = _along(nx, ny, nz, position, anchor)
        held = stiffness if length <= longest else limit / length
        x, y, z = held * x, held * y, held * z
        radius = self._radius
        force = (normal * nx + x, normal * ny + y, normal * nz + z)
        torque = (radius * (nz * y - ny * z), radius * (nx * z - nz * x), radius * (ny * x - nx * y))
        return _new(Touch, (force, torque))

    def _depth(self, x: float, y: float, z: float, remember: bool) -> Nearest:
        """How deep (m) the sphere is in the surface, 0 where it is not, and the direction out of it."""
        r0, r1, r2, r3, r4, r5, r6, r7, r8, ox, oy, oz = self._place
        x, y, z = x - ox, y - oy, z - oz
        if self._face is None and x * x + y * y + z * z >= self._reach_squared:
            if remember:
                self._was = None
            return _FAR
        x, y, z = r0 * x + r3 * y + r6 * z, r1 * x + r4 * y + r7 * z, r2 * x + r5 * y + r8 * z
        found, face = self._seen(x, y, z)
        if remember:
            self._was, self._face = (x, y, z), face
        distance, nx, ny, nz = found
        depth = self._radius - distance
        if depth <= 0.0:
            return _FAR
        return (
            depth,
            r0 * nx + r1 * ny + r2 * nz,
            r3 * nx + r4 * ny + r5 * nz,
            r6 * nx + r7 * ny + r8 * nz,
        )

    def _seen(self, x: float, y: float, z: float) -> tuple[Nearest, Face | None]:
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


def _along(nx: float, ny: float, nz: float, start: Vector, end: Vector) -> tuple[float, float, float, float]:
    """The part of a way that is along the surface of this normal, and its length."""
    (ax, ay, az), (bx, by, bz) = start, end
    x, y, z = bx - ax, by - ay, bz - az
    out = x * nx + y * ny + z * nz
    x, y, z = x - out * nx, y - out * ny, z - out * nz
    return (x, y, z, sqrt(x * x + y * y + z * z))


def _plane(surface: Surface, radius: float) -> tuple[float, float, float, float]:
    """Which way is out of a plane, and how far from the base's origin (m) a sphere lies on it."""
    (_, _, nx, _, _, ny, _, _, nz), (x, y, z) = surface.pose
    return (nx, ny, nz, nx * x + ny * y + nz * z + radius)


def _sum(a: Touch, b: Touch) -> Touch:
    (ax, ay, az), (bx, by, bz) = a.force, b.force
    (tx, ty, tz), (ux, uy, uz) = a.torque, b.torque
    return Touch((ax + bx, ay + by, az + bz), (tx + ux, ty + uy, tz + uz))

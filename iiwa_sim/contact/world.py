"""The world the TCP touches: surfaces that push back and hold on to it.

**Normal force.** k d (1 + b d'): stiffness times depth, and a damping that grows with the depth (Hunt and
Crossley, 1975, with a linear spring), never less than 0. A spring and a dashpot side by side would jump from
0 to the dashpot's force in the tick of the impact, where a threshold would feel the speed, not the surface,
and they would pull at the end. Here the power lost is k b d d'^2, so no motion gains energy.

**Friction.** A spring of the surface's stiffness between the TCP and an anchor, at first where the TCP came
down. Its force is at most mu times the normal force: beyond that the anchor is dragged along. So a TCP that
stands still keeps the friction it has, and one that turns back unloads the spring first. What the limit cuts
off is lost, nothing is gained. The anchor depends on where the TCP has been, not on how often it was asked.
"""

from collections.abc import Iterable
from math import inf, sqrt
from typing import NamedTuple

from iiwa_sim.contact.shapes import Nearest
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.wrench import Wrench, add
from iiwa_sim.frames import Vector

SLIP_M = 1e-12
"""The anchor is dragged where it is farther away by this than it can be held. Rounding alone would otherwise
move it while the TCP stands still."""


class Touch(NamedTuple):
    """What surfaces do to the robot: N, and Nm about the TCP, along the axes of the base."""

    force: Vector
    torque: Vector


NOTHING = Touch((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

_FAR: Nearest = (inf, 0.0, 0.0, 0.0)


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
        wrench: Wrench | None = None
        for contact in self._contacts.values():
            found = contact.press(position, velocity, dt_s > 0.0)
            if found is not None:
                wrench = found if wrench is None else add(wrench, found)
        return NOTHING if wrench is None else Touch(wrench[:3], wrench[3:])


class _Contact:
    """A surface, and where friction holds the TCP on it."""

    def __init__(self, surface: Surface, radius: float) -> None:
        self.surface = surface
        self._radius = radius
        self._reach_squared = (surface.shape.extent + radius) ** 2
        self._anchor: Vector | None = None

    def press(self, position: Vector, velocity: Vector, remember: bool) -> Wrench | None:
        """What this surface does to the robot, along the axes of the base; None if it is not touched."""
        surface, radius = self.surface, self._radius
        px, py, pz = position
        ox, oy, oz = surface.pose.translation
        near = (px - ox) ** 2 + (py - oy) ** 2 + (pz - oz) ** 2 < self._reach_squared
        distance, nx, ny, nz = surface.nearest(px, py, pz) if near else _FAR
        depth = radius - distance
        if depth <= 0.0:
            if remember:
                self._anchor = None
            return None
        vx, vy, vz = velocity
        damped = 1.0 - surface.damping * (vx * nx + vy * ny + vz * nz)
        normal = surface.stiffness * depth * damped if damped > 0.0 else 0.0
        if surface.friction == 0.0:
            return (normal * nx, normal * ny, normal * nz, 0.0, 0.0, 0.0)
        sx, sy, sz = self._hold(position, (nx, ny, nz), surface.friction * normal, remember)
        return (
            normal * nx + sx,
            normal * ny + sy,
            normal * nz + sz,
            radius * (nz * sy - ny * sz),
            radius * (nx * sz - nz * sx),
            radius * (ny * sx - nx * sy),
        )

    def _hold(self, position: Vector, normal: Vector, limit: float, remember: bool) -> Vector:
        """The friction (N) in the base, along the surface and at most `limit`."""
        if self._anchor is None:
            if remember:
                self._anchor = position
            return (0.0, 0.0, 0.0)
        stiffness = self.surface.stiffness
        longest = limit / stiffness
        x, y, z, length = _along(normal, position, self._anchor)
        if remember and length > longest + SLIP_M:
            # What follows is found from the new anchor, as it will be when the TCP is still here.
            share = longest / length
            px, py, pz = position
            self._anchor = (px + share * x, py + share * y, pz + share * z)
            x, y, z, length = _along(normal, position, self._anchor)
        held = stiffness if length <= longest else limit / length
        return (held * x, held * y, held * z)


def _along(normal: Vector, start: Vector, end: Vector) -> tuple[float, float, float, float]:
    """The part of a way that is along the surface, and its length."""
    nx, ny, nz = normal
    (ax, ay, az), (bx, by, bz) = start, end
    x, y, z = bx - ax, by - ay, bz - az
    out = x * nx + y * ny + z * nz
    x, y, z = x - out * nx, y - out * ny, z - out * nz
    return (x, y, z, sqrt(x * x + y * y + z * z))

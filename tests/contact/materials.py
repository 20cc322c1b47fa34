"""Surfaces to touch, and paths over them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.tcp_contact_kernel import TcpContact
from iiwa_sim.frames import IDENTITY, Transform, Vector


class Touch(NamedTuple):
    """Wrench of surfaces on the robot: N, and Nm about the TCP, along the axes of the base."""

    force: Vector
    torque: Vector


NO_TOUCH = Touch((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

RADIUS = 0.005
STIFFNESS = 20_000.0
REST: Vector = (0.0, 0.0, 0.0)
PLANE, BOX, BALL, ROD = Plane(), Box(0.1, 0.1, 0.1), Sphere(0.1), Cylinder(0.1, 0.1)
SHAPES: list[Shape] = [PLANE, BOX, BALL, ROD]


def at(x_m: float, y_m: float, z_m: float) -> Transform:
    return Transform(IDENTITY.rotation, (x_m, y_m, z_m))


def surface(
    shape: Shape = PLANE,
    pose: Transform = IDENTITY,
    *,
    name: str = "it",
    stiffness: float = STIFFNESS,
    damping: float = 0.0,
    friction: float = 0.0,
) -> Surface:
    return Surface(name, shape, pose, stiffness, damping, friction)


class World(TcpContact):
    """Surfaces and the TCP, with vectors in place of numbers."""

    def touch(self, place: Vector, velocity: Vector, tick_s: float) -> Touch:
        """Return the contact there; it is remembered unless the tick takes no time."""
        acting = np.zeros(6)
        if not self.acts_at(*place, *velocity, tick_s > 0.0, acting):
            return NO_TOUCH
        fx, fy, fz, tx, ty, tz = acting.tolist()
        return Touch((fx, fy, fz), (tx, ty, tz))

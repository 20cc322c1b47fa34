"""Surfaces to touch, and paths over them."""

from __future__ import annotations

from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import IDENTITY, Transform, Vector

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

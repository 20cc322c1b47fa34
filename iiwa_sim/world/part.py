"""Parts: rigid bodies that move freely, until a gripper holds them."""

from __future__ import annotations

from typing import NamedTuple

from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.frames import Vector

LIES, FALLS, HELD, GONE = "lies", "falls", "held", "gone"
"""States of a part: it touches something, touches nothing, is held by the gripper, or has left the cell."""


class Mesh(NamedTuple):
    """The convex hull of triangles."""

    corners: tuple[Vector, ...]  # three for each triangle (m, in the frame of the part)


class Part(NamedTuple):
    """A rigid body of one material and even density."""

    name: str
    shape: Box | Cylinder | Sphere | Mesh
    mass_kg: float
    friction: float  # Coulomb's, against everything that it touches
    stiffness: float  # N/m, in series with that of the touched body

"""A surface of the world: a shape in its place, of some material."""

from typing import NamedTuple

from iiwa_sim.contact.shapes import Nearest, Shape
from iiwa_sim.frames import Transform


class Surface(NamedTuple):
    """What the TCP can touch."""

    name: str
    shape: Shape
    pose: Transform
    """Of the shape, in the base."""
    stiffness: float
    """N/m"""
    damping: float
    """s/m: by this share the normal force grows for each m/s at which the surface is pressed in."""
    friction: float
    """Coulomb's coefficient."""

    def nearest(self, x: float, y: float, z: float) -> Nearest:
        """Of a point in the base (m): the signed distance (m), and the direction out of the surface, in the
        base. See `iiwa_sim.contact.shapes`."""
        (r0, r1, r2, r3, r4, r5, r6, r7, r8), (tx, ty, tz) = self.pose
        x -= tx
        y -= ty
        z -= tz
        distance, nx, ny, nz = self.shape.nearest(
            r0 * x + r3 * y + r6 * z, r1 * x + r4 * y + r7 * z, r2 * x + r5 * y + r8 * z
        )
        return (
            distance,
            r0 * nx + r1 * ny + r2 * nz,
            r3 * nx + r4 * ny + r5 * nz,
            r6 * nx + r7 * ny + r8 * nz,
        )

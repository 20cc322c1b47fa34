"""A surface of the world: a shape at a pose, with material properties."""

from typing import NamedTuple

from iiwa_sim.contact.shapes import Nearest, Shape
from iiwa_sim.frames import Transform, Vector


class Surface(NamedTuple):
    """A surface that the TCP can touch."""

    name: str
    shape: Shape
    pose: Transform
    """Pose of the shape in the base."""
    stiffness: float
    """N/m"""
    damping: float
    """s/m: the normal force grows by this fraction for each m/s of penetration speed."""
    friction: float
    """Coefficient of Coulomb friction."""
    surface_velocity: Vector = (0.0, 0.0, 0.0)
    """Velocity (m/s, in the frame of the shape) at which it carries parts, as a conveyor does."""

    def nearest(self, x: float, y: float, z: float) -> Nearest:
        """Signed distance (m) of a point in the base (m), and outward direction in the base. See
        `iiwa_sim.contact.shapes`."""
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

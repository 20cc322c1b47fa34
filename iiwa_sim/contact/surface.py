"""A surface of the world: a shape at a pose, with material properties."""

from typing import NamedTuple

from iiwa_sim.contact.shapes import Nearest, Shape
from iiwa_sim.frames import Transform, Vector, apply, inverse, rotate


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
        """Signed distance (m) of a point in the base (m), and outward direction there: see `shapes`."""
        distance, *direction = self.shape.nearest(*apply(inverse(self.pose), (x, y, z)))
        nx, ny, nz = rotate(self.pose.rotation, (direction[0], direction[1], direction[2]))
        return (distance, nx, ny, nz)

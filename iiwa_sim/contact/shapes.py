"""Shapes of surfaces: signed distance of a point and outward direction, in closed form.

Lengths are metres, in the shape's own frame. The signed distance is that to the nearest point of the surface,
negative within the material. The direction is the unit vector along which the distance grows. If several are
equally good, as in the middle of a sphere, it is always the same one.

`follow` keeps the side by which a point has entered a finite body, which so has no far side. A box, and the
inner half of a round body, is the half-space behind a tangent plane.
"""

from __future__ import annotations

from math import copysign, hypot
from typing import NamedTuple

Nearest = tuple[float, float, float, float]
"""Signed distance (m), and the three components of the direction."""
Point = tuple[float, float, float]
Side = tuple[float, float, float, float, bool] | None
"""Tangent plane: outward direction, distance (m) from the origin, and whether the point is behind it."""
FLAT_M = 1e-12
"""A point of a flat face is no farther from it."""


class Plane(NamedTuple):
    """A half-space: all below the x-y plane is material."""

    def nearest(self, _x: float, _y: float, z: float) -> Nearest:
        """Return distance and direction for a point."""
        return (z, 0.0, 0.0, 1.0)


class Box(NamedTuple):
    """A box around the origin, its edges along the axes."""

    half_x: float
    half_y: float
    half_z: float

    def nearest(self, x: float, y: float, z: float) -> Nearest:
        """Return distance and direction for a point."""
        beyond_x, beyond_y, beyond_z = abs(x) - self.half_x, abs(y) - self.half_y, abs(z) - self.half_z
        largest = max(beyond_x, beyond_y, beyond_z)
        if largest <= 0.0:  # inside: the nearest face
            axis = (beyond_x, beyond_y, beyond_z).index(largest)
            x, y, z = (copysign(float(k == axis), each) for k, each in enumerate((x, y, z)))
            return (largest, x, y, z)
        out_x = copysign(beyond_x, x) if beyond_x > 0.0 else 0.0
        out_y = copysign(beyond_y, y) if beyond_y > 0.0 else 0.0
        out_z = copysign(beyond_z, z) if beyond_z > 0.0 else 0.0
        distance = hypot(out_x, out_y, out_z)
        return (distance, out_x / distance, out_y / distance, out_z / distance)


class Sphere(NamedTuple):
    """A ball around the origin."""

    radius: float

    def nearest(self, x: float, y: float, z: float) -> Nearest:
        """Return distance and direction for a point."""
        from_centre = hypot(x, y, z)
        if from_centre == 0.0:
            return (-self.radius, 0.0, 0.0, 1.0)
        return (from_centre - self.radius, x / from_centre, y / from_centre, z / from_centre)


class Cylinder(NamedTuple):
    """A solid cylinder around the origin, its axis along z."""

    radius: float
    half_z: float

    def nearest(self, x: float, y: float, z: float) -> Nearest:
        """Return distance and direction for a point."""
        from_axis = hypot(x, y)
        along_x, along_y = (x / from_axis, y / from_axis) if from_axis > 0.0 else (1.0, 0.0)
        beyond_mantle, beyond_end = from_axis - self.radius, abs(z) - self.half_z
        if beyond_end <= 0.0 and beyond_end <= beyond_mantle:
            return (beyond_mantle, along_x, along_y, 0.0)
        if beyond_mantle <= 0.0:
            return (beyond_end, 0.0, 0.0, copysign(1.0, z))
        distance = hypot(beyond_mantle, beyond_end)
        share = beyond_mantle / distance
        return (distance, share * along_x, share * along_y, copysign(beyond_end / distance, z))


Shape = Plane | Box | Sphere | Cylinder


def follow(shape: Box | Sphere | Cylinder, side: Side, end: Point, around: float) -> tuple[Nearest, Side]:
    """Return distance and direction at a point, and the side by which it is in, or would next come in.

    Args:
        shape: The body.
        side: The side of the place before; None if it is not known.
        end: The point (m).
        around: Radius (m) of the sphere whose centre it is.
    """
    nearest, thin = shape.nearest(*end), min(shape)
    is_box = isinstance(shape, Box)
    inner = 0.0 if is_box else 0.5 * max(thin - around, 0.0)  # least depth behind a plane
    x, y, z = end
    if side is not None:
        nx, ny, nz, height, is_in = side
        distance = nx * x + ny * y + nz * z - height
        is_flat = is_box or (isinstance(shape, Cylinder) and nz != 0.0)
        if distance <= -inner and (is_in or is_flat or nearest[0] <= -inner):
            beside = shape.nearest(x - distance * nx, y - distance * ny, z - distance * nz)[0]
            if beside <= (FLAT_M if is_flat else thin):
                return (distance, nx, ny, nz), (nx, ny, nz, height, True)
    distance, nx, ny, nz = nearest
    height = nx * x + ny * y + nz * z - distance
    return nearest, (nx, ny, nz, height, False) if distance > -inner else None

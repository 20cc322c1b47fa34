"""Shapes of surfaces: signed distance of a point and outward direction, in closed form.

Lengths are metres, in the shape's own frame. The signed distance is that to the nearest point of the surface,
negative within the material. The direction is the unit vector along which the distance grows; where several
are equally good, as in the middle of a sphere, it is always the same one.

`follow` keeps the side by which a point has entered a finite body, which so has no far side. A box, and the
inner half of a round body, is the half-space behind a tangent plane. A change of side makes no depth greater,
so none adds energy.
"""

from __future__ import annotations

from math import copysign, dist, hypot
from typing import NamedTuple

Nearest = tuple[float, float, float, float]
"""Signed distance (m), and the three components of the direction."""
Point = tuple[float, float, float]
Side = tuple[float, float, float, float] | None
"""Tangent plane behind which a point is: its outward direction, and its distance (m) from the origin."""
TRACED_M, STEPS = 1e-12, 100
"""Distance at which a path has met a surface, and the most steps along it."""


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
            if largest == beyond_x:
                return (largest, copysign(1.0, x), 0.0, 0.0)
            if largest == beyond_y:
                return (largest, 0.0, copysign(1.0, y), 0.0)
            return (largest, 0.0, 0.0, copysign(1.0, z))
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


def follow(
    shape: Box | Sphere | Cylinder, side: Side, start: Point | None, end: Point, around: float
) -> tuple[Nearest, Side]:
    """Return distance and direction at the end of a straight path, and the side by which it entered.

    Args:
        shape: The body.
        side: The side at the start.
        start: Start of the path (m); None if it is not known.
        end: Its end.
        around: Radius (m) of the sphere whose centre moves.
    """
    nearest, thin = shape.nearest(*end), min(shape)
    inner = 0.0 if isinstance(shape, Box) else 0.5 * max(thin - around, 0.0)  # least depth behind a plane
    if side is None and start is not None and nearest[0] + inner <= dist(start, end):
        side = _entered(shape, inner, start, end)
    if side is not None:
        nx, ny, nz, height = side
        x, y, z = end
        distance = nx * x + ny * y + nz * z - height
        beside = shape.nearest(x - distance * nx, y - distance * ny, z - distance * nz)[0]
        is_flat = isinstance(shape, Box) or (isinstance(shape, Cylinder) and nz != 0.0)
        if distance <= -inner and beside <= (TRACED_M if is_flat else thin):
            return (distance, nx, ny, nz), side
    return nearest, None


def _entered(shape: Box | Sphere | Cylinder, inner: float, start: Point, end: Point) -> Side:
    """Return the plane of the place where a path from outside reaches the inner half, or None."""
    (x, y, z), length, gone = start, dist(start, end), 0.0
    dx, dy, dz = (b - a for a, b in zip(start, end, strict=True))
    for _ in range(STEPS):
        distance, nx, ny, nz = shape.nearest(x, y, z)
        if abs(distance + inner) <= TRACED_M:
            return (nx, ny, nz, nx * x + ny * y + nz * z - distance)
        gone += distance + inner
        if distance < -inner or gone > length:
            break
        share = gone / length
        x, y, z = start[0] + share * dx, start[1] + share * dy, start[2] + share * dz
    return None

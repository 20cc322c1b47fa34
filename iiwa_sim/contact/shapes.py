"""Shapes of surfaces: signed distance of a point and outward direction, in closed form.

Lengths are metres, in the shape's own frame. The signed distance is that to the nearest point of the surface,
negative within the material. The direction is the unit vector along which the distance grows; where several
are equally good, as in the middle of a sphere, it is always the same one.

Flat faces of a finite body are distinguished by the path by which a point has come in. Seen through such a
face, the body has the outline of the face and no far side: a point pressed deep into it, or through it, is as
deep as it is behind the face.
"""

from math import copysign, hypot, inf
from typing import NamedTuple

Nearest = tuple[float, float, float, float]
"""Signed distance (m), and the three components of the direction."""

Point = tuple[float, float, float]
Face = tuple[int, float]
"""A flat face normal to an axis of the shape (0 to 2), on the side of this sign."""


class Plane(NamedTuple):
    """A half-space: all below the x-y plane is material."""

    @property
    def extent(self) -> float:
        """Largest distance of the material from the origin."""
        return inf

    def nearest(self, _x: float, _y: float, z: float) -> Nearest:
        """Distance and direction for a point."""
        return (z, 0.0, 0.0, 1.0)


class Box(NamedTuple):
    """A box round the origin, its edges along the axes."""

    half_x: float
    half_y: float
    half_z: float

    @property
    def extent(self) -> float:
        """Largest distance of the material from the origin."""
        return hypot(self.half_x, self.half_y, self.half_z)

    def nearest(self, x: float, y: float, z: float) -> Nearest:
        """Distance and direction for a point."""
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

    def entered(self, start: Point, end: Point) -> Face | None:
        """The face through which a straight path from outside comes in; None if it does not."""
        entry, leaving, face = -1.0, inf, None
        for axis, (a, b, half) in enumerate(zip(start, end, self, strict=True)):
            way = b - a
            if way == 0.0:
                if abs(a) > half:
                    return None
                continue
            side = -copysign(1.0, way)
            comes, goes = (side * half - a) / way, (-side * half - a) / way
            leaving = min(leaving, goes)
            if comes > entry:
                entry, face = comes, (axis, side)
        return face if 0.0 <= entry <= min(leaving, 1.0) else None

    def behind(self, face: Face, x: float, y: float, z: float) -> Nearest | None:
        """Distance and direction for a point behind a face and within its outline, with respect to that
        face; None elsewhere."""
        axis, side = face
        place = (x, y, z)
        distance = side * place[axis] - self[axis]
        if distance > 0.0 or any(abs(place[k]) > self[k] for k in range(3) if k != axis):
            return None
        return (distance, side * (axis == 0), side * (axis == 1), side * (axis == 2))


class Sphere(NamedTuple):
    """A ball round the origin."""

    radius: float

    @property
    def extent(self) -> float:
        """Largest distance of the material from the origin."""
        return self.radius

    def nearest(self, x: float, y: float, z: float) -> Nearest:
        """Distance and direction for a point."""
        from_centre = hypot(x, y, z)
        if from_centre == 0.0:
            return (-self.radius, 0.0, 0.0, 1.0)
        return (from_centre - self.radius, x / from_centre, y / from_centre, z / from_centre)


class Cylinder(NamedTuple):
    """A solid cylinder round the origin, its axis along z."""

    radius: float
    half_z: float

    @property
    def extent(self) -> float:
        """Largest distance of the material from the origin."""
        return hypot(self.radius, self.half_z)

    def nearest(self, x: float, y: float, z: float) -> Nearest:
        """Distance and direction for a point."""
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

    def entered(self, start: Point, end: Point) -> Face | None:
        """The end through which a straight path from outside comes in; None if it does not."""
        (ax, ay, az), (bx, by, bz) = start, end
        side = copysign(1.0, az)
        if abs(az) < self.half_z or side * bz > self.half_z or az == bz:
            return None
        share = (side * self.half_z - az) / (bz - az)
        if hypot(ax + share * (bx - ax), ay + share * (by - ay)) > self.radius:
            return None
        return (2, side)

    def behind(self, face: Face, x: float, y: float, z: float) -> Nearest | None:
        """Distance and direction for a point behind an end and within its outline, with respect to that
        end; None elsewhere."""
        distance = face[1] * z - self.half_z
        if distance > 0.0 or hypot(x, y) > self.radius:
            return None
        return (distance, 0.0, 0.0, face[1])


Shape = Plane | Box | Sphere | Cylinder

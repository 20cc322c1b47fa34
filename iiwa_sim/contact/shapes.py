"""Shapes of surfaces: signed distance of a point and outward direction, in closed form.

Lengths are metres, in the shape's own frame. The signed distance is that to the nearest point of the surface,
negative within the material. The direction is the unit vector along which the distance grows; where several
are equally good, as in the middle of a sphere, it is always the same one.

By which path a point has come into a finite body makes a difference: `follow` says the distance that it then
has. Seen through a flat face, the body has the outline of the face and no far side: a point pressed deep into
it, or through it, is as deep as it is behind the face. A round surface is left as it was come in by, too:
half-way to its middle the direction stays as it is there, and the point is as deep as it is behind the
tangent plane. What of all this changes on the way makes the depth less, or leaves it as it is: so nobody is
given work by it.
"""

from math import copysign, hypot, inf, sqrt
from typing import NamedTuple

Nearest = tuple[float, float, float, float]
"""Signed distance (m), and the three components of the direction."""

Point = tuple[float, float, float]
Face = tuple[int, float]
"""A flat face normal to an axis of the shape (0 to 2), on the side of this sign."""


class Round(NamedTuple):
    """A round surface, and the unit vector along which it pushes out from half-way to its middle on; three
    zeros in the mantle of a cylinder before that."""

    x: float
    y: float
    z: float


STRAIGHT_OUT = Round(0.0, 0.0, 0.0)
CameIn = Face | Round | None
"""Through what a point has come into a body; None if it is not in it, or was not seen to come in."""


class Plane(NamedTuple):
    """A half-space: all below the x-y plane is material."""

    @property
    def extent(self) -> float:
        """Largest distance of the material from the origin."""
        return inf

    def nearest(self, _x: float, _y: float, z: float) -> Nearest:
        """Distance and direction for a point."""
        return (z, 0.0, 0.0, 1.0)

    def follow(
        self, _came: CameIn, _start: Point | None, end: Point, _around: float
    ) -> tuple[Nearest, CameIn]:
        """Distance and direction for a point: there is no other way in than from above."""
        return self.nearest(*end), None


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

    def follow(self, came: CameIn, start: Point | None, end: Point, _around: float) -> tuple[Nearest, CameIn]:
        """Distance and direction at the `end` of a straight path, and through what the point has come in.

        At its start it had come in through `came`; the start is None if it is not known.
        """
        return _through_a_face(self, came, start, end)

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

    def follow(self, came: CameIn, start: Point | None, end: Point, around: float) -> tuple[Nearest, CameIn]:
        """Distance and direction at the `end` of a straight path, and through what the point has come in.

        At its start it had come in through `came`; the start is None if it is not known. It is the middle of
        a sphere of radius `around`.
        """
        half_way, beside = 0.5 * (self.radius + around), self.radius + around
        if came is None and start is not None:
            met = _enters(half_way, start, end)
            came = None if met is None else Round(*(each / half_way for each in met))
        if isinstance(came, Round):
            along = came.x * end[0] + came.y * end[1] + came.z * end[2]
            across = hypot(end[0] - along * came.x, end[1] - along * came.y, end[2] - along * came.z)
            if along < half_way and across <= beside:
                return (along - self.radius, *came), came
        return self.nearest(*end), None


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

    def follow(self, came: CameIn, start: Point | None, end: Point, around: float) -> tuple[Nearest, CameIn]:
        """Distance and direction at the `end` of a straight path, and through what the point has come in.

        At its start it had come in through `came`; the start is None if it is not known. It is the middle of
        a sphere of radius `around`.
        """
        if not isinstance(came, Round):
            found, face = _through_a_face(self, came, start, end)
            if face is not None or start is None:
                return found, face
        mantle = self._through_the_mantle(came, start, end, around)
        return (self.nearest(*end), None) if mantle is None else mantle

    def _through_the_mantle(
        self, came: CameIn, start: Point | None, end: Point, around: float
    ) -> tuple[Nearest, CameIn] | None:
        """Part of `follow` for a point that has come in through the mantle and is still within its length;
        None for any other."""
        half_way, beside = 0.5 * (self.radius + around), self.radius + around
        x, y, z = end
        if abs(z) > self.half_z:
            return None
        outer = max(half_way, self.radius)
        way = None if start is None else ((start[0], start[1], 0.0), (x, y, 0.0))
        if came is None and start is not None and way is not None:
            share = _enters_at(outer, *way)
            if share is None or abs(start[2] + share * (z - start[2])) > self.half_z:
                return None
            came = STRAIGHT_OUT
        if came == STRAIGHT_OUT and way is not None:
            met = _enters(half_way, *way)
            came = came if met is None else Round(met[0] / half_way, met[1] / half_way, 0.0)
        if isinstance(came, Round) and came != STRAIGHT_OUT:
            along = came.x * x + came.y * y
            if along < half_way and hypot(x - along * came.x, y - along * came.y) <= beside:
                return (along - self.radius, *came), came
        from_axis = hypot(x, y)
        if not 0.0 < from_axis < outer:
            return None
        return (from_axis - self.radius, x / from_axis, y / from_axis, 0.0), STRAIGHT_OUT

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


def _through_a_face(
    shape: Box | Cylinder, came: CameIn, start: Point | None, end: Point
) -> tuple[Nearest, CameIn]:
    """Part of `follow` that concerns flat faces."""
    if isinstance(came, tuple) and not isinstance(came, Round):
        through = shape.behind(came, *end)
        return (shape.nearest(*end), None) if through is None else (through, came)
    nearest = shape.nearest(*end)
    # It has come in, or through, since then: not where it is farther away than it has gone.
    if start is not None and (nearest[0] <= 0.0 or nearest[0] < hypot(*map(_less, end, start))):
        face = shape.entered(start, end)
        through = None if face is None else shape.behind(face, *end)
        if through is not None:
            return through, face
    return nearest, None


def _less(a: float, b: float) -> float:
    return a - b


def _enters(radius: float, start: Point, end: Point) -> Point | None:
    """Return where a straight path from outside enters a sphere around the origin, or None."""
    share = _enters_at(radius, start, end)
    if share is None:
        return None
    (ax, ay, az), (bx, by, bz) = start, end
    return (ax + share * (bx - ax), ay + share * (by - ay), az + share * (bz - az))


def _enters_at(radius: float, start: Point, end: Point) -> float | None:
    """The part of the path, from 0 to 1, at which it enters; None where it does not."""
    (ax, ay, az), (bx, by, bz) = start, end
    dx, dy, dz = bx - ax, by - ay, bz - az
    beyond = ax * ax + ay * ay + az * az - radius * radius
    towards, way = ax * dx + ay * dy + az * dz, dx * dx + dy * dy + dz * dz
    square = towards * towards - way * beyond
    if beyond < 0.0 or towards >= 0.0 or square < 0.0:
        return None
    # The first root of way s^2 + 2 towards s + beyond = 0, without losing digits.
    share = beyond / (sqrt(square) - towards)
    return share if share <= 1.0 else None

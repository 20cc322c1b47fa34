"""Shapes of surfaces: signed distance of a point and outward direction, in closed form.

Lengths are metres, in the shape's own frame. The signed distance is that to the nearest point of the surface,
negative within the material. The direction is the unit vector along which the distance grows; where several
are equally good, as in the middle of a sphere, it is always the same one.

`follow` keeps the side by which a point has entered a finite body. Behind a flat face, within its outline,
the body has no far side. From half-way to the middle of a round body on, it is the half-space behind a
tangent plane. Each change of side makes the depth less, or leaves it as it is; so none adds energy.
"""

from math import copysign, dist, hypot, inf, sqrt
from typing import NamedTuple

Nearest = tuple[float, float, float, float]
"""Signed distance (m), and the three components of the direction."""
Point = tuple[float, float, float]
Side = Point | None
"""Direction that pushes a point out of the body that it has entered; None if it has not been seen to enter.

Three zeros stand for the mantle of a cylinder, farther out than half-way to its axis.
"""
MANTLE: Point = (0.0, 0.0, 0.0)


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

    def follow(self, side: Side, start: Point | None, end: Point, _around: float) -> tuple[Nearest, Side]:
        """Return distance and direction at the `end` of a straight path, and the side by which it entered.

        `side` is that at its start; the start is None if it is not known.
        """
        nearest = self.nearest(*end)
        if side is None and start is not None and nearest[0] <= dist(start, end):
            side = self._entered(start, end)
        if side is not None:
            axis = 0 if side[0] else 1 if side[1] else 2
            distance = side[axis] * end[axis] - self[axis]
            if distance <= 0.0 and all(k == axis or abs(end[k]) <= self[k] for k in range(3)):
                return (distance, *side), side
        return nearest, None

    def _entered(self, start: Point, end: Point) -> Side:
        """Return the direction of the face through which a straight path from outside enters, or None."""
        entry, leaving, face = -1.0, inf, (0, 0.0)
        for axis, (a, b, half) in enumerate(zip(start, end, self, strict=True)):
            way = b - a
            if way == 0.0:
                if abs(a) > half:
                    return None
                continue
            sign = -copysign(1.0, way)
            leaving = min(leaving, (-sign * half - a) / way)
            if (sign * half - a) / way > entry:
                entry, face = (sign * half - a) / way, (axis, sign)
        axis, sign = face
        if not 0.0 <= entry <= min(leaving, 1.0):
            return None
        return (sign * (axis == 0), sign * (axis == 1), sign * (axis == 2))


class Sphere(NamedTuple):
    """A ball around the origin."""

    radius: float

    def nearest(self, x: float, y: float, z: float) -> Nearest:
        """Return distance and direction for a point."""
        from_centre = hypot(x, y, z)
        if from_centre == 0.0:
            return (-self.radius, 0.0, 0.0, 1.0)
        return (from_centre - self.radius, x / from_centre, y / from_centre, z / from_centre)

    def follow(self, side: Side, start: Point | None, end: Point, around: float) -> tuple[Nearest, Side]:
        """Return what `Box.follow` does, for the centre of a sphere of radius `around`."""
        if side is None and start is not None:
            side = _direction_entered(0.5 * (self.radius + around), start, end)
        behind = None if side is None else _behind_tangent(self.radius, around, side, end)
        return (self.nearest(*end), None) if behind is None else (behind, side)


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

    def follow(self, side: Side, start: Point | None, end: Point, around: float) -> tuple[Nearest, Side]:
        """Return what `Box.follow` does, for the centre of a sphere of radius `around`."""
        nearest = self.nearest(*end)
        if side is None and start is not None and nearest[0] <= dist(start, end):
            side = self._end_entered(start, end)
        if side is not None and side[2]:
            distance = side[2] * end[2] - self.half_z
            if distance <= 0.0 and hypot(end[0], end[1]) <= self.radius:
                return (distance, *side), side
        return self._follow_mantle(side, start, end, around) or (nearest, None)

    def _follow_mantle(
        self, side: Side, start: Point | None, end: Point, around: float
    ) -> tuple[Nearest, Side] | None:
        """Return `follow` for a point that entered by the mantle and is within its length, or None."""
        half_way = 0.5 * (self.radius + around)
        outer = max(half_way, self.radius)
        x, y, z = end
        if start is None or abs(z) > self.half_z:
            return None
        flat_start, flat_end = (start[0], start[1], 0.0), (x, y, 0.0)
        if side is None:
            share = _share_entered(outer, flat_start, flat_end)
            if share is None or abs(start[2] + share * (z - start[2])) > self.half_z:
                return None
            side = MANTLE
        if side == MANTLE:
            side = _direction_entered(half_way, flat_start, flat_end) or MANTLE
        if side != MANTLE and not side[2]:
            behind = _behind_tangent(self.radius, around, side, flat_end)
            if behind is not None:
                return behind, side
        from_axis = hypot(x, y)
        if not 0.0 < from_axis < outer:
            return None
        return (from_axis - self.radius, x / from_axis, y / from_axis, 0.0), MANTLE

    def _end_entered(self, start: Point, end: Point) -> Side:
        """Return the direction of the end through which a straight path from outside enters, or None."""
        (ax, ay, az), (bx, by, bz) = start, end
        sign = copysign(1.0, az)
        if abs(az) < self.half_z or sign * bz > self.half_z or az == bz:
            return None
        share = (sign * self.half_z - az) / (bz - az)
        if hypot(ax + share * (bx - ax), ay + share * (by - ay)) > self.radius:
            return None
        return (0.0, 0.0, sign)


Shape = Plane | Box | Sphere | Cylinder


def _behind_tangent(radius: float, around: float, side: Point, end: Point) -> Nearest | None:
    """Return distance and direction for a point that is farther in than half-way, or None."""
    along = side[0] * end[0] + side[1] * end[1] + side[2] * end[2]
    across = hypot(end[0] - along * side[0], end[1] - along * side[1], end[2] - along * side[2])
    if along >= 0.5 * (radius + around) or across > radius + around:
        return None
    return (along - radius, *side)


def _direction_entered(radius: float, start: Point, end: Point) -> Side:
    """Return the direction from the origin at which a straight path enters a sphere around it, or None."""
    share = _share_entered(radius, start, end)
    if share is None:
        return None
    (ax, ay, az), (bx, by, bz) = start, end
    return (
        (ax + share * (bx - ax)) / radius,
        (ay + share * (by - ay)) / radius,
        (az + share * (bz - az)) / radius,
    )


def _share_entered(radius: float, start: Point, end: Point) -> float | None:
    """Return the share of the path, 0 to 1, at which it enters the sphere, or None."""
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

"""Surfaces and other bodies as polygons: cut off at a box of the scene, and as outlines in a view."""

from collections.abc import Sequence

import numpy as np

from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.plot.record import Array
from iiwa_sim.plot.things import Rod, Solid

_AROUND = 36  # edges of what is round
_RINGS = 12  # of a sphere, from pole to pole
_ENDLESS_M = 50.0  # half an edge of what is drawn of a plane
_SLANT = 1e-6  # of a plane against the direction of a view: less is seen as an edge


def polygons(surface: Surface | Solid) -> list[Array]:
    """The faces of a surface, flat and convex: each (n, 3), mm in the base."""
    rotation = np.array(surface.pose.rotation).reshape(3, 3)
    place = np.array(surface.pose.translation)
    return [1e3 * (np.array(face) @ rotation.T + place) for face in _faces(surface)]


def cut_off(polygon: Array, low: Array, high: Array) -> Array:
    """The part of a convex polygon (n, 3) within a box from corner `low` to corner `high`: (m, 3)."""
    for axis in range(3):
        for sign, bound in ((1.0, high[axis]), (-1.0, -low[axis])):
            polygon = _within(polygon, sign * polygon[:, axis] - bound)
    return polygon


def outline(surface: Surface | Solid, axes: tuple[int, int]) -> Array | None:
    """What a surface covers in a view of two axes of the base: the corners (n, 2) of a convex polygon, mm.

    Of a plane that is the material, seen from the side. None for a plane that covers all of the view.
    """
    if isinstance(surface.shape, Plane):
        (along,) = {0, 1, 2} - set(axes)
        normal = np.array(surface.pose.rotation[2::3])
        if abs(normal[along]) > _SLANT:
            return None
        up = normal[list(axes)]
        across = np.array([-up[1], up[0]])
        middle = np.array(surface.pose.translation)[list(axes)]
        ends = [across, -across, -across - 2.0 * up, across - 2.0 * up]
        return np.array([1e3 * (middle + _ENDLESS_M * each) for each in ends])
    return _hull(np.concatenate(polygons(surface))[:, list(axes)])


def _faces(surface: Surface | Solid) -> Sequence[Array | Sequence[Sequence[float]]]:
    """Faces of a solid, in the frame of its shape (m)."""
    shape = surface.shape
    if isinstance(shape, Box):
        return _box(shape)
    if isinstance(shape, Cylinder):
        angles = np.linspace(0.0, 2.0 * np.pi, _AROUND + 1)
        lower, upper = (
            [(shape.radius * np.cos(a), shape.radius * np.sin(a), z) for a in angles]
            for z in (-shape.half_z, shape.half_z)
        )
        mantle = [[lower[each], lower[each + 1], upper[each + 1], upper[each]] for each in range(_AROUND)]
        return [lower[:-1], upper[:-1], *mantle]
    if isinstance(shape, Sphere):
        return _round_ends(shape.radius, 0.0)
    if isinstance(shape, Rod):
        return _round_ends(shape.radius, shape.half_z)
    far = _ENDLESS_M
    return [[(-far, -far, 0.0), (far, -far, 0.0), (far, far, 0.0), (-far, far, 0.0)]]


def _box(box: Box) -> list[Array]:
    corners = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
    return [
        np.array([np.roll((side, a, b), axis) for a, b in corners]) * box
        for axis in range(3)
        for side in (-1.0, 1.0)
    ]


def _round_ends(radius: float, half_z: float) -> list[list[tuple[float, ...]]]:
    """A cylinder along z between two halves of a sphere, whose middles are `half_z` off the origin."""
    half = _RINGS // 2
    heights = [np.pi * ring / _RINGS for ring in range(_RINGS + 1)]
    rings = [(height, half_z) for height in heights[: half + 1]]
    rings += [(height, -half_z) for height in heights[half if half_z else half + 1 :]]

    def point(ring: int, place: int) -> tuple[float, ...]:
        (height, middle), angle = rings[ring], 2.0 * np.pi * place / _AROUND
        flat = radius * np.sin(height)
        return (flat * np.cos(angle), flat * np.sin(angle), radius * np.cos(height) + middle)

    return [
        [point(ring, place), point(ring + 1, place), point(ring + 1, place + 1), point(ring, place + 1)]
        for ring in range(len(rings) - 1)
        for place in range(_AROUND)
    ]


def _within(polygon: Array, beyond: Array) -> Array:
    """The part where `beyond`, linear over the polygon and given at its corners, is at most 0."""
    kept = []
    for here, there, out, next_out in zip(
        polygon, np.roll(polygon, -1, axis=0), beyond, np.roll(beyond, -1), strict=True
    ):
        if out <= 0.0:
            kept.append(here)
        if (out <= 0.0) is not (next_out <= 0.0):
            kept.append(here + (there - here) * out / (out - next_out))
    return np.array(kept).reshape(-1, 3)


def _hull(points: Array) -> Array:
    """The convex hull of points (n, 2), counterclockwise."""
    ordered = sorted({(float(x), float(y)) for x, y in points})

    def half(way: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
        found: list[tuple[float, float]] = []
        for x, y in way:
            while len(found) > 1 and _turn(found[-2], found[-1], (x, y)) <= 0.0:
                found.pop()
            found.append((x, y))
        return found[:-1]

    return np.array(half(ordered) + half(ordered[::-1]))


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])

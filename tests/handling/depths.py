"""How deep parts that lie are in each other, by places within them."""

from __future__ import annotations

from itertools import combinations, product
from math import dist

from iiwa_sim.contact.shapes import Box, Cylinder, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import apply
from iiwa_sim.handling.falling import sag
from iiwa_sim.handling.pressing_kernel import solid_of
from iiwa_sim.handling.workpieces import Workpieces


def deepest_mm(pieces: Workpieces) -> float:
    """How deep parts that lie are in each other, at worst, besides what the upper one sinks in by its weight:
    places within each of them, in the others."""
    lying = sorted((pieces.bodies[name] for name in pieces.lying), key=lambda each: each.pose.translation[2])
    deepest_m = 0.0
    for one, upper in combinations(lying, 2):
        face, a, b = pieces.face_below(upper.part.name), solid_of(one), solid_of(upper)
        sunk_m = 0.0 if face is None else sag(upper.part, face)
        deepest_m = max(deepest_m, max(depth_m(a, b), depth_m(b, a)) - sunk_m)
    return 1e3 * deepest_m


def depth_m(one: Surface, other: Surface) -> float:
    if dist(one.pose.translation, other.pose.translation) > one.shape.extent + other.shape.extent:
        return 0.0
    halves = _halves(one.shape)
    grid = product((-0.99, -0.5, 0.0, 0.5, 0.99), repeat=3)
    places = [tuple(part * half for part, half in zip(each, halves, strict=True)) for each in grid]
    within = [each for each in places if one.shape.nearest(*each)[0] < 0.0]
    return max(-other.nearest(*apply(one.pose, each))[0] for each in within)


def _halves(shape: Shape) -> tuple[float, float, float]:
    if isinstance(shape, Box):
        return (shape.half_x, shape.half_y, shape.half_z)
    radius = shape.extent if isinstance(shape, Sphere) else shape.radius  # type: ignore[union-attr]
    return (radius, radius, shape.half_z if isinstance(shape, Cylinder) else radius)

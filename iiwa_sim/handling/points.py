"""The points at which a part touches what is round it: corners, rims, or spheres within it."""

from __future__ import annotations

from math import cos, pi, sin
from typing import NamedTuple

from iiwa_sim.contact.shapes import Box, Sphere
from iiwa_sim.frames import Vector
from iiwa_sim.handling.part import Part

INSET_M = 1e-9
"""Corners and rims are so far within their part: one that is put on another of its size, turned by rounding
alone, would else have all its corners beside the other's face, and none of that in its own."""
RIM = 8
"""Points on each rim of a cylinder."""
_RIM = [(cos(2.0 * pi * k / RIM), sin(2.0 * pi * k / RIM)) for k in range(RIM)]


class Points(NamedTuple):
    """Small spheres that stand for a part."""

    places: tuple[Vector, ...]
    """Places in the part (m)."""
    radius_m: float
    at_once: int
    """How many of them touch a face on which it lies: each has this part of the stiffness."""


def points_of(part: Part, upright: bool) -> Points:
    """The points at which a part touches: of a cylinder its rims where it is `upright`, else two spheres."""
    shape = part.shape
    if isinstance(shape, Sphere):
        return Points(((0.0, 0.0, 0.0),), shape.radius, 1)
    if isinstance(shape, Box):
        ends = ((INSET_M - half, half - INSET_M) for half in shape)
        xs, ys, zs = ends
        return Points(tuple((x, y, z) for x in xs for y in ys for z in zs), 0.0, 4)
    r, h = shape
    if upright:
        r -= INSET_M
        return Points(tuple((r * c, r * s, z) for z in (-h, h) for c, s in _RIM), 0.0, RIM)
    end = max(0.0, h - r)
    return Points(((0.0, 0.0, -end), (0.0, 0.0, end)), r, 2)

"""How mass is spread in a body: the ten numbers that its weight and inertia follow from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from iiwa_sim.frames import Transform, Vector, rotate

GRAVITY_M_S2 = 9.81
"""Down is against z of the base: the robot stands upright."""


class Moments(NamedTuple):
    """Integrals over the mass of a body of 1, of the place r, and of r r^T, in some frame.

    They add up over bodies that are fixed to each other, and a difference of two is as good as a body.
    """

    mass: float
    """kg"""
    x: float
    """kg m: the mass times the centre of mass."""
    y: float
    z: float
    xx: float
    """kg m^2, about the origin of the frame: what inertia is made of."""
    yy: float
    zz: float
    xy: float
    xz: float
    yz: float


NO_MOMENTS = Moments(*[0.0] * 10)


def body(mass_kg: float, centre: Vector, inertia: Sequence[float] = (0.0,) * 6) -> Moments:
    """Moments of a body with its centre of mass at a place (m) and an inertia about that.

    `inertia` (kg m^2) has ixx, iyy, izz, ixy, ixz, iyz along the axes of the frame, with the signs of URDF:
    ixy is minus the integral of x y.
    """
    ixx, iyy, izz, ixy, ixz, iyz = inertia
    half = 0.5 * (ixx + iyy + izz)
    x, y, z = centre
    return Moments(
        mass_kg,
        mass_kg * x,
        mass_kg * y,
        mass_kg * z,
        half - ixx + mass_kg * x * x,
        half - iyy + mass_kg * y * y,
        half - izz + mass_kg * z * z,
        mass_kg * x * y - ixy,
        mass_kg * x * z - ixz,
        mass_kg * y * z - iyz,
    )


def added(a: Moments, b: Moments) -> Moments:
    """Moments of two bodies together."""
    return Moments(*(one + other for one, other in zip(a, b, strict=True)))


def difference(a: Moments, b: Moments) -> Moments:
    """What a has more than b."""
    return Moments(*(one - other for one, other in zip(a, b, strict=True)))


def seen_from(moments: Moments, frame: Transform) -> Moments:
    """Moments in an outer frame, of those in another frame whose pose in the outer one is `frame` (m)."""
    mass, *first = moments[:4]
    xx, yy, zz, xy, xz, yz = moments[4:]
    turned = frame.rotation
    rows = [rotate(turned, row) for row in ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))]
    columns = [rotate(turned, column) for column in zip(*rows, strict=True)]  # R J R^T, by its symmetry
    s = rotate(turned, (first[0], first[1], first[2]))
    t = frame.translation

    def second(i: int, j: int) -> float:
        return columns[i][j] + s[i] * t[j] + t[i] * s[j] + mass * t[i] * t[j]

    return Moments(
        mass,
        *(s[i] + mass * t[i] for i in range(3)),
        *(second(i, j) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))),
    )

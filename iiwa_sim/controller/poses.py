"""Where the TCP shall be: told with a quaternion, or seen from where a move begins."""

from math import hypot, isfinite

from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.frames import (
    Frame,
    Quaternion,
    Transform,
    Vector,
    compose,
    multiply,
    rotation_from_quaternion,
)

QUATERNION_LENGTH_TOLERANCE = 0.01
"""Enough for four numbers with two decimals, such as 0.71 0 0 0.71."""


def from_quaternion(position_mm: Vector, quaternion: Quaternion) -> Frame:
    """The frame of a position (mm) and a quaternion x, y, z, w, which is made one of unit length.

    Raises `Refused` where its length is not 1, within the tolerance.
    """
    length = hypot(*quaternion)
    if not (isfinite(length) and abs(length - 1.0) <= QUATERNION_LENGTH_TOLERANCE):
        expected = f"expected 1, within {QUATERNION_LENGTH_TOLERANCE:g}"
        raise Refused(EXECUTION, f"a quaternion of length {length:g}: {expected}")
    turned = Frame.from_transform(Transform(rotation_from_quaternion(quaternion), (0.0, 0.0, 0.0)))
    x_mm, y_mm, z_mm = position_mm
    return turned._replace(x_mm=x_mm, y_mm=y_mm, z_mm=z_mm)


def shifted(start: Transform, shift: Frame, *, in_tool: bool) -> Frame:
    """The frame of the TCP that has gone from `start`, in the base, by a shift in the axes of base or tool.

    The TCP goes by x, y, z and turns about itself by Rz(alpha) Ry(beta) Rx(gamma), both in those axes.
    """
    way = shift.to_transform()
    if in_tool:
        return Frame.from_transform(compose(start, way))
    x, y, z = (a + b for a, b in zip(start.translation, way.translation, strict=True))
    return Frame.from_transform(Transform(multiply(way.rotation, start.rotation), (x, y, z)))

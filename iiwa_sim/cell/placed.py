"""Keys that surfaces and parts of cell.toml share: name, pose, friction, stiffness."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.frames import Frame, Transform
from iiwa_sim.robot.description import ANGLE, LENGTH
from iiwa_sim.settings import Range, Reader

POSE_RANGES: dict[str, Range] = {
    "x_mm": LENGTH,
    "y_mm": LENGTH,
    "z_mm": LENGTH,
    "alpha": ANGLE,
    "beta": ANGLE,
    "gamma": ANGLE,
}
"""Least and greatest value, and the unit, of each key of a pose."""


def body_ranges(size: Range, **others: Range) -> dict[str, Range]:
    """The ranges of the keys of a body: of its pose and its material, `size` for each length of its shape,
    and others."""
    return {
        **POSE_RANGES,
        "stiffness_n_per_m": (1.0, 1e7, " N/m"),
        "friction": (0.0, 10.0, ""),
        **others,
        **dict.fromkeys(("size_mm", "radius_mm", "length_mm"), size),
    }


class Placed(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A name and a pose in the world, the base of a single robot: mm, and rad about z, y and x."""

    name: str
    x_mm: float = 0.0
    y_mm: float = 0.0
    z_mm: float = 0.0
    alpha: float = 0.0
    beta: float = 0.0
    gamma: float = 0.0

    def pose(self) -> Transform:
        """The body's frame in the base (m)."""
        return Frame(self.x_mm, self.y_mm, self.z_mm, self.alpha, self.beta, self.gamma).to_transform()


def check_ranges(
    reader: Reader, prefix: str, settings: msgspec.Struct, ranges: Mapping[str, Range], suffix: str = ""
) -> None:
    """Raises an error if a number, or one of several under a key, is out of its range.

    `prefix` is put before the keys in the message, and `suffix` behind them.
    """
    for key in settings.__struct_fields__:
        if key not in ranges:
            continue
        value = getattr(settings, key)
        if isinstance(value, float | int):
            reader.check_range(f"{prefix}{key}{suffix}", value, ranges[key])
        else:
            for index, each in enumerate(value):
                reader.check_range(f"{prefix}{key}[{index}]{suffix}", each, ranges[key])


def box(size_mm: tuple[float, float, float]) -> Box:
    """The shape with edges of this size."""
    x_mm, y_mm, z_mm = size_mm
    return Box(0.5e-3 * x_mm, 0.5e-3 * y_mm, 0.5e-3 * z_mm)


def sphere(radius_mm: float) -> Sphere:
    """The shape with this radius."""
    return Sphere(1e-3 * radius_mm)


def cylinder(radius_mm: float, length_mm: float) -> Cylinder:
    """The shape with this radius and length."""
    return Cylinder(1e-3 * radius_mm, 0.5e-3 * length_mm)

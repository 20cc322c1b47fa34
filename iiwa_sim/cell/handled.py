"""What a robot works with, as cell.toml has it. The reference for users is docs/cell.md."""

from __future__ import annotations

from collections.abc import Sequence
from math import dist

import msgspec

from iiwa_sim.cell.placed import Placed, body_ranges, box, check_ranges, cylinder, sphere
from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.handling import NOTHING, SENSORS, Wiring
from iiwa_sim.frames import Transform, Vector, apply
from iiwa_sim.handling.gripper import Jaws
from iiwa_sim.handling.lying import CLOSE_M
from iiwa_sim.handling.part import LEVEL, Part
from iiwa_sim.handling.points import points_of
from iiwa_sim.settings import Range, Reader

GRIPPER_RANGES: dict[str, Range] = {
    "gripper.stroke_mm": (0.1, 1000.0, " mm"),
    "gripper.speed_mm_per_s": (0.1, 10_000.0, " mm/s"),
    "gripper.grip_force_n": (0.1, 100_000.0, " N"),
}
_SIZE: Range = (0.1, 1000.0, " mm")
PART_RANGES = body_ranges(_SIZE, mass_kg=(0.001, 1000.0, " kg"))
"""Least and greatest value, and the unit."""
MOST_PARTS = 256


class GripperSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Two jaws, and what switches and tells of them."""

    stroke_mm: float
    speed_mm_per_s: float
    grip_force_n: float
    close_output: int
    open_output: int | None = None
    open_input: int | None = None
    closed_input: int | None = None
    holds_input: int | None = None
    pad_mm: tuple[float, float] = (20.0, 20.0)
    jaw_mm: tuple[float, float, float] = (20.0, 8.0, 50.0)

    def gripper(self) -> tuple[Jaws, Wiring]:
        """What a controller takes."""
        wired = (self.open_output, self.open_input, self.closed_input, self.holds_input)
        wide_m, long_m = (1e-3 * each for each in self.pad_mm)
        x, y, z = (1e-3 * each for each in self.jaw_mm)
        return (
            Jaws(
                1e-3 * self.stroke_mm,
                1e-3 * self.speed_mm_per_s,
                self.grip_force_n,
                wide_m,
                long_m,
                (x, y, z),
            ),
            Wiring(self.close_output, *(NOTHING if number is None else number for number in wired)),
        )


class PartSettings(Placed, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="shape"):
    """The keys that all parts have. The pose is that of the middle."""

    mass_kg: float
    friction: float = 0.5
    stiffness_n_per_m: float = 1e5


class BoxPartSettings(PartSettings, frozen=True, forbid_unknown_fields=True, kw_only=True, tag="box"):
    """A part with edges of `size_mm` along x, y and z."""

    size_mm: tuple[float, float, float]

    def solid(self) -> Box:
        return box(self.size_mm)


class CylinderPartSettings(
    PartSettings, frozen=True, forbid_unknown_fields=True, kw_only=True, tag="cylinder"
):
    """A part that is round about z."""

    radius_mm: float
    length_mm: float

    def solid(self) -> Cylinder:
        return cylinder(self.radius_mm, self.length_mm)


class SpherePartSettings(PartSettings, frozen=True, forbid_unknown_fields=True, kw_only=True, tag="sphere"):
    """A part that is a ball."""

    radius_mm: float

    def solid(self) -> Sphere:
        return sphere(self.radius_mm)


AnyPart = BoxPartSettings | CylinderPartSettings | SpherePartSettings


def part_of(settings: AnyPart) -> Part:
    """The part of checked settings, without its place."""
    solid = settings.solid()
    return Part(settings.name, solid, settings.mass_kg, settings.friction, settings.stiffness_n_per_m)


def check_gripper(reader: Reader, gripper: GripperSettings | None, inputs: int, outputs: int) -> None:
    """Raises an error for numbers that no input or output has, and for one that is wired twice."""
    if gripper is None:
        return
    for place, value in enumerate(gripper.pad_mm):
        reader.check_range(f"gripper.pad_mm[{place}]", value, _SIZE)
    for place, value in enumerate(gripper.jaw_mm):
        reader.check_range(f"gripper.jaw_mm[{place}]", value, _SIZE)
    for kind, count, names in (
        ("output", outputs, ("close", "open")),
        ("input", inputs, SENSORS),
    ):
        taken: dict[int, str] = {}
        for name in names:
            key, number = f"{name}_{kind}", getattr(gripper, f"{name}_{kind}")
            if number is None:
                continue
            there = f"one of the {kind}s 1 to {count}" if count else f"none: [io] has no {kind}s"
            reader.check(f"gripper.{key}", number, 1 <= number <= count, there)
            other = taken.setdefault(number, key)
            reader.check(f"gripper.{key}", number, other == key, f"another {kind} than that of {other}")


def check_parts(
    reader: Reader, parts: Sequence[AnyPart], gripper: GripperSettings | None, surfaces: Sequence[str]
) -> None:
    """Raises an error for too many parts, for some without a gripper, for names that are taken, and for
    numbers out of range."""
    reader.check("part", f"{len(parts)} of them", len(parts) <= MOST_PARTS, f"at most {MOST_PARTS}")
    reader.check(
        "part", f"{len(parts)} of them", not parts or gripper is not None, "a [gripper] to work with"
    )
    names = dict.fromkeys(surfaces, "a surface")
    for index, part in enumerate(parts):
        place = f"part[{index}]"
        reader.check_name_in_lines(f"{place}.name", part.name)
        taken = names.setdefault(part.name, place)
        reader.check(f"{place}.name", part.name, taken == place, f"another name than that of {taken}")
        check_ranges(reader, f"{place}.", part, PART_RANGES, f" of {part.name!r}")


def check_places(reader: Reader, parts: Sequence[AnyPart], surfaces: Sequence[Surface]) -> None:
    """Raises an error for a part that does not lie level, and for one within a surface or another part."""
    solid = list(surfaces)
    for index, settings in enumerate(parts):
        part, pose = part_of(settings), settings.pose()
        angles = [settings.alpha, settings.beta, settings.gamma]
        level = f"angles with which it lies on a face, or a cylinder on its side, to {LEVEL:g} rad"
        key = f"part[{index}].alpha, beta, gamma of {part.name!r}"
        reader.check(key, angles, part.is_level(pose.rotation), level)
        within = _within(part, pose, solid)
        place = [settings.x_mm, settings.y_mm, settings.z_mm]
        outside = f"a place outside of {within!r}, up to {1e3 * CLOSE_M:g} mm"
        reader.check(f"part[{index}].x_mm, y_mm, z_mm of {part.name!r}", place, not within, outside)
        solid.append(Surface(part.name, part.shape, pose, part.stiffness, 0.0, 0.0))


def _within(part: Part, pose: Transform, solid: Sequence[Surface]) -> str:
    """The name of the first of these that a part is within, or that is within it; empty for none."""
    own = Surface(part.name, part.shape, pose, part.stiffness, 0.0, 0.0)
    marks = [apply(pose, place) for place in _marks(part)]
    for each in solid:
        middle = each.pose.translation
        if dist(middle, pose.translation) > each.shape.extent + part.shape.extent:
            continue
        if any(each.nearest(*mark)[0] < -CLOSE_M for mark in marks):
            return each.name
        if isinstance(each.shape, Box | Cylinder | Sphere):
            other = Part(each.name, each.shape, 1.0, 0.0, 1.0)
            if any(own.nearest(*apply(each.pose, mark))[0] < -CLOSE_M for mark in _marks(other)):
                return each.name
    return ""


def _marks(part: Part) -> tuple[Vector, ...]:
    """Places of a part: its middle, and corners, points of its rims, or those along the axes of a ball."""
    if isinstance(part.shape, Sphere):
        r = part.shape.radius
        ways: list[Vector] = [(r, 0.0, 0.0), (0.0, r, 0.0), (0.0, 0.0, r)]
        return (0.0, 0.0, 0.0), *ways, *((-x, -y, -z) for x, y, z in ways)
    return (0.0, 0.0, 0.0), *points_of(part, upright=True).places

"""Gripper and parts of cell.toml. The reference for users is docs/cells.md."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from itertools import product
from math import cos, pi, sin
from pathlib import Path

import msgspec

from iiwa_sim.cell.placed import Placed, body_ranges, box, check_ranges, cylinder, sphere
from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.handling import NOTHING, SENSORS, Wiring
from iiwa_sim.frames import Transform, Vector, apply
from iiwa_sim.settings import Range, Reader
from iiwa_sim.world.gripper import Cup, Jaws
from iiwa_sim.world.part import Mesh, Part

GRIPPER_RANGES: dict[str, Range] = {
    "gripper.stroke_mm": (0.1, 1000.0, " mm"),
    "gripper.speed_mm_per_s": (0.1, 10_000.0, " mm/s"),
    "gripper.grip_force_n": (0.1, 100_000.0, " N"),
    "gripper.cup_radius_mm": (0.1, 1000.0, " mm"),
}
_SIZE: Range = (0.1, 1000.0, " mm")
PART_RANGES = body_ranges(_SIZE, mass_kg=(0.001, 1000.0, " kg"))
"""Least and greatest value, and the unit."""
MOST_PARTS = 256
CLOSE_M = 1e-3
"""A part may be so deep in a surface or another part at the beginning."""


class GripperSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Two jaws or a suction cup, and what switches and tells of them."""

    kind: str = "jaws"
    stroke_mm: float | None = None
    speed_mm_per_s: float | None = None
    grip_force_n: float
    close_output: int
    open_output: int | None = None
    open_input: int | None = None
    closed_input: int | None = None
    holds_input: int | None = None
    pad_mm: tuple[float, float] = (20.0, 20.0)
    jaw_mm: tuple[float, float, float] = (20.0, 8.0, 50.0)
    cup_radius_mm: float = 10.0

    def gripper(self) -> tuple[Jaws | Cup, Wiring]:
        """Return the gripper for the controller, in SI units."""
        wired = (self.open_output, self.open_input, self.closed_input, self.holds_input)
        wiring = Wiring(self.close_output, *(NOTHING if number is None else number for number in wired))
        if self.stroke_mm is None or self.speed_mm_per_s is None:
            return Cup(self.grip_force_n, 1e-3 * self.cup_radius_mm), wiring
        wide_m, long_m = (1e-3 * each for each in self.pad_mm)
        x, y, z = (1e-3 * each for each in self.jaw_mm)
        stroke_m, speed_m = 1e-3 * self.stroke_mm, 1e-3 * self.speed_mm_per_s
        return Jaws(stroke_m, speed_m, self.grip_force_n, wide_m, long_m, (x, y, z)), wiring


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


class MeshPartSettings(PartSettings, frozen=True, forbid_unknown_fields=True, kw_only=True, tag="mesh"):
    """A part that is the convex hull of the triangles in an STL file."""

    mesh: str

    def read(self, reader: Reader, folder: Path, place: str) -> Mesh:
        """Read the mesh (mm), relative to the folder of the cell; raises an error for a file that has
        none."""
        file = folder / self.mesh
        there = self.mesh != "" and file.is_file()
        reader.check(f"{place}.mesh", self.mesh, there, f"the path of an STL file in {folder}")
        corners = read_stl(file.read_bytes())
        count = len(set(corners))
        reader.check(
            f"{place}.mesh",
            self.mesh,
            4 <= count <= MOST_CORNERS,
            f"an STL file with 4 to {MOST_CORNERS} corners",
        )
        mesh = Mesh(tuple((1e-3 * x, 1e-3 * y, 1e-3 * z) for x, y, z in corners))
        flat = "a body with a volume: its corners lie in one plane"
        reader.check(f"{place}.mesh", self.mesh, mesh.is_solid, flat)
        return mesh


AnyPart = BoxPartSettings | CylinderPartSettings | SpherePartSettings | MeshPartSettings
MOST_CORNERS = 5000
"""Corners of a mesh."""


def read_stl(data: bytes) -> list[Vector]:
    """Return the corners of the triangles of an STL file, binary or text, three for each; empty for none."""
    count = int.from_bytes(data[80:84], "little")
    if len(data) == 84 + 50 * count and count:
        numbers = struct.iter_unpack("<12f2x", data[84:])
        return [(row[k], row[k + 1], row[k + 2]) for row in numbers for k in (3, 6, 9)]
    words = [line.split() for line in data.decode("ascii", "replace").splitlines()]
    try:
        found = [(float(x), float(y), float(z)) for name, x, y, z in filter(_is_vertex, words)]
    except ValueError:
        return []
    return found if len(found) % 3 == 0 else []


def _is_vertex(words: list[str]) -> bool:
    return len(words) == 4 and words[0] == "vertex"


def part_of(settings: AnyPart, mesh: Mesh | None) -> Part:
    """The part of checked settings, without its place; `mesh` is its shape where that is in a file."""
    shape: Box | Cylinder | Sphere | Mesh
    if isinstance(settings, MeshPartSettings):
        assert mesh is not None
        shape = mesh
    else:
        shape = settings.solid()
    return Part(settings.name, shape, settings.mass_kg, settings.friction, settings.stiffness_n_per_m)


def check_gripper(reader: Reader, gripper: GripperSettings | None, inputs: int, outputs: int) -> None:
    """Raises an error for numbers that no input or output has, and for one that is wired twice."""
    if gripper is None:
        return
    is_cup = gripper.kind == "suction"
    reader.check("gripper.kind", gripper.kind, is_cup or gripper.kind == "jaws", "'jaws' or 'suction'")
    for key in ("stroke_mm", "speed_mm_per_s"):
        value, expected = getattr(gripper, key), "nothing with suction" if is_cup else "a number"
        reader.check(f"gripper.{key}", value, (value is None) == is_cup, expected)
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


def check_parts(reader: Reader, parts: Sequence[AnyPart], surfaces: Sequence[str]) -> None:
    """Raises an error for too many parts, for names that are taken, and for numbers out of range."""
    reader.check("part", f"{len(parts)} of them", len(parts) <= MOST_PARTS, f"at most {MOST_PARTS}")
    names = dict.fromkeys(surfaces, "a surface")
    for index, part in enumerate(parts):
        place = f"part[{index}]"
        reader.check_name_in_lines(f"{place}.name", part.name)
        taken = names.setdefault(part.name, place)
        reader.check(f"{place}.name", part.name, taken == place, f"another name than that of {taken}")
        check_ranges(reader, f"{place}.", part, PART_RANGES, f" of {part.name!r}")


_ROUND = [(cos(angle), sin(angle)) for angle in (0.25 * pi * k for k in range(8))]


def check_places(
    reader: Reader, parts: Sequence[tuple[Part, Transform]], surfaces: Sequence[Surface]
) -> None:
    """Raises an error for a part within a surface or another part; a mesh counts by its corners."""
    solid = list(surfaces)
    for index, (part, pose) in enumerate(parts):
        within = _within(part, pose, solid)
        place = [round(1e3 * each, 6) for each in pose.translation]
        outside = f"a place outside of {within!r}, up to {1e3 * CLOSE_M:g} mm"
        reader.check(f"part[{index}].x_mm, y_mm, z_mm of {part.name!r}", place, not within, outside)
        if not isinstance(part.shape, Mesh):
            solid.append(Surface(part.name, part.shape, pose, part.stiffness, 0.0, 0.0))


def _within(part: Part, pose: Transform, solid: Sequence[Surface]) -> str:
    """The name of the first of these that a part is within, or that is within it; empty for none."""
    shape = part.shape
    own = None if isinstance(shape, Mesh) else Surface(part.name, shape, pose, part.stiffness, 0.0, 0.0)
    marks = [apply(pose, place) for place in _marks(part)]
    for each in solid:
        if any(each.nearest(*mark)[0] < -CLOSE_M for mark in marks):
            return each.name
        if own is not None and isinstance(each.shape, Box | Cylinder | Sphere):
            other = Part(each.name, each.shape, 1.0, 0.0, 1.0)
            if any(own.nearest(*apply(each.pose, mark))[0] < -CLOSE_M for mark in _marks(other)):
                return each.name
    return ""


def _marks(part: Part) -> tuple[Vector, ...]:
    """Return places of a part: its middle, and corners, points of its rims, or those along the axes of a
    ball."""
    shape = part.shape
    if isinstance(shape, Mesh):
        return shape.corners
    if isinstance(shape, Box):
        signs: list[Vector] = [(x, y, z) for x, y, z in product((-1.0, 1.0), repeat=3)]
        return (0.0, 0.0, 0.0), *((x * shape[0], y * shape[1], z * shape[2]) for x, y, z in signs)
    r, half = shape.radius, shape.half_z if isinstance(shape, Cylinder) else 0.0
    round_it: list[Vector] = [(x * r, y * r, z) for x, y in _ROUND for z in dict.fromkeys((-half, half))]
    ends: list[Vector] = [(0.0, 0.0, half or r), (0.0, 0.0, -half or -r)]
    return (0.0, 0.0, 0.0), *round_it, *ends

"""What Pinocchio has found in a URDF, kept beside it: so a robot that comes along starts without Pinocchio.

The file `fixed_poses.toml` is written by `python -m tools.fixed_poses`. It counts only for the URDF, the
joints and the flange it was made of, and with the rows as they were written, which its checksum tells: for
others Pinocchio is loaded.
"""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from importlib.resources.abc import Traversable
from math import isfinite
from typing import NamedTuple
from zlib import crc32

from iiwa_sim.frames import Transform

POSES_FILE = "fixed_poses.toml"
ROW = 12
"""Numbers of a pose: a rotation, row by row, and a place."""
SAME = 1e-9
"""How far the axes of a rotation may be from unit vectors at right angles."""


class FoundPoses(NamedTuple):
    """Fixed poses as `Tcp` takes them."""

    of: int
    """The checksum of what they were found in, and of themselves."""
    poses: tuple[Transform, ...]


def poses_checksum(urdf: str, joints: Sequence[str], flange: str, poses: Sequence[Transform]) -> int:
    """Checksum of all that the fixed poses depend on, and of their numbers."""
    numbers = map(repr, (number for pose in poses for number in (*pose.rotation, *pose.translation)))
    return crc32("\0".join([urdf, *joints, flange, *numbers]).encode())


def read_found_poses(folder: Traversable) -> FoundPoses | None:
    """What a robot's folder keeps, if it does; what cannot be read there counts as nothing."""
    file = folder / POSES_FILE
    try:
        if not file.is_file():
            return None
        table = tomllib.loads(file.read_text(encoding="utf-8"))
        return FoundPoses(table["of"], tuple(map(_pose, table["poses"])))
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _pose(row: Sequence[object]) -> Transform:
    """Raises ValueError for what is no rotation and a place."""
    numbers = [number for number in row if isinstance(number, float) and isfinite(number)]
    if len(numbers) != len(row) or len(row) != ROW:
        raise ValueError(f"expected {ROW} numbers")
    a, b, c, d, e, f, g, h, i, x, y, z = numbers
    lengths = (a * a + b * b + c * c, d * d + e * e + f * f, g * g + h * h + i * i)
    angles = (a * d + b * e + c * f, a * g + b * h + c * i, d * g + e * h + f * i)
    handed = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    if any(abs(each - 1.0) > SAME for each in (*lengths, handed)) or any(abs(each) > SAME for each in angles):
        raise ValueError("expected a rotation")
    return Transform((a, b, c, d, e, f, g, h, i), (x, y, z))


def written(found: FoundPoses) -> str:
    """The text of the file."""
    rows = [f"    [{', '.join(map(repr, [*pose.rotation, *pose.translation]))}]," for pose in found.poses]
    return "\n".join(
        [
            "# Written by `python -m tools.fixed_poses`: what Pinocchio finds in robot.urdf for the joints",
            "# and the flange of robot.toml. Each row: a rotation, row by row, and a place (m).",
            f"of = {found.of}  # the checksum of these and of the rows: with others this file does not count",
            "poses = [",
            *rows,
            "]",
            "",
        ]
    )

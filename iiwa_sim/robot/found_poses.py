"""What Pinocchio has found in a URDF, kept beside it: so a robot that comes along starts without Pinocchio.

The file `fixed_poses.toml` is written by `python -m tools.fixed_poses`. It counts only for the URDF, the
joints and the flange it was made of, which its checksum tells: for others Pinocchio is loaded.
"""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from importlib.resources.abc import Traversable
from typing import NamedTuple
from zlib import crc32

from iiwa_sim.frames import Transform

POSES_FILE = "fixed_poses.toml"


class FoundPoses(NamedTuple):
    """Fixed poses as `Tcp` takes them."""

    of: int
    """The checksum of what they were found in."""
    poses: tuple[Transform, ...]


def geometry_checksum(urdf: str, joints: Sequence[str], flange: str) -> int:
    """Of all that the fixed poses depend on."""
    return crc32("\0".join([urdf, *joints, flange]).encode())


def read_found_poses(folder: Traversable) -> FoundPoses | None:
    """What a robot's folder keeps, if it does; what cannot be read there counts as nothing."""
    file = folder / POSES_FILE
    try:
        if not file.is_file():
            return None
        table = tomllib.loads(file.read_text(encoding="utf-8"))
        poses = [Transform(tuple(row[:9]), tuple(row[9:])) for row in table["poses"]]
        return FoundPoses(table["of"], tuple(poses))
    except (OSError, ValueError, KeyError, TypeError):
        return None


def written(found: FoundPoses) -> str:
    """The text of the file."""
    rows = [f"    [{', '.join(map(repr, [*pose.rotation, *pose.translation]))}]," for pose in found.poses]
    return "\n".join(
        [
            "# Written by `python -m tools.fixed_poses`: what Pinocchio finds in robot.urdf for the joints",
            "# and the flange of robot.toml. Each row: a rotation, row by row, and a place (m).",
            f"of = {found.of}  # the checksum of these: with others this file does not count",
            "poses = [",
            *rows,
            "]",
            "",
        ]
    )

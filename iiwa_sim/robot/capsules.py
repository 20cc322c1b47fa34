"""The links of an arm as capsules: balls, and cylinders with round ends."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import dist
from typing import NamedTuple

from iiwa_sim.frames import IDENTITY, Transform, Vector, apply, compose, with_z_along
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.model import Shape, arm_model

TOOL = "tool"
"""The name of a tool's capsules, in place of the name of a link."""


class Capsule(NamedTuple):
    """Capsule: every point within `radius_m` of a line segment."""

    link: str
    """Name of the link in the URDF that it is part of."""
    joints: int
    """Number of joints that move it: 0 for the base."""
    start: Vector
    """One end of the line (m, in the base), with all joints at 0."""
    end: Vector
    """The other end; the same as `start` for a ball."""
    radius_m: float
    share: float = 1.0
    """Share of the stiffness, for capsules side by side."""

    @classmethod
    def of_mm(
        cls,
        ends_and_radius_mm: Sequence[float],
        link: str = TOOL,
        joints: int = 0,
        pose: Transform = IDENTITY,
    ) -> Capsule:
        """Return the capsule of a settings file: x y z of one end, of the other, radius, in a frame."""
        ax, ay, az, bx, by, bz, radius = (1e-3 * each for each in ends_and_radius_mm)
        return cls(link, joints, apply(pose, (ax, ay, az)), apply(pose, (bx, by, bz)), radius)

    @property
    def length_m(self) -> float:
        """Length of the segment (m); 0 for a sphere."""
        return dist(self.start, self.end)

    @property
    def pose(self) -> Transform:
        """Pose of the centre, with z along the segment, in the frame of the ends."""
        (ax, ay, az), (bx, by, bz), length = self.start, self.end, self.length_m
        middle = (0.5 * (ax + bx), 0.5 * (ay + by), 0.5 * (az + bz))
        if length == 0.0:
            return Transform(IDENTITY.rotation, middle)
        along = ((bx - ax) / length, (by - ay) / length, (bz - az) / length)
        return Transform(with_z_along(along), middle)


@lru_cache(maxsize=8)
def capsules_of(description: RobotDescription) -> tuple[Capsule, ...]:
    """Return the capsules of all links, base first: those of robot.toml.

    A link without any there has a capsule within each `collision` sphere, cylinder and box of the URDF. It is
    the longest of the thickest capsules, and a sphere in a cylinder that is thicker than long.
    """
    poses: list[Transform] = []
    found: list[Capsule] = []
    for link in arm_model(description).links:
        poses.append(link.pose if link.parent is None else compose(poses[link.parent], link.pose))
        given = [each for name, each in description.capsules_mm if name == link.name]
        found += [Capsule.of_mm(each, link.name, link.moved_by, poses[-1]) for each in given]
        for shape in () if given else link.collision:
            place, ((x, y, z), radius) = compose(poses[-1], shape.pose), _capsule_in(shape)
            start, end = apply(place, (-x, -y, -z)), apply(place, (x, y, z))
            found.append(Capsule(link.name, link.moved_by, start, end, radius))
    return tuple(sorted(found, key=lambda capsule: capsule.joints))


def _capsule_in(shape: Shape) -> tuple[Vector, float]:
    """One end of the line, whose middle is that of the shape, and the radius (m) in the frame of a shape."""
    if shape.kind == "sphere":
        return (0.0, 0.0, 0.0), shape.size_m[0]
    if shape.kind == "cylinder":
        thick, length = shape.size_m
        radius = min(thick, 0.5 * length)
        return (0.0, 0.0, 0.5 * length - radius), radius
    x, y, z = (0.5 * edge for edge in shape.size_m)
    radius, longest = min(x, y, z), max(x, y, z)
    rest = longest - radius
    return (rest * (x == longest), rest * (y == longest), rest * (z == longest)), radius

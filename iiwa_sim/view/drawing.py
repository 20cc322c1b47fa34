"""What an arm looks like: the links of its URDF with simple shapes, and where the joints turn them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

from iiwa_sim.frames import Rotation, Transform, compose, quaternion_from_rotation, with_z_along
from iiwa_sim.robot.model import GREY, ArmModel, Link, Shape

Wxyz = tuple[float, float, float, float]
Colour = tuple[int, int, int]
"""Red, green, blue: 0 to 255."""

ROD_RADIUS_M = 0.03
"""Radius of the rod drawn for a link without shapes."""
SHORTEST_ROD_M = 0.01


@dataclass(frozen=True)
class Drawing:
    """The links of an arm, each after its parent, and the shapes that are drawn of them."""

    links: tuple[Link, ...]
    shapes: tuple[tuple[Shape, ...], ...]
    """Shapes of each link; a link without any, or with meshes alone, gets rods to its children."""
    flange: int
    """Index of the flange among the links."""
    joint_count: int

    @classmethod
    def of_urdf(cls, urdf: str, joints: Sequence[str], flange: str) -> Drawing:
        """Return the drawing of a URDF.

        Args:
            urdf: Text of the URDF.
            joints: Names of its joints, base first.
            flange: Name of the link that is its flange.

        Raises:
            RobotFault: The URDF is not one of an arm with these joints and this flange.
        """
        links = ArmModel(urdf, joints, flange, "the robot's URDF", "the robot").links
        shapes = tuple(
            link.visual or _rods([each.pose for each in links if each.parent == index])
            for index, link in enumerate(links)
        )
        return cls(links, shapes, [link.name for link in links].index(flange), len(joints))

    def poses(self, joints: Sequence[float]) -> list[Transform]:
        """Poses of all links in the base (m), with the joints at these positions (rad)."""
        found: list[Transform] = []
        for link in self.links:
            pose = link.pose_at(joints)
            found.append(pose if link.parent is None else compose(found[link.parent], pose))
        return found


def wxyz(rotation: Rotation) -> Wxyz:
    """A rotation as viser takes it."""
    x, y, z, w = quaternion_from_rotation(rotation)
    return (w, x, y, z)


def _rods(held: Sequence[Transform]) -> tuple[Shape, ...]:
    """Rods from a link's frame to those of the links it holds."""
    rods = []
    for pose in held:
        x, y, z = pose.translation
        length = hypot(x, y, z)
        if length < SHORTEST_ROD_M:
            continue
        middle = (0.5 * x, 0.5 * y, 0.5 * z)
        along = Transform(with_z_along((x / length, y / length, z / length)), middle)
        rods.append(Shape("cylinder", (ROD_RADIUS_M, length), along, GREY))
    return tuple(rods)

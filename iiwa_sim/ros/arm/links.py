"""Poses of the links in their parents, for /tf."""

from collections.abc import Sequence
from typing import Any

from iiwa_sim.frames import Transform, quaternion_from_rotation
from iiwa_sim.robot.model import Link


class Links:
    """The links of one robot. Its messages have no stamps yet."""

    def __init__(self, links: Sequence[Link]) -> None:
        """`links` are those of the robot's model."""
        parents = [(links[link.parent].name, link) for link in links if link.parent is not None]
        self._moved = [each for each in parents if each[1].joint is not None]
        self._fixed = [each for each in parents if each[1].joint is None]

    def moving(self, joints: Sequence[float]) -> list[dict[str, Any]]:
        """Return geometry_msgs/TransformStamped without stamps of the moved links at positions (rad)."""
        return [_transform(parent, link.name, link.pose_at(joints)) for parent, link in self._moved]

    def fixed(self) -> list[dict[str, Any]]:
        """Return geometry_msgs/TransformStamped without stamps of the links that do not move."""
        return [_transform(parent, link.name, link.pose) for parent, link in self._fixed]


def tool_transform(flange: str, tool: str, tool_in_flange: Transform) -> dict[str, Any]:
    """The TCP in the flange, as `Links.moving` has transforms."""
    return _transform(flange, tool, tool_in_flange)


def _transform(parent: str, child: str, pose: Transform) -> dict[str, Any]:
    return {
        "header": {"frame_id": parent},
        "child_frame_id": child,
        "transform": {
            "translation": dict(zip("xyz", pose.translation, strict=True)),
            "rotation": dict(zip("xyzw", quaternion_from_rotation(pose.rotation), strict=True)),
        },
    }

"""Where the links of a URDF are: each in its parent, as /tf has it."""

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from typing import Any

from iiwa_sim.frames import Transform, quaternion_from_rotation
from iiwa_sim.robot.urdf_joints import joints_in


class Links:
    """The joints of one robot. Its messages have no stamps yet."""

    def __init__(self, urdf: str, moved: Sequence[str]) -> None:
        """`moved` are the names of the joints whose positions are told, base first; all others are fixed."""
        found = joints_in(ET.fromstring(urdf))
        named = {joint.name: joint for joint in found}
        self._moved = [named[name] for name in moved]
        self._fixed = [joint for joint in found if joint.name not in moved]

    def moving(self, joints: Sequence[float]) -> list[dict[str, Any]]:
        """geometry_msgs/TransformStamped, without headers' stamps, of the joints at positions (rad)."""
        return [
            _transform(joint.parent, joint.child, joint.at(position))
            for joint, position in zip(self._moved, joints, strict=True)
        ]

    def fixed(self) -> list[dict[str, Any]]:
        """geometry_msgs/TransformStamped, without headers' stamps, of the joints that do not move."""
        return [_transform(joint.parent, joint.child, joint.origin) for joint in self._fixed]


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

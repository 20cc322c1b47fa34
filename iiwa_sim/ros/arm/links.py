"""Where the links of a URDF are: each in the one before, as /tf has it."""

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from math import cos, sin, sqrt
from typing import Any, NamedTuple

from iiwa_sim.frames import Transform

Quaternion = tuple[float, float, float, float]
"""x, y, z, w"""
NO_TURN: Quaternion = (0.0, 0.0, 0.0, 1.0)


class _Joint(NamedTuple):
    name: str
    parent: str
    child: str
    place: tuple[float, ...]
    """m"""
    turn: Quaternion
    axis: tuple[float, ...]
    fixed: bool


class Links:
    """The joints of one robot. Its messages have no stamps yet."""

    def __init__(self, urdf: str, moved: Sequence[str]) -> None:
        """`moved` are the names of the joints whose positions are told, base first; all others are fixed."""
        found = [_joint(each) for each in ET.fromstring(urdf).findall("joint")]
        named = {joint.name: joint for joint in found}
        self._moved = [named[name] for name in moved]
        self._fixed = [joint for joint in found if joint.name not in moved]
        children = {joint.child for joint in found}
        self.base = next(joint.parent for joint in found if joint.parent not in children)
        """The link that is in no other."""

    def moving(self, joints: Sequence[float]) -> list[dict[str, Any]]:
        """geometry_msgs/TransformStamped, without headers' stamps, of the joints at positions (rad)."""
        return [
            _transform(
                joint.parent, joint.child, joint.place, _product(joint.turn, _about(joint.axis, position))
            )
            for joint, position in zip(self._moved, joints, strict=True)
        ]

    def fixed(self) -> list[dict[str, Any]]:
        """geometry_msgs/TransformStamped, without headers' stamps, of the joints that do not move."""
        return [_transform(joint.parent, joint.child, joint.place, joint.turn) for joint in self._fixed]


def tool_transform(flange: str, tool: str, tool_in_flange: Transform) -> dict[str, Any]:
    """The TCP in the flange, as `Links.moving` has transforms."""
    return _transform(flange, tool, tool_in_flange.translation, _of_rotation(tool_in_flange.rotation))


def _transform(parent: str, child: str, place: Sequence[float], turn: Quaternion) -> dict[str, Any]:
    return {
        "header": {"frame_id": parent},
        "child_frame_id": child,
        "transform": {
            "translation": dict(zip("xyz", place, strict=True)),
            "rotation": dict(zip("xyzw", turn, strict=True)),
        },
    }


def _joint(element: ET.Element) -> _Joint:
    origin, axis = element.find("origin"), element.find("axis")
    place = _numbers(origin, "xyz", "0 0 0")
    roll, pitch, yaw = _numbers(origin, "rpy", "0 0 0")
    turn = _product(
        _about((0.0, 0.0, 1.0), yaw), _product(_about((0.0, 1.0, 0.0), pitch), _about((1.0, 0.0, 0.0), roll))
    )
    parent, child = (element.find(name) for name in ("parent", "child"))
    return _Joint(
        element.get("name", ""),
        "" if parent is None else parent.get("link", ""),
        "" if child is None else child.get("link", ""),
        place,
        turn,
        _numbers(axis, "xyz", "1 0 0"),
        element.get("type") == "fixed",
    )


def _numbers(element: ET.Element | None, key: str, default: str) -> tuple[float, ...]:
    return tuple(map(float, (default if element is None else element.get(key, default)).split()))


def _about(axis: Sequence[float], angle: float) -> Quaternion:
    length = sqrt(sum(each * each for each in axis))
    part = sin(0.5 * angle) / length
    return (axis[0] * part, axis[1] * part, axis[2] * part, cos(0.5 * angle))


def _product(a: Quaternion, b: Quaternion) -> Quaternion:
    return (
        a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
        a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
        a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
        a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
    )


def _of_rotation(r: Sequence[float]) -> Quaternion:
    """Of a rotation matrix, row by row: by the largest of the four, so that none is lost to rounding."""
    squares = (
        1.0 + r[0] - r[4] - r[8],
        1.0 - r[0] + r[4] - r[8],
        1.0 - r[0] - r[4] + r[8],
        1.0 + r[0] + r[4] + r[8],
    )
    largest = squares.index(max(squares))
    part = 0.5 / sqrt(squares[largest])
    whole = 0.5 * sqrt(squares[largest])
    if largest == 3:
        return ((r[7] - r[5]) * part, (r[2] - r[6]) * part, (r[3] - r[1]) * part, whole)
    if largest == 0:
        return (whole, (r[1] + r[3]) * part, (r[2] + r[6]) * part, (r[7] - r[5]) * part)
    if largest == 1:
        return ((r[1] + r[3]) * part, whole, (r[5] + r[7]) * part, (r[2] - r[6]) * part)
    return ((r[2] + r[6]) * part, (r[5] + r[7]) * part, whole, (r[3] - r[1]) * part)

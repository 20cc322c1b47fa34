"""What a checked URDF says: how its joints hang together, and where its elements are."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from math import hypot
from typing import NamedTuple

from iiwa_sim.frames import IDENTITY, Transform, Vector, multiply, rotation_about, transform_from_euler


class UrdfJoint(NamedTuple):
    """A joint between two links."""

    name: str
    parent: str
    child: str
    origin: Transform
    """The child in the parent, with the joint at zero (m)."""
    axis: Vector
    """Axis in the child: a unit vector."""

    def at(self, position: float) -> Transform:
        """The child in the parent, with the joint there (rad)."""
        turned = multiply(self.origin.rotation, rotation_about(self.axis, position))
        return Transform(turned, self.origin.translation)


def joints_in(robot: ET.Element) -> list[UrdfJoint]:
    """The joints of an element `robot`, in their order."""
    return [
        UrdfJoint(
            joint.get("name", ""),
            _attribute(joint.find("parent"), "link"),
            _attribute(joint.find("child"), "link"),
            origin_of(joint),
            _axis(joint),
        )
        for joint in robot.findall("joint")
    ]


def origin_of(parent: ET.Element) -> Transform:
    """The pose that the `origin` of an element tells (m)."""
    origin = parent.find("origin")
    if origin is None:
        return IDENTITY
    x, y, z = _three(origin.get("xyz", "0 0 0"))
    roll, pitch, yaw = _three(origin.get("rpy", "0 0 0"))
    return transform_from_euler(x, y, z, yaw, pitch, roll)  # fixed x-y-z is intrinsic z-y-x


def _axis(joint: ET.Element) -> Vector:
    x, y, z = _three(_attribute(joint.find("axis"), "xyz") or "1 0 0")  # as URDF has it
    length = hypot(x, y, z)
    return (x / length, y / length, z / length)


def _attribute(element: ET.Element | None, name: str) -> str:
    return "" if element is None else element.get(name, "")


def _three(text: str) -> Vector:
    x, y, z = map(float, text.split())
    return (x, y, z)

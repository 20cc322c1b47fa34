"""What a URDF says of joints and shapes, as viewers need it."""

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from typing import NamedTuple

from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.frames import (
    IDENTITY,
    Quaternion,
    Transform,
    Vector,
    quaternion_from_rotation,
    transform_from_euler,
)
from iiwa_sim.recordings.foxglove import Message, rounded_vector

GREY = (0.8, 0.8, 0.8, 1.0)
"""Of what the URDF gives no colour."""


class Joint(NamedTuple):
    """Between two links."""

    parent: str
    child: str
    translation: Message
    """From the parent (m)."""
    rotation: Quaternion
    """In the parent, with the joint at zero."""
    axis: Vector
    place: int | None
    """Among the robot's joints; None for a fixed one."""


def joint_of(joint: ET.Element, names: Sequence[str]) -> Joint:
    """What an element `joint` says; `names` are those of the robot's joints, base first."""

    def link(which: str) -> str:
        found = joint.find(which)
        return "" if found is None else found.get("link", "")

    axis = joint.find("axis")
    x, y, z = _numbers("1 0 0" if axis is None else axis.get("xyz", "1 0 0"))  # as URDF has it
    length = (x * x + y * y + z * z) ** 0.5
    name = joint.get("name", "")
    place = names.index(name) if name in names else None
    origin = origin_of(joint)
    return Joint(
        link("parent"),
        link("child"),
        rounded_vector(origin),
        quaternion_from_rotation(origin.rotation),
        (x / length, y / length, z / length),
        place,
    )


def origin_of(parent: ET.Element) -> Transform:
    """The pose that the `origin` of an element tells (m)."""
    origin = parent.find("origin")
    if origin is None:
        return IDENTITY
    x, y, z = _numbers(origin.get("xyz", "0 0 0"))
    roll, pitch, yaw = _numbers(origin.get("rpy", "0 0 0"))
    return transform_from_euler(x, y, z, yaw, pitch, roll)  # fixed x-y-z is intrinsic z-y-x


def _numbers(text: str) -> list[float]:
    return [float(word) for word in text.split()]


def colour_of(material: ET.Element) -> tuple[float, ...]:
    """Red, green, blue, opacity of an element `material`."""
    color = material.find("color")
    found = [] if color is None else _numbers(color.get("rgba", ""))
    return tuple(found) if len(found) == len(GREY) else GREY


def shape_of(geometry: ET.Element | None) -> Box | Cylinder | Sphere | None:
    """The first box, cylinder or sphere of an element `geometry`; None for meshes."""
    for shape in [] if geometry is None else geometry:
        match shape.tag:
            case "box":
                x, y, z = _numbers(shape.get("size", "0 0 0"))
                return Box(0.5 * x, 0.5 * y, 0.5 * z)
            case "cylinder":
                return Cylinder(float(shape.get("radius", "0")), 0.5 * float(shape.get("length", "0")))
            case "sphere":
                return Sphere(float(shape.get("radius", "0")))
    return None

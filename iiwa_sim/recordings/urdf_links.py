"""Joints, shapes and colours of a URDF, as viewers need them."""

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from typing import NamedTuple

from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.frames import Quaternion, Vector, quaternion_from_rotation
from iiwa_sim.recordings.foxglove import Message, rounded_vector
from iiwa_sim.robot.urdf_joints import UrdfJoint

GREY = (0.8, 0.8, 0.8, 1.0)
"""Colour of links that the URDF gives none."""


class Joint(NamedTuple):
    """A joint between two links."""

    parent: str
    child: str
    translation: Message
    """Place in the parent (m)."""
    rotation: Quaternion
    """Rotation in the parent, with the joint at zero."""
    axis: Vector
    place: int | None
    """Among the robot's joints; None for a fixed one."""


def joint_of(joint: UrdfJoint, names: Sequence[str]) -> Joint:
    """A joint as viewers need it; `names` are those of the robot's joints, base first."""
    return Joint(
        joint.parent,
        joint.child,
        rounded_vector(joint.origin),
        quaternion_from_rotation(joint.origin.rotation),
        joint.axis,
        names.index(joint.name) if joint.name in names else None,
    )


def colour_of(material: ET.Element) -> tuple[float, ...]:
    """Red, green, blue, opacity of an element `material`."""
    color = material.find("color")
    found = [] if color is None else [float(word) for word in color.get("rgba", "").split()]
    return tuple(found) if len(found) == len(GREY) else GREY


def shape_of(geometry: ET.Element | None) -> Box | Cylinder | Sphere | None:
    """The first box, cylinder or sphere of an element `geometry`; None for meshes."""
    for shape in [] if geometry is None else geometry:
        match shape.tag:
            case "box":
                x, y, z = (float(word) for word in shape.get("size", "0 0 0").split())
                return Box(0.5 * x, 0.5 * y, 0.5 * z)
            case "cylinder":
                return Cylinder(float(shape.get("radius", "0")), 0.5 * float(shape.get("length", "0")))
            case "sphere":
                return Sphere(float(shape.get("radius", "0")))
    return None

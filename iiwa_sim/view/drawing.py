"""What an arm looks like: the links of its URDF with simple shapes, and where the joints turn them."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import hypot

from iiwa_sim.frames import (
    IDENTITY,
    Rotation,
    Transform,
    Vector,
    compose,
    multiply,
    quaternion_from_rotation,
    rotation_about,
    transform_from_euler,
    with_z_along,
)
from iiwa_sim.wording import Unusable

Wxyz = tuple[float, float, float, float]
Colour = tuple[int, int, int]

GREY: Colour = (170, 172, 176)
"""Colour of a shape that has none of its own."""
ROD_RADIUS_M = 0.03
"""Radius of the rod drawn for a link whose looks are in a file (a mesh), or that has none."""
SHORTEST_ROD_M = 0.01


class DrawingFault(Unusable):
    """A URDF of which no picture can be made. The message is one line."""


@dataclass(frozen=True)
class Shape:
    """A box, a sphere or a cylinder along z, in the frame of its link."""

    kind: str
    """box, sphere, cylinder"""
    size_m: tuple[float, ...]
    """Sizes (m): the edges of a box, the radius of a sphere, radius and length of a cylinder."""
    pose: Transform
    colour: Colour


@dataclass
class Link:
    """A link, and the joint that holds it."""

    name: str
    parent: int | None
    """Place, among the links of the drawing, of the link that holds this one; None where none does."""
    pose: Transform
    """Pose in its parent, with its joint at zero (m)."""
    axis: Vector = (0.0, 0.0, 1.0)
    """The joint's, in the link's frame: a unit vector."""
    joint: int | None = None
    """The number of the joint, from 0; None for a link that is fixed."""
    shapes: list[Shape] = field(default_factory=list)

    def pose_at(self, joints: Sequence[float]) -> Transform:
        """Pose in its parent (m), with the joints at these positions (rad)."""
        if self.joint is None:
            return self.pose
        turned = multiply(self.pose.rotation, rotation_about(self.axis, joints[self.joint]))
        return Transform(turned, self.pose.translation)


@dataclass(frozen=True)
class Drawing:
    """The links, each behind its parent."""

    links: tuple[Link, ...]
    flange: int
    """The place of the flange among them."""
    joint_count: int

    @classmethod
    def of_urdf(cls, urdf: str, joints: Sequence[str], flange: str) -> Drawing:
        """The drawing of a URDF, with the names of its joints, base first, and of its flange, a link.

        Boxes, cylinders and spheres are drawn as they are; a link with other shapes, or with none, gets rods
        to the links that it holds. Raises DrawingFault for a URDF that has not got these joints and link.
        """
        try:
            robot = ET.fromstring(urdf)
        except ET.ParseError as fault:
            raise DrawingFault(f"the robot's URDF is no XML: {fault}") from None
        colours = _colours(robot)
        bodies = {link.get("name", ""): link for link in robot.findall("link")}
        held: dict[str, list[ET.Element]] = {}
        for joint in robot.findall("joint"):
            held.setdefault(_named(joint, "parent"), []).append(joint)
        children = {_named(joint, "child") for each in held.values() for joint in each}
        roots = [name for name in bodies if name not in children]
        numbers = {name: number for number, name in enumerate(joints)}
        links: list[Link] = []
        waiting = [(name, Link(name, None, IDENTITY)) for name in roots]
        while waiting and len(links) <= len(bodies):
            name, link = waiting.pop(0)
            place = len(links)
            links.append(link)
            follow = []
            for joint in held.get(name, []):
                child = _named(joint, "child")
                number = numbers.get(joint.get("name", ""))
                follow.append(
                    Link(child, place, _pose(joint.find("origin")), _axis(joint.find("axis")), number)
                )
            link.shapes = _shapes(bodies.get(name), colours) or _rods([each.pose for each in follow])
            waiting += [(each.name, each) for each in follow]
        names = [link.name for link in links]
        if flange not in names or {link.joint for link in links} - {None} != set(range(len(joints))):
            raise DrawingFault(
                f"the robot's URDF has not got the joints {list(joints)} and the flange {flange!r}"
            )
        return cls(tuple(links), names.index(flange), len(joints))

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


def _named(joint: ET.Element, tag: str) -> str:
    element = joint.find(tag)
    return "" if element is None else element.get("link", "")


def _numbers(element: ET.Element | None, key: str, default: str) -> tuple[float, ...]:
    text = default if element is None else element.get(key, default)
    try:
        return tuple(map(float, text.split()))
    except ValueError:
        raise DrawingFault(f"the robot's URDF has {text[:40]!r} where numbers are expected") from None


def _three(element: ET.Element | None, key: str, default: str) -> Vector:
    x, y, z = (*_numbers(element, key, default), 0.0, 0.0, 0.0)[:3]
    return (x, y, z)


def _pose(origin: ET.Element | None) -> Transform:
    x, y, z = _three(origin, "xyz", "0 0 0")
    roll, pitch, yaw = _three(origin, "rpy", "0 0 0")
    return transform_from_euler(x, y, z, yaw, pitch, roll)


def _axis(element: ET.Element | None) -> Vector:
    x, y, z = _three(element, "xyz", "1 0 0")  # as URDF has it
    length = hypot(x, y, z) or 1.0
    return (x / length, y / length, z / length)


def _colours(robot: ET.Element) -> dict[str, Colour]:
    return {each.get("name", ""): colour for each in robot.iter("material") if (colour := _colour(each))}


def _colour(material: ET.Element | None) -> Colour | None:
    element = None if material is None else material.find("color")
    if element is None:
        return None
    red, green, blue = (
        max(0, min(255, round(255 * part))) for part in _three(element, "rgba", "0.7 0.7 0.7 1")
    )
    return (red, green, blue)


def _shapes(body: ET.Element | None, colours: dict[str, Colour]) -> list[Shape]:
    """The shapes of a link, if all of them can be drawn."""
    found: list[Shape] = []
    for visual in [] if body is None else body.findall("visual"):
        geometry = visual.find("geometry")
        kind = None if geometry is None or not len(geometry) else geometry[0]
        if kind is None or kind.tag not in ("box", "sphere", "cylinder"):
            return []
        if kind.tag == "box":
            size = _numbers(kind, "size", "0 0 0")
        else:
            size = _numbers(kind, "radius", "0")
            if kind.tag == "cylinder":
                size += _numbers(kind, "length", "0")
        material = visual.find("material")
        name = "" if material is None else material.get("name", "")
        colour = _colour(material) or colours.get(name, GREY)
        found.append(Shape(kind.tag, size, _pose(visual.find("origin")), colour))
    return found


def _rods(held: list[Transform]) -> list[Shape]:
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
    return rods

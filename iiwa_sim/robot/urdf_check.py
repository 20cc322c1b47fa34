"""Checks of a URDF before Pinocchio reads it.

urdfdom, the parser within Pinocchio, prints most mistakes to stderr and continues without the element. One
wrong number in a collision shape drops all collision shapes of the link. Negative sizes, an axis of zeros and
mimic joints pass silently. The checks find all these first.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import Counter
from math import inf
from typing import NamedTuple

from iiwa_sim.robot.description import RobotFault
from iiwa_sim.settings import MISSING


class _Numbers(NamedTuple):
    """An attribute with numbers: element and attribute, count and range of the numbers."""

    element: str
    attribute: str
    numbers: int
    least: float
    greatest: float
    unit: str = ""
    required: bool = False

    @property
    def expected(self) -> str:
        count = "a number" if self.numbers == 1 else f"{self.numbers} numbers"
        if self.greatest == inf:
            return f"{count} in{self.unit}" if self.unit else count
        return f"{count} from {self.least:g} to {self.greatest:g}{self.unit}"

    def accepts(self, text: str) -> bool:
        try:
            values = [float(word) for word in text.split()]
        except ValueError:
            return False
        return len(values) == self.numbers and all(self.least <= value <= self.greatest for value in values)


def _origin(within: str = "") -> list[_Numbers]:
    place, turn = (-100.0, 100.0, " m"), (-100.0, 100.0, " rad")
    return [_Numbers(within + "origin", "xyz", 3, *place), _Numbers(within + "origin", "rpy", 3, *turn)]


def _shapes(within: str) -> list[_Numbers]:
    size = (1e-6, 100.0, " m", True)
    return [
        *_origin(within),
        _Numbers(within + "geometry/box", "size", 3, *size),
        _Numbers(within + "geometry/sphere", "radius", 1, *size),
        _Numbers(within + "geometry/cylinder", "radius", 1, *size),
        _Numbers(within + "geometry/cylinder", "length", 1, *size),
    ]


_LIMIT = (
    ("lower", " rad", False),
    ("upper", " rad", False),
    ("velocity", " rad/s", True),
    ("effort", " Nm", True),
)
_INERTIA = (("ixx", 0.0), ("iyy", 0.0), ("izz", 0.0), ("ixy", -1e6), ("ixz", -1e6), ("iyz", -1e6))
_COLOR = _Numbers("material/color", "rgba", 4, 0.0, 1.0, required=True)
_RULES = {
    "joint": [
        *_origin(),
        _Numbers("axis", "xyz", 3, -1e6, 1e6, required=True),
        *(_Numbers("limit", key, 1, -inf, inf, unit, required) for key, unit, required in _LIMIT),
        *(_Numbers("dynamics", key, 1, 0.0, 1e6) for key in ("damping", "friction")),
    ],
    "link": [
        *_origin("inertial/"),
        _Numbers("inertial/mass", "value", 1, 0.0, 1e6, " kg", required=True),
        *(_Numbers("inertial/inertia", key, 1, least, 1e6, " kg m^2", True) for key, least in _INERTIA),
        *_shapes("collision/"),
        *_shapes("visual/"),
        _COLOR._replace(element="visual/material/color"),
    ],
}
_SHAPES = ("box", "cylinder", "sphere", "mesh")


def checked_urdf(path: str, text: str) -> ET.Element:
    """Return the element `robot` of a URDF that Pinocchio can read.

    Raises:
        RobotFault: The URDF has a mistake: one line with file, element, value and the expected value.
    """
    robot = _parsed(path, text)
    if robot.tag != "robot":
        raise RobotFault(path, "", "", f"an element robot, not {robot.tag}")
    for tag in ("link", "joint", "material"):
        for name, count in Counter(each.get("name", "") for each in robot.findall(tag)).items():
            if count > 1 or not name:
                raise RobotFault(path, f"{tag} {name}: name", name, f"a name that only one {tag} has")
    _check_joints(path, robot)
    for tag, rules in _RULES.items():
        for parent in robot.findall(tag):
            for rule in rules:
                _check_numbers(path, f"{tag} {parent.get('name')}", parent, rule)
    _check_numbers(path, "robot", robot, _COLOR)
    for link in robot.findall("link"):
        for part in ("collision", "visual"):
            for body in link.findall(part):
                _check_shape(path, f"link {link.get('name')}: {part}", body)
    return robot


def _parsed(path: str, text: str) -> ET.Element:
    try:
        return ET.fromstring(text)
    except (ET.ParseError, ValueError, LookupError) as fault:  # the latter two: its head names an encoding
        raise RobotFault(path, "", "", f"valid XML ({fault})") from None


def _check_joints(path: str, robot: ET.Element) -> None:
    """Check that each joint is of a known type and that the joints make one tree of the links."""
    links = {link.get("name", "") for link in robot.findall("link")}
    parents: dict[str, str] = {}
    for joint in robot.findall("joint"):
        place, kind = f"joint {joint.get('name')}", joint.get("type", MISSING)
        if kind not in ("revolute", "fixed"):
            raise RobotFault(path, f"{place}: type", kind, "revolute or fixed")
        if kind == "revolute" and joint.find("limit") is None:
            raise RobotFault(path, f"{place}: limit", MISSING, "this element in a revolute joint")
        mimic = joint.find("mimic")
        if mimic is not None:
            raise RobotFault(path, f"{place}: mimic", mimic.get("joint", ""), "no joint that follows another")
        ends = [joint.find(end) for end in ("parent", "child")]
        parent, child = (MISSING if each is None else each.get("link", MISSING) for each in ends)
        for end, link in (("parent", parent), ("child", child)):
            if link not in links:
                raise RobotFault(path, f"{place}: {end} link", link, "the name of a link")
        if child in parents:
            raise RobotFault(path, f"{place}: child link", child, "a link that no other joint moves")
        parents[child] = parent
    roots = sorted(links - parents.keys())
    if len(roots) != 1:
        raise RobotFault(path, "link", ", ".join(roots) or "(none)", "one link that no joint moves: the base")
    for link in parents:
        above = [link]
        while above[-1] in parents:
            above.append(parents[above[-1]])
            if above[-1] in above[:-1]:
                raise RobotFault(path, f"link {link}", " > ".join(above), "no ring of links")


def _check_numbers(path: str, place: str, parent: ET.Element, rule: _Numbers) -> None:
    for element in parent.findall(rule.element):
        text = element.get(rule.attribute)
        key = f"{place}: {rule.element.replace('geometry/', '').replace('/', ': ')} {rule.attribute}"
        if text is None and rule.required:
            raise RobotFault(path, key, MISSING, rule.expected)
        if text is not None and not rule.accepts(text):
            raise RobotFault(path, key, text, rule.expected)
        if rule.element == "axis" and text is not None and not any(map(float, text.split())):
            raise RobotFault(path, key, text, "a direction, not 0 0 0")


def _check_shape(path: str, place: str, body: ET.Element) -> None:
    shapes = [shape.tag for shape in body.findall("geometry/*")]
    if len(shapes) != 1 or shapes[0] not in _SHAPES:
        expected = f"one of {', '.join(_SHAPES)}"
        raise RobotFault(path, f"{place}: geometry", ", ".join(shapes) or MISSING, expected)
    material = body.find("material")
    if material is not None and material.get("name") is None:
        raise RobotFault(path, f"{place}: material: name", MISSING, "this attribute")

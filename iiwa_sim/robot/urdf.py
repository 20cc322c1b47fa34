"""Checks of a URDF that Pinocchio does not make."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from math import inf
from typing import NamedTuple

from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.robot.fault import RobotFault

SAME_LIMIT = 1e-3
"""Tolerance as a part of the value: URDFs are written with rounded numbers."""


class _Numbers(NamedTuple):
    """An attribute: how many numbers, and their range; values beyond are mistakes."""

    element: str
    attribute: str
    how_many: int
    least: float
    greatest: float
    unit: str


_ORIGIN = (
    _Numbers("origin", "xyz", 3, -100.0, 100.0, " m"),
    _Numbers("origin", "rpy", 3, -100.0, 100.0, " rad"),
)
_LIMIT = tuple(
    _Numbers("limit", key, 1, -inf, inf, unit)
    for key, unit in (("lower", " rad"), ("upper", " rad"), ("velocity", " rad/s"), ("effort", " Nm"))
)
_JOINT = (*_ORIGIN, _Numbers("axis", "xyz", 3, -1e6, 1e6, ""), *_LIMIT)
_INERTIAL = (
    *_ORIGIN,
    _Numbers("mass", "value", 1, 0.0, 1e6, " kg"),
    *(_Numbers("inertia", key, 1, 0.0, 1e6, " kg m^2") for key in ("ixx", "iyy", "izz")),
    *(_Numbers("inertia", key, 1, -1e6, 1e6, " kg m^2") for key in ("ixy", "ixz", "iyz")),
)


def check_urdf(path: str, text: str) -> None:
    """Raises `RobotFault` for malformed XML, for placements and masses that no arm has, and for mimic
    joints."""
    robot = _parsed(path, text)
    for joint in robot.findall("joint"):
        place = f"joint {joint.get('name', '')}"
        mimic = joint.find("mimic")
        if mimic is not None:
            raise RobotFault(path, f"{place}: mimic", mimic.get("joint", ""), "no joint that follows another")
        _check(path, place, joint, _JOINT)
        axis = joint.find("axis")
        direction = axis.get("xyz", "1 0 0") if axis is not None else "1 0 0"  # the default of URDF
        if not any(map(float, direction.split())):
            raise RobotFault(path, f"{place}: axis xyz", direction, "a direction, not 0 0 0")
    for link in robot.findall("link"):
        place = f"link {link.get('name', '')}"
        for part, numbers in (("inertial", _INERTIAL), ("visual", _ORIGIN), ("collision", _ORIGIN)):
            for body in link.findall(part):
                _check(path, f"{place}: {part}", body, numbers)


def differing_limits(description: RobotDescription) -> list[str]:
    """Limits of the URDF that differ from those of robot.toml, which are used; a line for each.

    Raises RobotFault for malformed XML.
    """
    held = {
        "lower": (description.position_min, "rad"),
        "upper": (description.position_max, "rad"),
        "velocity": (description.velocity, "rad/s"),
        "effort": (description.torque, "Nm"),
    }
    lines = []
    for joint in _parsed(description.urdf_path, description.urdf).findall("joint"):
        limit, name = joint.find("limit"), joint.get("name", "")
        if limit is None or name not in description.joints:
            continue
        place = description.joints.index(name)
        for key, (values, unit) in held.items():
            try:
                found = float(limit.get(key, ""))
            except ValueError:
                continue  # not given in the URDF
            if abs(found - values[place]) > SAME_LIMIT * max(1.0, abs(values[place])):
                lines.append(
                    f"{description.urdf_path}: joint {name}: limit {key} is {found:.7g} {unit}, in "
                    f"{description.settings_path} {values[place]:.7g} {unit}: the latter holds"
                )
    return lines


def _parsed(path: str, text: str) -> ET.Element:
    try:
        return ET.fromstring(text)
    except (ET.ParseError, ValueError, LookupError) as fault:  # the latter two: its head names an encoding
        raise RobotFault(path, "", "", f"valid XML ({fault})") from None


def _check(path: str, place: str, parent: ET.Element, numbers: tuple[_Numbers, ...]) -> None:
    for wanted in numbers:
        for text in _attributes(parent, wanted):
            if not _holds(text, wanted):
                count = "a number" if wanted.how_many == 1 else f"{wanted.how_many} numbers"
                range_ = f"{count} from {wanted.least:g} to {wanted.greatest:g}{wanted.unit}"
                raise RobotFault(path, f"{place}: {wanted.element} {wanted.attribute}", text, range_)


def _attributes(parent: ET.Element, wanted: _Numbers) -> Iterator[str]:
    for element in parent.findall(wanted.element):
        if wanted.attribute in element.attrib:
            yield element.attrib[wanted.attribute]


def _holds(text: str, wanted: _Numbers) -> bool:
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        return False
    return len(values) == wanted.how_many and all(
        wanted.least <= value <= wanted.greatest for value in values
    )

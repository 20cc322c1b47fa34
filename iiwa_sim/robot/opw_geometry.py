"""The dimensions of a six-joint arm with a spherical wrist, measured on its model."""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from iiwa_sim.frames import Rotation, transpose
from iiwa_sim.robot.arctangent_kernel import arctangent
from iiwa_sim.robot.fault import RobotFault
from iiwa_sim.robot.model import Model

# Directions of the joint axes at zero pose, in the base, up to their sense.
_AXES = ((0, 0, 1), (0, 1, 0), (0, 1, 0), (1, 0, 0), (0, 1, 0), (1, 0, 0))
# Error of a URDF written with seven decimals; a larger error would show in the poses.
_TOLERANCE = 1e-7
_AS_OPW = "as kinematics 'opw' has it"

Plane = tuple[float, float]
"""x and z (m) in the plane of the arm."""


class Geometry(NamedTuple):
    """An arm with ortho-parallel base and spherical wrist, without lateral offset, in m, at zero pose.

    Its joints turn about z, y, y, x, y, x of the base there, in the sense that `signs` (1 or -1) give.
    """

    shoulder: Plane
    """A2, in the base."""
    upper_arm: Plane
    """Upper arm, from A2 to A3."""
    forearm: Plane
    """Forearm, from A3 to the wrist point."""
    hand: float
    """Length from the wrist point to the flange, along x."""
    signs: tuple[float, ...]
    unturned: Rotation
    """The base's orientation in the flange: poses are turned by it so that they are none at zero pose."""

    @property
    def lengths(self) -> tuple[float, float]:
        """Lengths of upper arm and forearm (m)."""
        (ux, uz), (fx, fz) = self.upper_arm, self.forearm
        return sqrt(ux * ux + uz * uz), sqrt(fx * fx + fz * fz)

    @property
    def stretched(self) -> float:
        """How far A3 would have to turn about y, from zero, for the wrist point to be farthest (rad)."""
        (ux, uz), (fx, fz) = self.upper_arm, self.forearm
        stretched: float = arctangent(ux * fz - uz * fx, ux * fx + uz * fz)
        return stretched


def geometry_of(model: Model) -> Geometry:
    """The geometry, or a `RobotFault` that says which joint is not where such an arm has it.

    At zero pose A1 turns about the z axis of the base, A2, A3 and A5 about parallels to its y axis, A4 and A6
    about one and the same parallel to its x axis that A5 crosses; all but A1 in the plane y = 0, and the
    flange on the axis of A6.
    """
    description = model.description
    names = description.joints
    if model.joint_count != len(_AXES):
        raise RobotFault(
            description.settings_path, "joints", list(names), f"{len(_AXES)} joints for kinematics 'opw'"
        )
    directions, points = model.axes_at_zero()
    for name, expected, direction in zip(names, _AXES, directions, strict=True):
        if np.abs(np.abs(direction) - expected).max() > _TOLERANCE:
            shown = "at zero pose +-({:g} {:g} {:g}) in the base, ".format(*expected) + _AS_OPW
            raise RobotFault(description.urdf_path, f"joint {name}: axis", _shown(direction), shown)
    rotation, flange = model.flange([0.0] * model.joint_count)

    def check(place: str, point: ArrayLike, off: float, expected: str) -> None:
        if abs(off) > _TOLERANCE:
            wanted = f"{expected} at zero pose, {_AS_OPW}"
            raise RobotFault(description.urdf_path, f"{place}: origin", f"{_shown(point)} m", wanted)

    wrist = points[4]
    for axis in (0, 1):
        check(f"joint {names[0]}", points[0], points[0][axis], "an axis through x = y = 0")
    for joint in (3, 5):
        check(f"joint {names[joint]}", points[joint], points[joint][1], "an axis in the plane y = 0")
        off = points[joint][2] - wrist[2]
        check(f"joint {names[joint]}", points[joint], off, f"an axis that {names[4]} crosses")
    for axis in (1, 2):
        off = flange[axis] - (wrist[2] if axis == 2 else 0.0)
        check(f"link {description.flange}", flange, off, f"a flange on the axis of {names[5]}")
    (x2, _, z2), (x3, _, z3), (x5, _, z5) = (points[joint].tolist() for joint in (1, 2, 4))
    geometry = Geometry(
        (x2, z2),
        (x3 - x2, z3 - z2),
        (x5 - x3, z5 - z3),
        flange[0] - x5,
        tuple(np.sign(directions.sum(axis=1)).tolist()),
        transpose(rotation),
    )
    for (low, high), length in zip(((1, 2), (2, 4)), geometry.lengths, strict=True):
        if length <= _TOLERANCE:
            away = f"more than 0 m away from {names[low]}, {_AS_OPW}"
            raise RobotFault(description.urdf_path, f"joint {names[high]}: origin", f"{length:g} m", away)
    return geometry


def _shown(vector: ArrayLike) -> str:
    return " ".join(f"{value + 0.0:.9g}" for value in np.asarray(vector).tolist())

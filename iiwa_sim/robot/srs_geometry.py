"""The lengths of a seven-joint arm with spherical shoulder and wrist, measured on its model."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iiwa_sim.robot.fault import RobotFault
from iiwa_sim.robot.model import Model

# Joint axes at zero pose, in the base.
_AXES = ((0, 0, 1), (0, 1, 0), (0, 0, 1), (0, -1, 0), (0, 0, 1), (0, 1, 0), (0, 0, 1))
# What a URDF written with seven decimals is off by at most; a larger error would show in the poses.
_TOLERANCE = 1e-7


class Lengths(NamedTuple):
    """m"""

    base_shoulder: float
    shoulder_elbow: float
    elbow_wrist: float
    wrist_flange: float


def lengths_of(model: Model) -> Lengths:
    """The lengths, or a `RobotFault` that says which joint is not where a S-R-S arm has it.

    At zero pose the arm stands upright on the base: A1, A3, A5, A7 turn about its z axis, A2 and A6 about
    lines parallel to y through that axis, A4 about one parallel to -y.
    """
    description = model.description
    if model.joint_count != len(_AXES):
        raise RobotFault(
            description.settings_path,
            "joints",
            list(description.joints),
            f"{len(_AXES)} joints for kinematics 'srs'",
        )
    directions, points = model.axes_at_zero()
    for name, expected, direction, point in zip(description.joints, _AXES, directions, points, strict=True):
        if np.abs(direction - expected).max() > _TOLERANCE:
            shown = "at zero pose {:g} {:g} {:g} in the base, as kinematics 'srs' has it".format(*expected)
            raise RobotFault(description.urdf_path, f"joint {name}: axis", _shown(direction), shown)
        # How far the axis passes the upright: a tilting one may start anywhere along y.
        off = point[:2] if expected[2] else point[:1]
        if np.abs(off).max() > _TOLERANCE:
            through = "an axis through the upright x = y = 0 at zero pose, as kinematics 'srs' has it"
            raise RobotFault(description.urdf_path, f"joint {name}: origin", _shown(point) + " m", through)
    (rotation, flange) = model.flange([0.0] * model.joint_count)
    if (
        np.abs(np.subtract(rotation, np.eye(3).ravel())).max() > _TOLERANCE
        or max(map(abs, flange[:2])) > _TOLERANCE
    ):
        upright = "x = y = 0 and the base's orientation at zero pose, as kinematics 'srs' has it"
        raise RobotFault(
            description.urdf_path, f"link {description.flange}: origin", _shown(flange) + " m", upright
        )
    shoulder, elbow, wrist = (float(points[joint][2]) for joint in (1, 3, 5))
    lengths = Lengths(shoulder, elbow - shoulder, wrist - elbow, flange[2] - wrist)
    for (low, high), length in zip(
        ((1, 3), (3, 5)), (lengths.shoulder_elbow, lengths.elbow_wrist), strict=True
    ):
        if length <= 0.0:
            names = description.joints
            above = f"more than 0 m above {names[low]} at zero pose"
            raise RobotFault(description.urdf_path, f"joint {names[high]}: origin", f"{length:g} m", above)
    return lengths


def _shown(vector: np.typing.ArrayLike) -> str:
    return " ".join(f"{value + 0.0:.9g}" for value in np.asarray(vector).tolist())

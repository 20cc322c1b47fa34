"""Which closed form is the inverse kinematics of a robot."""

from __future__ import annotations

from iiwa_sim.robot.fault import RobotFault
from iiwa_sim.robot.inverse_kernel import Inverse
from iiwa_sim.robot.model import Model
from iiwa_sim.robot.opw import opw
from iiwa_sim.robot.srs import srs


def inverse_of(model: Model) -> Inverse:
    """The inverse kinematics of a model's description.

    Raises `RobotFault` for an unknown kind, and if the geometry of the URDF is not of that kind.
    """
    description = model.description
    if description.kinematics == "srs":
        return Inverse(model, srs(model))
    if description.kinematics == "opw":
        return Inverse(model, opw(model))
    raise RobotFault(description.settings_path, "kinematics", repr(description.kinematics), "'srs' or 'opw'")

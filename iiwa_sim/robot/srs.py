"""Inverse kinematics of a seven-joint S-R-S arm (spherical shoulder and wrist) in closed form, A3 given.

With the wrist point w seen from the shoulder, its distance gives A4. In the frame that A1 and A2 turn, the
wrist point is v = (-d5 sinA4 cosA3, -d5 sinA4 sinA3, d3 + d5 cosA4); turned by A2 its height must be that of
w, turned by A1 its direction. What is left of the orientation is a Z-Y-Z wrist. A4, A2 and A6 have two
solutions each, told apart by the status: bit 0 is set where the wrist point has a negative x in the frame
that A1 turns, bit 1 where A4 is negative, bit 2 where A6 is zero or negative.
"""

from __future__ import annotations

from iiwa_sim.robot.closed_form import ClosedForm, Reach
from iiwa_sim.robot.follow import Side
from iiwa_sim.robot.inverse_kernel import SRS
from iiwa_sim.robot.model import Model
from iiwa_sim.robot.srs_geometry import lengths_of

_SIDES = tuple((Side(3, 0.0, bool(status & 2)), Side(5, 0.0, bool(status & 4))) for status in range(8))


def srs(model: Model) -> ClosedForm:
    """The closed form of this arm, with A3 as the redundancy.

    Raises `RobotFault` where the model is no S-R-S arm.
    """
    lengths = base_shoulder, upper, fore, hand = lengths_of(model)
    sideways = "the wrist is on the axis of A1, or beside it as far as A3 allows"
    reach = Reach((0.0, base_shoulder), upper, fore, (0.0, 0.0, -hand))
    return ClosedForm(SRS, lengths, 2, _SIDES, sideways, reach)

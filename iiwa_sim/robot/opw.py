"""Inverse kinematics of a six-joint arm with ortho-parallel base and spherical wrist in closed form.

A1 turns the plane of the arm to the wrist point, or away from it; in that plane upper arm and forearm make a
triangle, which has two solutions; what is left of the orientation is an X-Y-X wrist, which has two. Status
and turn are those of KUKA for PTP. Status: bit 0 is set where the wrist point has a negative x in the frame
that A1 turns (the overhead area), bit 1 where A3 is not less than where the arm is stretched, bit 2 where A5
is above zero. Turn: bit i is set where A(i + 1) is negative.

The form is that of Brandstoetter, Angerer and Hofbaur (2014), without lateral offset. py-opw-kinematics has
it, too. We do without: it loses branches where they meet (of 500 poses with A5 = 0, up to a fifth), has no
say in which joint keeps its position there, takes 1.7 ms for 200 poses of a line where this takes 0.05, and
brings SciPy.
"""

from __future__ import annotations

from iiwa_sim.robot.closed_form import ClosedForm, Reach
from iiwa_sim.robot.follow import Side
from iiwa_sim.robot.inverse_kernel import OPW
from iiwa_sim.robot.model import Model
from iiwa_sim.robot.opw_geometry import geometry_of
from iiwa_sim.robot.trigonometry_kernel import cosine, sine


def opw(model: Model) -> ClosedForm:
    """The closed form of this arm, which has no redundancy.

    Raises `RobotFault` where the model is no such arm.
    """
    geometry = geometry_of(model)
    upper, fore = geometry.lengths
    stretched = geometry.stretched
    shoulder, (ux, uz), forearm, hand, signs, unturned = geometry
    a3_stretched = signs[2] * stretched  # A3 where the arm is (rad)
    lengths = (fore / upper, (upper + fore) ** 2, 0.25 / (upper * fore))
    turned = (sine(stretched), cosine(stretched))
    numbers = (*shoulder, ux, uz, hand, *lengths, *turned, *signs, *unturned, *forearm, a3_stretched)
    sides = tuple(
        (Side(2, a3_stretched, not status & 2), Side(4, 0.0, not status & 4)) for status in range(8)
    )
    x, y, z = (-hand * each for each in unturned[::3])
    reach = Reach(shoulder, upper, fore, (x, y, z))
    return ClosedForm(OPW, numbers, None, sides, "the wrist is on the axis of A1", reach)

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

from collections.abc import Sequence
from math import sqrt

from iiwa_sim.frames import Transform, multiply
from iiwa_sim.robot.follow import Side, follow_seed
from iiwa_sim.robot.inverse_kernel import OPW, Inverse
from iiwa_sim.robot.model import Model
from iiwa_sim.robot.opw_geometry import geometry_of
from iiwa_sim.robot.trigonometry_kernel import cosine, sine


class Opw(Inverse):
    """The closed form. There is no redundancy."""

    def __init__(self, model: Model) -> None:
        """Raises `RobotFault` where the model is no such arm."""
        self.geometry = geometry_of(model)
        upper, fore = self.geometry.lengths
        stretched = self.geometry.stretched
        (sx, sz), (ux, uz), forearm, hand, signs, unturned = self.geometry
        self._stretched = signs[2] * stretched  # A3 where the arm is (rad)
        lengths = (fore / upper, (upper + fore) ** 2, 0.25 / (upper * fore))
        turned = (sine(stretched), cosine(stretched))
        numbers = (sx, sz, ux, uz, hand, *lengths, *turned, *signs, *unturned, *forearm, self._stretched)
        super().__init__(model, OPW, numbers, "the wrist is on the axis of A1")

    def beyond_reach(self, flange: Transform) -> float:
        upper, fore = self.geometry.lengths
        shoulder_x, shoulder_z = self.geometry.shoulder
        hand, along = self.geometry.hand, multiply(flange.rotation, self.geometry.unturned)[::3]
        x, y, z = (at - hand * axis for at, axis in zip(flange.translation, along, strict=True))
        out = sqrt(x * x + y * y)
        ways = []
        for side in (out, -out):  # before the shoulder, or in the overhead area behind it
            away = sqrt((side - shoulder_x) ** 2 + (z - shoulder_z) ** 2)
            ways.append(max(away - upper - fore, 0.0) + min(away - abs(upper - fore), 0.0))
        return min(ways, key=abs)

    def followed(
        self,
        flange: Transform,
        redundancy: float,  # noqa: ARG002  other arms have one
        status: int,
        seed: Sequence[float],
    ) -> tuple[float, ...] | None:
        sides = (Side(2, self._stretched, not status & 2), Side(4, 0.0, not status & 4))
        q = follow_seed(self.model, flange, seed, sides)
        if q is None:
            return None
        x = self.distances(q)[0]
        if abs(x) > 1e-9 and (x < 0.0) != bool(status & 1):
            return None
        return q

"""Inverse kinematics of a seven-joint S-R-S arm (spherical shoulder and wrist) in closed form, A3 given.

With the wrist point w seen from the shoulder, its distance gives A4. In the frame that A1 and A2 turn, the
wrist point is v = (-d5 sinA4 cosA3, -d5 sinA4 sinA3, d3 + d5 cosA4); turned by A2 its height must be that of
w, turned by A1 its direction. What is left of the orientation is a Z-Y-Z wrist. A4, A2 and A6 have two
solutions each, told apart by the status: bit 0 is set where the wrist point has a negative x in the frame
that A1 turns, bit 1 where A4 is negative, bit 2 where A6 is zero or negative.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

from iiwa_sim.frames import Transform
from iiwa_sim.robot.inverse_kernel import SRS, Inverse
from iiwa_sim.robot.model import Model
from iiwa_sim.robot.srs_geometry import lengths_of
from iiwa_sim.robot.srs_singular import follow_on_branch


class Srs(Inverse):
    """Closed form with A3 as the redundancy."""

    def __init__(self, model: Model) -> None:
        """Raises `RobotFault` where the model is no S-R-S arm."""
        self.lengths = lengths_of(model)
        sideways = "the wrist is on the axis of A1, or beside it as far as A3 allows"
        super().__init__(model, SRS, self.lengths, sideways)

    def followed(
        self, flange: Transform, redundancy: float, status: int, seed: Sequence[float]
    ) -> tuple[float, ...] | None:
        return follow_on_branch(self, flange, redundancy, status, seed)

    def beyond_reach(self, flange: Transform) -> float:
        base_shoulder, upper, fore, hand = self.lengths
        (_, _, r02, _, _, r12, _, _, r22), (x, y, z) = flange
        away = sqrt((x - hand * r02) ** 2 + (y - hand * r12) ** 2 + (z - hand * r22 - base_shoulder) ** 2)
        return max(away - upper - fore, 0.0) + min(away - abs(upper - fore), 0.0)

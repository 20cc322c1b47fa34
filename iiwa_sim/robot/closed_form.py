"""What the inverse kinematics needs to know of an arm: its closed form, its dimensions and its reach."""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

from iiwa_sim.frames import Transform, Vector, apply
from iiwa_sim.robot.follow import Side


class Reach(NamedTuple):
    """Where upper arm and forearm bring the wrist point, in m."""

    shoulder: tuple[float, float]
    """x and z of the joint that tilts the upper arm, in the base, while the first joint is at zero."""
    upper: float
    fore: float
    """Length from the elbow to the wrist point."""
    wrist_in_flange: Vector

    def beyond(self, flange: Transform) -> float:
        """How far (m) the wrist point of this pose of the flange in the base is beyond reach.

        Above 0 where it is too far away, below 0 where it is too near; 0 within reach, whether or not joint
        limits and the redundancy leave a way.
        """
        x, y, z = apply(flange, self.wrist_in_flange)
        out = sqrt(x * x + y * y)
        ways = []
        for side in (out, -out):  # before the shoulder, or in the overhead area behind it
            away = sqrt((side - self.shoulder[0]) ** 2 + (z - self.shoulder[1]) ** 2)
            too_far = max(away - self.upper - self.fore, 0.0)
            ways.append(too_far + min(away - abs(self.upper - self.fore), 0.0))
        return min(ways, key=abs)


class ClosedForm(NamedTuple):
    """The closed form of an arm's inverse kinematics, of eight branches that three bits of the status tell
    apart."""

    kind: int
    """SRS or OPW of `iiwa_sim.robot.inverse_kernel`."""
    numbers: tuple[float, ...]
    """The dimensions of the arm, as the kernel of that kind takes them."""
    redundant: int | None
    """Index of the joint whose position is the redundancy; None for an arm without redundancy."""
    sides: tuple[tuple[Side, ...], ...]
    """For each status on which sides two joints are: those whose solutions its bits 1 and 2 tell apart."""
    sideways: str
    """Where the wrist is when the branches of bit 0 meet, in words."""
    reach: Reach

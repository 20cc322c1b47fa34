"""What a gripper's jaws are to surfaces and parts that lie: capsules, side by side, within each jaw."""

from __future__ import annotations

from math import ceil

from iiwa_sim.contact.worn import PARTS, SURFACES, Worn
from iiwa_sim.frames import Transform
from iiwa_sim.handling.gripper import Jaws
from iiwa_sim.robot.capsules import Capsule

MOST = 8
"""Capsules in a jaw."""
NAMES = ("jaw 1", "jaw 2")
"""As contacts are told: the jaw on the side of y of the TCP, and the other."""
TIP = "tip"
"""The sphere round the TCP, as parts meet it."""


class Fingers:
    """The jaws of a gripper as the flange has them, however far apart."""

    def __init__(self, jaws: Jaws, tool_in_flange: Transform, radius_m: float) -> None:
        """With the TCP there, and a sphere round it, `radius_m`, as parts that lie meet it: only between jaws
        that are closer than it is thick, since else it is where a part is gripped."""
        wide, thick, long = jaws.jaw_m
        radius = 0.5 * min(wide, thick)
        count = min(MOST, ceil(max(wide, thick) / (2.0 * radius)))
        spread = 0.5 * max(wide, thick) - radius
        self._tool = tool_in_flange
        self._thick_m, self._radius_m, self._share = thick, radius, 1.0 / count
        self._top, self._tip = min(-radius, radius - long), -radius
        offs = [spread * (2.0 * number / (count - 1) - 1.0) if count > 1 else 0.0 for number in range(count)]
        # Of each capsule of a jaw: along x, and along y from the middle of the jaw.
        self._offs = [(off, 0.0) if wide >= thick else (0.0, off) for off in offs]
        self._ball_m = radius_m

    def at(self, opening_m: float) -> tuple[Worn, ...]:
        """With the jaws so far apart."""
        (r0, r1, r2, r3, r4, r5, r6, r7, r8), (tx, ty, tz) = self._tool
        found = []
        for name, side in zip(NAMES, (1.0, -1.0), strict=True):
            middle = side * 0.5 * (opening_m + self._thick_m)
            for x, off in self._offs:
                y = middle + off
                ends = [
                    (
                        r0 * x + r1 * y + r2 * z + tx,
                        r3 * x + r4 * y + r5 * z + ty,
                        r6 * x + r7 * y + r8 * z + tz,
                    )
                    for z in (self._top, self._tip)
                ]
                capsule = Capsule(name, 0, ends[0], ends[1], self._radius_m)
                found.append(Worn(capsule, SURFACES + PARTS, self._share))
        if self._ball_m > 0.0:
            feels = PARTS if opening_m < 2.0 * self._ball_m else 0
            found.append(Worn(Capsule(TIP, 0, (tx, ty, tz), (tx, ty, tz), self._ball_m), feels))
        return tuple(found)

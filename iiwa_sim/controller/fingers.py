"""The jaws of a gripper as surfaces meet them: capsules, side by side, within each jaw."""

from __future__ import annotations

from math import ceil

from iiwa_sim.contact.worn import Worn
from iiwa_sim.frames import Transform, apply
from iiwa_sim.robot.capsules import Capsule
from iiwa_sim.world.gripper import Jaws

MOST = 8
"""Capsules in a jaw."""


class Fingers:
    """The jaws of a gripper in the flange, at any opening."""

    def __init__(self, jaws: Jaws, tool_in_flange: Transform) -> None:
        wide, thick, long = jaws.jaw_m
        self._thick, self._radius = thick, 0.5 * min(wide, thick)
        count = min(MOST, ceil(max(wide, thick) / (2.0 * self._radius)))
        spread = 0.5 * max(wide, thick) - self._radius
        self._share = 1.0 / count
        offs = [spread * (2.0 * number / (count - 1) - 1.0) if count > 1 else 0.0 for number in range(count)]
        places = [(off, 0.0) if wide >= thick else (0.0, off) for off in offs]
        top, tip = min(-self._radius, self._radius - long), -self._radius
        self._ends = [[apply(tool_in_flange, (x, y, z)) for z in (top, tip)] for x, y in places]
        self._across = tool_in_flange.rotation[1::3]

    def at(self, opening_m: float) -> tuple[Worn, ...]:
        """Return the capsules with the jaws so far apart."""
        middle = 0.5 * (opening_m + self._thick)
        found = []
        for name, side in (("jaw 1", middle), ("jaw 2", -middle)):
            dx, dy, dz = (side * each for each in self._across)
            for (ax, ay, az), (bx, by, bz) in self._ends:
                ends = (ax + dx, ay + dy, az + dz), (bx + dx, by + dy, bz + dz)
                found.append(Worn(Capsule(name, 0, *ends, self._radius), self._share))
        return tuple(found)

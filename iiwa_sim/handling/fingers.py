"""What a gripper's jaws are to surfaces and parts that lie: capsules, side by side, within each jaw."""

from __future__ import annotations

from math import ceil

from iiwa_sim.contact.link_forces_kernel import PARTS, SURFACES
from iiwa_sim.contact.links_kernel import Worn
from iiwa_sim.frames import Transform, Vector, apply
from iiwa_sim.handling.gripper import Jaws
from iiwa_sim.robot.capsules import Capsule

MOST = 8
"""Capsules in a jaw."""
NAMES = ("jaw 1", "jaw 2")
"""As contacts are told: the jaw on the side of y of the TCP, and the other."""
TIP = "tip"
"""The sphere round the TCP, as parts meet it."""


def fingers(jaws: Jaws, opening_m: float, tool_in_flange: Transform, radius_m: float) -> tuple[Worn, ...]:
    """Jaws so far apart, as in the flange; and the sphere round the TCP, `radius_m`, as parts that lie meet
    it: only between jaws that are closer than it is thick, since else it is where a part is gripped."""
    wide, thick, long = jaws.jaw_m
    radius = 0.5 * min(wide, thick)
    count = min(MOST, ceil(max(wide, thick) / (2.0 * radius)))
    spread = 0.5 * max(wide, thick) - radius
    found = []

    def worn(name: str, top: Vector, tip: Vector, radius_m: float, feels: int) -> Worn:
        ends = apply(tool_in_flange, top), apply(tool_in_flange, tip)
        return Worn(Capsule(name, 0, *ends, radius_m), feels, 1.0 if name == TIP else 1.0 / count)

    for name, side in zip(NAMES, (1.0, -1.0), strict=True):
        middle = side * 0.5 * (opening_m + thick)
        for number in range(count):
            off = spread * (2.0 * number / (count - 1) - 1.0) if count > 1 else 0.0
            x, y = (off, middle) if wide >= thick else (0.0, middle + off)
            top, tip = min(-radius, radius - long), -radius
            found.append(worn(name, (x, y, top), (x, y, tip), radius, SURFACES + PARTS))
    if radius_m > 0.0:
        here = (0.0, 0.0, 0.0)
        found.append(worn(TIP, here, here, radius_m, PARTS if opening_m < 2.0 * radius_m else 0))
    return tuple(found)

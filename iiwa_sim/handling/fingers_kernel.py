"""What a gripper's jaws are to surfaces and parts that lie: capsules, side by side, within each jaw."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from math import ceil
from typing import Any

import cython
import numpy as np

from iiwa_sim.contact.worn import PARTS, SURFACES, Worn
from iiwa_sim.frames import Transform
from iiwa_sim.handling.gripper import Jaws
from iiwa_sim.robot.capsules import Capsule

if cython.compiled:
    from cython.cimports.iiwa_sim.robot.record_kernel import record
else:
    from iiwa_sim.robot.record_kernel import record

MOST = 8
"""Capsules in a jaw."""
NAMES = ("jaw 1", "jaw 2")
"""As contacts are told: the jaw on the side of y of the TCP, and the other."""
TIP = "tip"
"""The sphere round the TCP, as parts meet it."""


@cython.cclass
class Fingers:
    """The jaws of a gripper as the flange has them, however far apart."""

    _offs: Any  # of each capsule of a jaw: along x, and along y from the middle of the jaw
    _thick: cython.double
    _radius: cython.double
    _share: Any
    _top: cython.double
    _tip: cython.double
    _turned: cython.double[::1]  # the TCP in the flange: rotation, row by row
    _place: cython.double[::1]  # and place (m)
    _ball: cython.double

    def __init__(self, jaws: Jaws, tool_in_flange: Transform, radius_m: float) -> None:
        """With the TCP there, and a sphere round it, `radius_m`, as parts that lie meet it: only between jaws
        that are closer than it is thick, since else it is where a part is gripped."""
        wide, thick, long = jaws.jaw_m
        radius = 0.5 * min(wide, thick)
        count = min(MOST, ceil(max(wide, thick) / (2.0 * radius)))
        spread = 0.5 * max(wide, thick) - radius
        self._turned, self._place = np.array(tool_in_flange[0]), np.array(tool_in_flange[1])
        self._thick, self._radius, self._ball = thick, radius, radius_m
        self._share = 1.0 / count
        self._top, self._tip = min(-radius, radius - long), -radius
        offs = [spread * (2.0 * number / (count - 1) - 1.0) if count > 1 else 0.0 for number in range(count)]
        self._offs = [(off, 0.0) if wide >= thick else (0.0, off) for off in offs]

    def at(self, opening_m: float) -> tuple[Worn, ...]:
        """With the jaws so far apart."""
        opening: cython.double = opening_m
        x: cython.double
        off: cython.double
        found: list[Worn] = []
        for side in range(2):
            middle: cython.double = (1.0 if side == 0 else -1.0) * 0.5 * (opening + self._thick)
            for x, off in self._offs:
                y = middle + off
                ends = self._end(x, y, self._top), self._end(x, y, self._tip)
                capsule = record(Capsule, (NAMES[side], 0, *ends, self._radius))
                found.append(record(Worn, (capsule, SURFACES + PARTS, self._share)))
        if self._ball > 0.0:
            feels = PARTS if opening < 2.0 * self._ball else 0
            tip = self._end(0.0, 0.0, 0.0)
            found.append(Worn(Capsule(TIP, 0, tip, tip, self._ball), feels))
        return tuple(found)

    @cython.cfunc
    def _end(self, x: cython.double, y: cython.double, z: cython.double) -> object:
        """A place (m) in the TCP, as the flange has it."""
        r, t = self._turned, self._place
        return (
            r[0] * x + r[1] * y + r[2] * z + t[0],
            r[3] * x + r[4] * y + r[5] * z + t[1],
            r[6] * x + r[7] * y + r[8] * z + t[2],
        )

"""True load at the flange, and the tool load that the controller assumes.

The controller subtracts from the torques on the joints what its tool load makes of weight and acceleration.
So of what is really there only the difference to that is a load from outside, at every pose and in every
motion.
"""

from __future__ import annotations

from math import hypot, isfinite
from typing import NamedTuple

from iiwa_sim.contact.external_wrench import ExternalWrench
from iiwa_sim.contact.payload import NO_MOMENTS, Moments, body
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.frames import Vector
from iiwa_sim.motion.joints import Joints
from iiwa_sim.robot.capsules import Capsule

GREATEST_MASS_KG = 1000.0
FARTHEST_M = 10.0
"""Farthest place from the flange, along each axis."""
WITHIN_REACH_M = 1.0
"""Distance from the flange: no part that a gripper holds has its middle farther away."""
Inertia = tuple[float, float, float, float, float, float]
"""kg m^2: ixx, iyy, izz, ixy, ixz, iyz, about the centre of mass, with the signs of URDF."""


class ToolLoad(NamedTuple):
    """Load that the controller assumes at the flange."""

    mass_kg: float
    centre: Vector
    """The centre of mass, in the flange (m)."""

    def told(self) -> tuple[float, float, float, float]:
        """The load as commands have it: kg, and the centre in mm."""
        x, y, z = self.centre
        return self.mass_kg, 1e3 * x, 1e3 * y, 1e3 * z


NO_LOAD = ToolLoad(0.0, (0.0, 0.0, 0.0))


class Tool(NamedTuple):
    """Tool at the flange: load, inertia and shape."""

    load: ToolLoad
    inertia: Inertia
    capsules: tuple[Capsule, ...] = ()
    """The shape of the tool, in the flange: what of it touches surfaces."""

    def moments(self) -> Moments:
        """Moments in the flange."""
        return body(*self.load, self.inertia)


class Carrying:
    """The tool of one arm, which the controller believes to be there at first, as it is."""

    def __init__(self, tool: Tool | None, load: ExternalWrench) -> None:
        """Start with a tool, or with no load for None; `load` gets the difference."""
        self._load = load
        self._inertia = (0.0,) * 6 if tool is None else tool.inertia
        self._tool = NO_LOAD if tool is None else tool.load
        self._there = NO_MOMENTS if tool is None else tool.moments()
        self.believed = NO_LOAD if tool is None else tool.load

    def believe(self, believed: ToolLoad, joints: Joints) -> None:
        """Set the assumed load: with the inertia of the tool, and what is more than the tool
        as a mass in the one place where it makes the centre what it is, if that is near.

        The robot is at `joints` (rad). Raises `Refused` for numbers out of range.
        """
        mass, centre = believed
        if not 0.0 <= mass <= GREATEST_MASS_KG:
            raise Refused(EXECUTION, f"mass {mass:g} kg: expected 0 to {GREATEST_MASS_KG:g} kg")
        for axis, value in zip("xyz", centre, strict=True):
            if not (isfinite(value) and abs(value) <= FARTHEST_M):
                expected = f"expected {-1e3 * FARTHEST_M:g} to {1e3 * FARTHEST_M:g} mm"
                raise Refused(EXECUTION, f"centre of mass at {axis} {1e3 * value:g} mm: {expected}")
        self.believed = believed
        self._tell(joints)

    def _tell(self, joints: Joints) -> None:
        mass, centre = self.believed
        believed = body(mass, centre, self._inertia) if mass else NO_MOMENTS
        more = mass - self._tool.mass_kg
        if more > 0.0:
            x, y, z = (
                (mass * both - self._tool.mass_kg * own) / more
                for both, own in zip(centre, self._tool.centre, strict=True)
            )
            if hypot(x, y, z) <= WITHIN_REACH_M:
                believed = self._there + body(more, (x, y, z))
        unknown = self._there - believed
        self._load.carry(unknown if unknown.any() else None, joints)

"""Tool at the flange, and the load that the controller assumes there.

The controller subtracts from the torques on the joints those of the assumed load. Only the difference to the
true load acts from outside, at every pose and in every motion.
"""

from __future__ import annotations

from typing import NamedTuple

from iiwa_sim.contact.payload import NO_MOMENTS, Moments, body
from iiwa_sim.frames import Vector
from iiwa_sim.robot.capsules import Capsule

Inertia = tuple[float, float, float, float, float, float]
"""kg m^2: ixx, iyy, izz, ixy, ixz, iyz, about the centre of mass, with the signs of URDF."""


class ToolLoad(NamedTuple):
    """Load that the controller assumes at the flange."""

    mass_kg: float
    centre: Vector
    """The centre of mass, in the flange (m)."""

    def in_mm(self) -> tuple[float, float, float, float]:
        """Return mass (kg) and centre (mm), as in commands."""
        x, y, z = self.centre
        return self.mass_kg, 1e3 * x, 1e3 * y, 1e3 * z


class Tool(NamedTuple):
    """Tool at the flange: load, inertia and shape."""

    load: ToolLoad
    inertia: Inertia
    capsules: tuple[Capsule, ...] = ()
    """The shape of the tool, in the flange."""


NO_TOOL = Tool(ToolLoad(0.0, (0.0, 0.0, 0.0)), (0.0,) * 6)


def unknown_load(tool: Tool, assumed: ToolLoad) -> Moments | None:
    """Return the moments at the flange, of a true tool, that the controller does not assume; None for none.

    Its assumed load has the inertia of the tool.
    """
    mass, centre = assumed
    known = body(mass, centre, tool.inertia) if mass else NO_MOMENTS
    unknown: Moments = body(*tool.load, tool.inertia) - known
    return unknown if unknown.any() else None

"""A move with its path, as a chain holds it."""

from collections.abc import Callable
from typing import NamedTuple

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.path.piecewise_kernel import Polynomial
from iiwa_sim.motion.path.zone_kernel import Zone


class Move(NamedTuple):
    """A move ready to run. Moves are numbered in the order in which they were accepted."""

    number: int
    path: Polynomial
    limits: JointLimits
    """Limits of the joints, velocities lowered to the speed of this move."""
    length_s: float
    """How long (s) its path takes at the velocity limits of the joints; 0 where it goes nowhere."""
    zone: Zone | None
    """Where it may leave its path to blend into the next move; None where it stops at its target."""
    again: Callable[[Joints], "Move | None"]
    """Plans a path to the same target from other joint positions (rad); gives None where there is none."""

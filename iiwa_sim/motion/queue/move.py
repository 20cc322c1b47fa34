"""A move that a chain can hold."""

from collections.abc import Callable
from typing import NamedTuple

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.path.polynomial import Polynomial
from iiwa_sim.motion.path.zone import Zone


class Move(NamedTuple):
    """A move ready to run. Moves are numbered in the order in which they were accepted."""

    number: int
    path: Polynomial
    limits: JointLimits
    """At the speed of this move."""
    length_s: float
    """How long its joints take at the least, by their velocity limits; 0 where there is no way to go."""
    zone: Zone | None
    """Where it may blend into the next one; without, it stops at its target."""
    again: Callable[[Joints], "Move | None"]
    """The same move planned to begin elsewhere (rad), None where it cannot be done from there."""

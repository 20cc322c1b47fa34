"""How a reference is smoothed, so that the robot can follow it: two moving averages, one after the other.

An average never leaves the range of what it averages. So averaging over the newest `T` seconds keeps
positions and velocities within their limits, and bounds the next derivative by (range of this one) / T. The
first average, T1 wide, is needed where velocities jump, as between straight lines, or change faster than the
robot accelerates; the second, T2 wide, where accelerations do. A reference that asks for nothing the robot
cannot do is not averaged at all. Else the robot is (T1 + T2) / 2 behind it.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.motion.limits import Array, JointLimits
from iiwa_sim.motion.trajectory.reference import Reference

KEPT = 0.99
"""Part of the limits of acceleration and jerk that is used: the override needs the rest to change."""
SMOOTH = 1e-9
"""Part of a limit by which what is said to be continuous may jump: rounding."""
NARROWEST_S = 1e-4
"""No average is narrower, but for none."""


class Windows(NamedTuple):
    """Widths of the two averages (s)."""

    first_s: float
    second_s: float

    @property
    def width_s(self) -> float:
        """How long after the end of the reference the robot rests there."""
        return self.first_s + self.second_s


def windows_of(reference: Reference, limits: JointLimits, *, from_rest: bool = True) -> Windows:
    """The widths with which a reference within the limits of velocity keeps those of acceleration and jerk.

    `from_rest` says whether the robot stands still at its start; else it is no part of the averages'
    beginning: the robot joins later than the averages are wide.
    """
    most_a, most_j = KEPT * limits.acceleration, KEPT * limits.jerk
    speeds, accelerations = reference.range(1), reference.range(2)
    jumps = reference.largest_jump(1, from_rest=from_rest) > SMOOTH * limits.velocity
    too_fast = jumps | (accelerations.magnitude > most_a)
    if too_fast.any():
        first_s = _width(speeds.width / most_a, too_fast)
        largest = speeds.width / first_s
        largest[~jumps] = largest[~jumps].clip(max=accelerations.magnitude[~jumps])
        return Windows(first_s, _width(2.0 * largest / most_j, largest > 0.0))
    too_sudden = (reference.largest_jump(2, from_rest=from_rest) > SMOOTH * limits.acceleration) | (
        reference.range(3).magnitude > most_j
    )
    return Windows(0.0, _width(accelerations.width / most_j, too_sudden))


def _width(widths_s: Array, needed: NDArray[np.bool_]) -> float:
    return max(float(widths_s[needed].max()), NARROWEST_S) if needed.any() else 0.0

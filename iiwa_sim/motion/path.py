"""What a path is: joint positions over a parameter s from 0 to 1, and its shape at samples.

The samples are what a timing is planned from; a path has to give positions only, derivatives are taken from
differences.
"""

from typing import NamedTuple, Protocol

import numpy as np

from iiwa_sim.motion.differences import derivatives
from iiwa_sim.motion.limits import Array, JointLimits

Joints = tuple[float, ...]

STENCIL = 7  # samples in a difference: sixth order for q', fourth for q'''
COARSE_STENCIL = 5  # to judge by what the samples resolve


class Path(Protocol):
    """A curve in joint space."""

    @property
    def end(self) -> Joints:
        """Joint positions (rad) at s = 1, exactly."""

    def joints(self, s: float) -> Joints:
        """Joint positions (rad) at 0 <= s <= 1."""

    def joints_along(self, s: Array) -> list[Joints]:
        """The same at rising values of s (m,), for less where there are many."""


class PathSamples(NamedTuple):
    """A path at m rising values of s (m,), 0 and 1 included; the others are (m, n), in rad per unit of s."""

    s: Array
    q: Array
    dq: Array
    ddq: Array
    dddq: Array

    @classmethod
    def of(cls, s: Array, q: Array) -> "PathSamples":
        """The samples of a path with positions q (m, n) at values of s (m,)."""
        return cls(s, q, *derivatives(s, q, STENCIL))

    def uncertainty(self, limits: JointLimits) -> Array:
        """How far accelerations and jerks at each sample may be off, as parts of the limits (m,).

        Estimated by the change that coarser differences make, at the greatest speed that is possible: by
        the velocity limits there, and by what acceleration and jerk build up on a way of 1 from rest to rest.
        """
        _, ddq, dddq = derivatives(self.s, self.q, COARSE_STENCIL)
        # Joints come first: reductions over joints then run along memory.
        velocity, acceleration, jerk = (limit[:, None] for limit in limits)
        rate = np.maximum(np.abs(np.ascontiguousarray(self.dq.T)), 1e-9)
        fastest = min(
            float((acceleration / rate).min(axis=0).max()) ** (1 / 2),
            float((jerk / rate).min(axis=0).max()) ** (1 / 3),
        )
        ds = np.minimum((velocity / rate).min(axis=0), fastest)
        square = ds * ds
        acceleration_off = (np.abs((ddq - self.ddq).T) / acceleration).max(axis=0) * square
        jerk_off = (np.abs((dddq - self.dddq).T) / jerk).max(axis=0) * (square * ds)
        uncertainty: Array = np.maximum(acceleration_off, jerk_off)
        return uncertainty

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

    @property
    def samples(self) -> "PathSamples":
        """Enough of them to tell how the joints move between."""

    @property
    def tcp_length_m(self) -> float | None:
        """How far the TCP goes, where it goes straight and evenly with s."""

    def joints(self, s: float) -> Joints:
        """Joint positions (rad) at 0 <= s <= 1."""

    def joints_along(self, s: Array) -> Array:
        """The same (m, n) at rising values of s (m,), for less where there are many."""


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

    def scaled(self, length: float) -> "PathSamples":
        """The same over s times `length`."""
        s, q, dq, ddq, dddq = self
        return PathSamples(s * length, q, dq / length, ddq / length**2, dddq / length**3)

    def at(self, s: float) -> tuple[Array, Array]:
        """First and second derivative (n,) at any s: those of the polynomial of fifth degree through the
        samples beside it and their first two derivatives."""
        k = min(max(int(self.s.searchsorted(s)), 1), len(self.s) - 1)
        width = float(self.s[k] - self.s[k - 1])
        x = (s - float(self.s[k - 1])) / width
        ends = np.concatenate(
            [self.q[k - 1 : k + 1], self.dq[k - 1 : k + 1] * width, self.ddq[k - 1 : k + 1] * width**2]
        )
        xx = x * x
        first = (
            (-30.0 + (60.0 - 30.0 * x) * x) * xx,
            (30.0 + (-60.0 + 30.0 * x) * x) * xx,
            1.0 + (-18.0 + (32.0 - 15.0 * x) * x) * xx,
            (-12.0 + (28.0 - 15.0 * x) * x) * xx,
            x * (1.0 + x * (-4.5 + (6.0 - 2.5 * x) * x)),
            xx * (1.5 + (-4.0 + 2.5 * x) * x),
        )
        second = (
            (-60.0 + (180.0 - 120.0 * x) * x) * x,
            (60.0 + (-180.0 + 120.0 * x) * x) * x,
            (-36.0 + (96.0 - 60.0 * x) * x) * x,
            (-24.0 + (84.0 - 60.0 * x) * x) * x,
            1.0 + (-9.0 + (18.0 - 10.0 * x) * x) * x,
            (3.0 + (-12.0 + 10.0 * x) * x) * x,
        )
        derivatives_here = np.array([first, second]) @ ends
        return derivatives_here[0] / width, derivatives_here[1] / width**2

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

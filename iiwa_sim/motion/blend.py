"""A blend: a curve in joint space from one path to the next, past the target between them.

In a parameter u from 0 to 1 it is the polynomial of fifth degree that leaves one path and enters the other
with their first and second derivatives. The chain's parameter x, in which all pieces of a chain are joined,
goes like a uniformly accelerated motion from 0 to its length: dx/du is 2 before at the start and 2 after at
the end, where before and after are the lengths of the two parts of paths that the blend replaces. So where
two paths go on straight and evenly into each other, the blend is just that straight line.
"""

from math import sqrt

import numpy as np

from iiwa_sim.motion.limits import Array, JointLimits
from iiwa_sim.motion.sampled_path import Joints, PathSamples

SAMPLES = 25  # with 17, accelerations between two of them were up to 4 % larger
_U = np.linspace(0.0, 1.0, SAMPLES)
_ZERO = np.zeros(SAMPLES)
_ONE = np.ones(SAMPLES)
# The polynomial and its derivatives at the samples: (4 SAMPLES, 6).
_BASIS = np.concatenate(
    [
        np.stack([_ONE, _U, _U**2, _U**3, _U**4, _U**5], axis=1),
        np.stack([_ZERO, _ONE, 2.0 * _U, 3.0 * _U**2, 4.0 * _U**3, 5.0 * _U**4], axis=1),
        np.stack([_ZERO, _ZERO, 2.0 * _ONE, 6.0 * _U, 12.0 * _U**2, 20.0 * _U**3], axis=1),
        np.stack([_ZERO, _ZERO, _ZERO, 6.0 * _ONE, 24.0 * _U, 60.0 * _U**2], axis=1),
    ]
)
# From position, first and second derivative at both ends to the coefficients.
_HERMITE = np.array(
    [
        [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.5, 0.0, 0.0, 0.0],
        [-10.0, -6.0, -1.5, 10.0, -4.0, 0.5],
        [15.0, 8.0, 1.5, -15.0, 7.0, -1.0],
        [-6.0, -3.0, -0.5, 6.0, -3.0, 0.5],
    ]
)


Place = tuple[Array, Array, Array]
"""Where a path is cut: joints (rad) and their first two derivatives by the chain's parameter, each (n,)."""


class Blend:
    """The curve between two places, over x from 0 to `length`."""

    def __init__(self, leaves: Place, enters: Place, before: float, after: float) -> None:
        """`before` and `after` are how much of either path it replaces, in the chain's parameter."""
        self.length = before + after
        self._before = before
        self._bend = bend = after - before
        (q0, dq0, ddq0), (q1, dq1, ddq1) = leaves, enters
        ends = [
            q0,
            2.0 * before * dq0,
            4.0 * before**2 * ddq0 + 2.0 * bend * dq0,
            q1,
            2.0 * after * dq1,
            4.0 * after**2 * ddq1 + 2.0 * bend * dq1,
        ]
        self._coefficients = _HERMITE @ np.array(ends)
        self._at_samples = (_BASIS @ self._coefficients).reshape(4, SAMPLES, -1)

    @property
    def places(self) -> list[Joints]:
        """Joint positions (rad) from one end to the other."""
        return list(map(tuple, self._at_samples[0].tolist()))

    def joints(self, x: float) -> Joints:
        """Joint positions (rad)."""
        u = x / (self._before + sqrt(max(self._before**2 + self._bend * x, 0.0)))
        a, b, c, d, e, f = self._coefficients
        return tuple((a + u * (b + u * (c + u * (d + u * (e + u * f))))).tolist())

    def joints_along(self, x: Array) -> Array:
        """The same (m, n) at values of x (m,)."""
        u = (x / (self._before + np.sqrt((self._before**2 + self._bend * x).clip(0.0))))[:, None]
        a, b, c, d, e, f = self._coefficients
        joints: Array = a + u * (b + u * (c + u * (d + u * (e + u * f))))
        return joints

    def samples(self) -> PathSamples:
        """Over x."""
        q, du, ddu, dddu = self._at_samples
        # dx/du goes straight from 2 before to 2 after.
        rate = (2.0 * (self._before + self._bend * _U))[:, None]
        bend = 2.0 * self._bend
        dq = du / rate
        ddq = (ddu - bend * dq) / rate**2
        dddq = (dddu - 3.0 * bend * rate * ddq) / rate**3
        return PathSamples(self._x(), q, dq, ddq, dddq)

    def velocity_limits(self, first: JointLimits, second: JointLimits) -> Array:
        """At the samples (SAMPLES, n), rad/s: those of one move go over evenly into those of the next."""
        part = (self._x() / self.length)[:, None]
        limits: Array = first.velocity + part * (second.velocity - first.velocity)
        return limits

    def _x(self) -> Array:
        x: Array = _U * (2.0 * self._before + self._bend * _U)
        x[-1] = self.length
        return x

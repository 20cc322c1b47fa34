"""A mass on a spring and a damper, moved on exactly, whatever the step and however it is damped."""

from math import sqrt
from typing import TypeVar

import numpy as np

from iiwa_sim.motion.limits import Array

DAMPING_RATIO = 0.7
"""Published: the original's. A step of the force overshoots by 4.6 %."""
Quantity = TypeVar("Quantity", float, Array)

TAYLOR_TERMS = 16
"""To the last digit where the matrix has a norm of at most 1/2."""


def damping(mass: float, stiffness: float, least: float = 0.0) -> float:
    """The damping that makes the ratio 0.7, but not less than the least: N and m, or Nm and rad, and s."""
    return max(2.0 * DAMPING_RATIO * sqrt(stiffness * mass), least)


class Spring:
    """m x'' = f - d x' - k x over a step, for a force f that stays the same in it.

    Units: kg, N, m and s, or kg m^2, Nm, rad and s.
    """

    def __init__(self, mass: float, stiffness: float, damping: float, step_s: float) -> None:
        rates = np.array([[0.0, 1.0, 0.0], [-stiffness / mass, -damping / mass, 1.0 / mass], [0.0, 0.0, 0.0]])
        matrix = _exponential(rates * step_s).tolist()
        (self._xx, self._xv, self._xf), (self._vx, self._vv, self._vf), _ = matrix
        self.coefficients: tuple[float, float, float, float, float, float]
        """Of x, v and f in the new x, then in the new v."""
        self.coefficients = (self._xx, self._xv, self._xf, self._vx, self._vv, self._vf)

    def step(self, x: Quantity, v: Quantity, f: Quantity) -> tuple[Quantity, Quantity]:
        """Position and velocity after a step; also of many at once, as arrays."""
        return (self._xx * x + self._xv * v + self._xf * f, self._vx * x + self._vv * v + self._vf * f)


def _exponential(matrix: Array) -> Array:
    """The matrix exponential, by Taylor's series of a part of it, and squaring."""
    halvings = max(int(np.ceil(np.log2(max(np.abs(matrix).sum(axis=1).max(), 1e-300)))) + 1, 0)
    part = matrix / 2.0**halvings
    term: Array = np.eye(len(matrix))
    result = term
    for k in range(1, TAYLOR_TERMS + 1):
        term = term @ part / k
        result = result + term
    for _ in range(halvings):
        result = result @ result
    return result

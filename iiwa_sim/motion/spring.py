"""A mass on a spring and a damper, integrated exactly for any step and any damping."""

from math import sqrt
from typing import TypeVar

import numpy as np

from iiwa_sim.motion.limits import Array

DAMPING_RATIO = 0.7
"""The published value of the original controller. A step of the force overshoots by 4.6 %."""
Quantity = TypeVar("Quantity", float, Array)

TAYLOR_TERMS = 16
"""Terms that give all digits for a matrix with a norm of at most 1/2."""


def damping(mass: float, stiffness: float, least: float = 0.0) -> float:
    """The damping for the damping ratio 0.7, but not less than `least`: N and m, or Nm and rad, and s."""
    return max(2.0 * DAMPING_RATIO * sqrt(stiffness * mass), least)


class Spring:
    """Solves m x'' = f - d x' - k x over a step with constant force f.

    Units: kg, N, m and s, or kg m^2, Nm, rad and s.
    """

    def __init__(self, mass: float, stiffness: float, damping: float, step_s: float) -> None:
        rates = np.array([[0.0, 1.0, 0.0], [-stiffness / mass, -damping / mass, 1.0 / mass], [0.0, 0.0, 0.0]])
        matrix = _exponential(rates * step_s).tolist()
        (self._xx, self._xv, self._xf), (self._vx, self._vv, self._vf), _ = matrix
        self.coefficients: tuple[float, float, float, float, float, float]
        """Coefficients of x, v and f for the new x, then for the new v."""
        self.coefficients = (self._xx, self._xv, self._xf, self._vx, self._vv, self._vf)

    def step(self, x: Quantity, v: Quantity, f: Quantity) -> tuple[Quantity, Quantity]:
        """Position and velocity after a step; also for arrays."""
        return (self._xx * x + self._xv * v + self._xf * f, self._vx * x + self._vv * v + self._vf * f)


def _exponential(matrix: Array) -> Array:
    """The matrix exponential, by scaling and squaring of Taylor's series."""
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

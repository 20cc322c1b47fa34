"""A mass on a spring and a damper, integrated exactly for any step and any damping."""

from math import sqrt

import numpy as np

from iiwa_sim.motion.limits import Array

DAMPING_RATIO = 0.7
"""The published value of the original controller. A step of the force overshoots by 4.6 %."""

TAYLOR_TERMS = 16
"""Terms that give all digits for a matrix with a norm of at most 1/2."""


def damping(mass: float, stiffness: float, least: float = 0.0) -> float:
    """The damping for the damping ratio 0.7, but not less than `least`: N and m, or Nm and rad, and s."""
    return max(2.0 * DAMPING_RATIO * sqrt(stiffness * mass), least)


def spring(mass: float, stiffness: float, damping: float, step_s: float) -> Array:
    """Solves m x'' = f - d x' - k x over a step with constant force f.

    Gives what x, x' and f count in the new x, then in the new x' (6,). Units: kg, N, m and s, or kg m^2, Nm,
    rad and s.
    """
    rates = np.array([[0.0, 1.0, 0.0], [-stiffness / mass, -damping / mass, 1.0 / mass], [0.0, 0.0, 0.0]])
    return _exponential(rates * step_s)[:2].ravel()


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

"""Springs, dampers and masses of a compliant robot: constants, exact steps, and motion within bounds."""

from collections.abc import Sequence
from functools import lru_cache
from math import ceil, log2, sqrt
from typing import Any, NamedTuple

import numpy as np

from iiwa_sim.motion.limits import Array

DAMPING_RATIO = 0.7
"""The published value of the original controller. A step of the force overshoots by 4.6 %."""
MASS_KG = 5.0
"""Apparent mass of the TCP. Our decision: about that of an iiwa in the middle of its work space."""
LEAST_DAMPING_NS_PER_M = 20.0
"""Our decision: without a spring, 10 N move the TCP at 0.5 m/s. Below 40.8 N/m the ratio is above 0.7."""
INERTIA_KGM2 = 0.2
"""Apparent moment of inertia of the TCP about any axis, and of the arm around a TCP that stays. Our decision:
its stiffest swing is as fast as that of the mass on the stiffest spring, 31.6 rad/s."""
ROTATIONAL_STIFFNESS_NM_PER_RAD = 200.0
"""Published: the original's."""
REDUNDANCY_STIFFNESS_NM_PER_RAD = 100.0
"""Published: the original's, of the null space."""
SINGULAR_INERTIA_KGM2 = 1e-4
"""Moment of inertia of each joint for itself: it matters only near singular poses."""
JOINT_INERTIA_KGM2 = 0.5
"""Apparent moment of inertia of each joint in a hold. Our decision."""
LEAST_DAMPING_NMS_PER_RAD = 5.0
"""Our decision: without a spring 6 Nm, 10 N at 0.6 m, turn a joint at 1.2 rad/s, as when guided by hand.
Below 25.5 Nm/rad the damping ratio is above 0.7."""
LONGEST_SUBSTEP_S = 0.001
"""In contact: with a surface of 1e5 N/m a mass of 5 kg swings at 141 rad/s, 0.14 rad in a substep."""
TAYLOR_TERMS = 16
"""Terms that give all digits for a matrix with a norm of at most 1/2."""


class CartesianImpedance(NamedTuple):
    """Stiffness of the TCP, and the wrench that it applies."""

    stiffness_n_per_m: float
    """In translation, the same in all directions."""
    control: tuple[float, float, float, float, float, float]
    """Force (N) and torque (Nm) that the controller adds, along the axes of the TCP, acting on the robot."""


def damping(mass: float, stiffness: float, least: float = 0.0) -> float:
    """Return the damping for `DAMPING_RATIO`, but not less than `least`: N and m, or Nm and rad, and s."""
    return max(2.0 * DAMPING_RATIO * sqrt(stiffness * mass), least)


@lru_cache(maxsize=32)  # a stream of moves has the same springs
def spring(mass: float, stiffness: float, damping: float, step_s: float) -> Array:
    """Solve m x'' = f - d x' - k x exactly over a step with constant force f.

    Return the factors of x, x' and f in the new x, then in the new x' (6,). Units: kg, N, m and s, or kg m^2,
    Nm, rad and s.
    """
    rates = np.array([[0.0, 1.0, 0.0], [-stiffness / mass, -damping / mass, 1.0 / mass], [0.0, 0.0, 0.0]])
    # The matrix exponential, by scaling and squaring of Taylor's series.
    norm = step_s * float(np.abs(rates).sum(axis=1).max())
    halvings = max(ceil(log2(norm)) + 1, 0)
    part = rates * (step_s / 2.0**halvings)
    term = result = np.eye(3)
    for k in range(1, TAYLOR_TERMS + 1):
        term = term @ part / k
        result = result + term
    for _ in range(halvings):
        result = result @ result
    return result[:2].ravel()


def least_deviation(
    jacobian: Array, wanted: Array, inertia: float, least: Sequence[float], greatest: Sequence[float]
) -> list[float]:
    """Return the joint motion (n,) between `least` and `greatest` (n,) that deviates least from a wanted one.

    By Gauss's principle it minimises |jacobian motion - wanted|^2 + inertia |motion|^2. The rows of the
    `jacobian` (m, n) and of `wanted` (m,) are weighted with the roots of masses. Joints that would pass a
    bound are put on it one after the other, the farthest first. The others make up for it as far as they can.
    """
    matrix = jacobian.T @ jacobian
    matrix.flat[:: len(matrix) + 1] += inertia
    target, low, high = jacobian.T @ wanted, np.array(least), np.array(greatest)
    motion: Any = np.linalg.solve(matrix, target)
    free = np.ones(len(motion), dtype=bool)
    while (beyond := np.maximum(low - motion, motion - high)).max() > 0.0:
        worst = int(beyond.argmax())
        free[worst] = False
        motion[worst] = min(max(motion[worst], low[worst]), high[worst])
        if free.any():
            rest = target[free] - matrix[np.ix_(free, ~free)] @ motion[~free]
            motion[free] = np.linalg.solve(matrix[np.ix_(free, free)], rest)
    found: list[float] = motion.tolist()
    return found

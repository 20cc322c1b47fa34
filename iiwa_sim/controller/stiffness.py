"""What stiffness moves and gravity holds ask for, checked."""

from collections.abc import Sequence
from math import isfinite

from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.motion.springs import CartesianImpedance

LARGEST_N_PER_M = 5000.0
"""Published: the original's."""
LARGEST_JOINT_NM_PER_RAD = 5000.0
"""Our decision."""


def impedance_of(stiffness_n_per_m: float, balanced: Sequence[float]) -> CartesianImpedance:
    """How the TCP is to yield: with this stiffness, and the negative of a wrench (N, Nm, TCP axes).

    Raises `Refused` for a stiffness out of range, and for numbers that are not finite.
    """
    _check(stiffness_n_per_m, LARGEST_N_PER_M, "N/m")
    if not all(map(isfinite, balanced)):
        raise Refused(EXECUTION, "a force that is not finite")
    fx, fy, fz, tx, ty, tz = (0.0 - value for value in balanced)
    return CartesianImpedance(stiffness_n_per_m, (fx, fy, fz, tx, ty, tz))


def check_joint_stiffness(stiffness_nm_per_rad: float) -> None:
    """Raises `Refused` for a stiffness out of range."""
    _check(stiffness_nm_per_rad, LARGEST_JOINT_NM_PER_RAD, "Nm/rad")


def _check(stiffness: float, largest: float, unit: str) -> None:
    if not 0.0 <= stiffness <= largest:
        raise Refused(EXECUTION, f"stiffness {stiffness:g} {unit}: expected 0 to {largest:g}")

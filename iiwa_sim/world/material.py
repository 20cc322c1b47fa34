"""Stiffness of a cell (N/m) as contact parameters of MuJoCo.

MuJoCo presses with f = (aref - a) / R in a contact, with aref = -b v - k r and R = (1 - d) / d W, where W is
the sum of `body_invweight0` of both bodies, which only scales R. Set to S / k_body for each body, with
S = k / (1 - d) the same everywhere, it makes f = r / (1 / k_a + 1 / k_b) at rest: the stiffness of both in
series, for any mass. k and d then only choose how fast a contact may be.
"""

from __future__ import annotations

from typing import NamedTuple

from iiwa_sim.world.tick_kernel import BASE

RIGID_N_PER_M = 1e8
"""Stiffness of links, jaws and tools against parts."""
ARMS_N_PER_M = 5e4
"""Stiffness of arms against each other."""


class Law(NamedTuple):
    """Parameters of MuJoCo's contact in direct mode, with a constant impedance."""

    solref: tuple[float, float]
    solimp: tuple[float, ...]
    scale: float  # S of the module's formula


def _law(stiffness_per_s2: float, damping_per_s: float, impedance: float) -> Law:
    solimp = impedance, impedance, 0.001, 0.5, 1.0
    return Law((-stiffness_per_s2, -damping_per_s), solimp, stiffness_per_s2 / (1.0 - impedance))


def law_of_free(tick_s: float) -> Law:
    """Return the law for free bodies: as fast as the tick can follow, critically damped."""
    return _law((0.5 / tick_s) ** 2, 1.0 / tick_s, 0.999)


def law_of_imposed(free: Law) -> Law:
    """Return the law for imposed bodies, f = k r without lag, with the same scale."""
    return _law(free.scale * 0.9, -free.solref[1], 0.1)


def law_of_arms(free: Law) -> Law:
    """Return the law of arms against each other, whose bodies are rigid: f = k d, without lag."""
    softer = ARMS_N_PER_M * BASE / RIGID_N_PER_M
    return _law(free.scale * 0.9 * softer, 5.0, 0.1)

"""Stiffness of a cell (N/m) as contact parameters of MuJoCo.

MuJoCo presses with f = (aref - a) / R in a contact, with aref = -b v - k r and R = (1 - d) / d W, where W is
the sum of `body_invweight0` of both bodies. That number only scales R. Set to S / k_body for each body, with
S = k / (1 - d) the same everywhere, it makes f = r / (1 / k_a + 1 / k_b) at rest: the stiffness of both in
series, whatever their mass. k and d then only choose how fast a contact may be.
"""

from __future__ import annotations

from typing import NamedTuple


class Law(NamedTuple):
    """Parameters of MuJoCo's contact in direct mode, with a constant impedance."""

    stiffness_per_s2: float
    damping_per_s: float
    impedance: float

    @property
    def solref(self) -> list[float]:
        """MuJoCo's `solref`."""
        return [-self.stiffness_per_s2, -self.damping_per_s]

    @property
    def solimp(self) -> list[float]:
        """MuJoCo's `solimp`."""
        return [self.impedance, self.impedance, 0.001, 0.5, 1.0]

    @property
    def scale(self) -> float:
        """S of the module's formula."""
        return self.stiffness_per_s2 / (1.0 - self.impedance)


def law_of_free(tick_s: float) -> Law:
    """Return the law for what moves freely: as fast as the tick can follow, critically damped."""
    rate = 0.5 / tick_s
    return Law(rate * rate, 2.0 * rate, 0.999)


def law_of_imposed(free: Law) -> Law:
    """Return the law for what is imposed, f = k r without lag, with the same scale."""
    return Law(free.scale * 0.9, free.damping_per_s, 0.1)

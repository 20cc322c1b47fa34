"""Whether what pushes a robot is surely within its limits: asked in every tick in which anything does."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from operator import truediv
from typing import Any

import cython

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.acting_kernel import Acting
    from cython.cimports.iiwa_sim.contact.load_kernel import ExternalLoad
else:
    from iiwa_sim.contact.acting_kernel import Acting
    from iiwa_sim.contact.load_kernel import ExternalLoad


@cython.cclass
class Tolerance:
    """The limits of one robot; what is beyond them is up to heirs.

    The attributes are declared in the .pxd.
    """

    def __init__(self, torque_limits: Sequence[float]) -> None:
        """Of the torques on the joints (Nm), base first; of those at the TCP there are none yet."""
        self._torque_limits: Any = tuple(torque_limits)
        self._least_limit = min(torque_limits)
        self._levers_m: Any = ()
        self._part_per_n = 0.0
        self._most_n = self._most_nm = inf
        self._allows = self._judged = self.looks_always = False

    @cython.ccall
    @cython.exceptval(-1, check=True)
    def tolerates(self, load: ExternalLoad) -> cython.bint:
        """Whether the load is surely within all limits: so in most ticks, also of a robot in contact."""
        self._judged = True
        if load.levers_m is not self._levers_m:
            self._levers_m = load.levers_m
            self._part_per_n = max(map(truediv, load.levers_m, self._torque_limits))
        acting: Acting = load
        within: cython.bint = acting.surely_within(
            self._part_per_n, self._least_limit, self._most_n, self._most_nm
        )
        return within and not self._allows

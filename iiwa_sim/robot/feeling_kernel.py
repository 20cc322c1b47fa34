"""What a robot that yields feels at its TCP: how motions ask for it, and how they hand on what they found."""

# mypy: allow-untyped-decorators

from __future__ import annotations

import cython
import numpy as np

from iiwa_sim.frames import Transform
from iiwa_sim.wrench import Touch


@cython.cclass
class Feeling:
    """What surrounds a TCP does to it: after `feel_at` force f (N) and torque t (Nm) about the TCP, along the
    axes of the base, in attributes declared in the .pxd."""

    @cython.ccall
    @cython.exceptval(-1, check=True)
    def feel_at(
        self,
        px: cython.double,
        py: cython.double,
        pz: cython.double,
        vx: cython.double,
        vy: cython.double,
        vz: cython.double,
        remember: cython.bint,
    ) -> cython.bint:
        """Whether anything touches a TCP at a place p (m) with a velocity v (m/s), in the base; where nothing
        does, f and t need not be set.

        If what is felt now is to be remembered, friction goes on from here; else nothing changes.
        """
        raise NotImplementedError

    @cython.cfunc
    @cython.exceptval(-1, check=True)
    def acts_at(
        self,
        px: cython.double,
        py: cython.double,
        pz: cython.double,
        vx: cython.double,
        vy: cython.double,
        vz: cython.double,
        remember: cython.bint,
        acting: cython.double[::1],
    ) -> cython.bint:
        """Whether anything does anything to a TCP there, see `feel_at`: force (N) and torque (Nm) go into
        `acting`, zeros where nothing does."""
        if not self.feel_at(px, py, pz, vx, vy, vz, remember):
            self.fx = self.fy = self.fz = self.tx = self.ty = self.tz = 0.0
        acting[0], acting[1], acting[2] = self.fx, self.fy, self.fz
        acting[3], acting[4], acting[5] = self.tx, self.ty, self.tz
        pushed: cython.bint = False
        for k in range(6):
            pushed = pushed or acting[k] != 0.0
        return pushed


@cython.cclass
class Reached:
    """Where a tick has brought a TCP, and what it feels there, by a motion that has found both: numbers for
    kernels, declared in the .pxd, and poses and vectors for others."""

    def __init__(self) -> None:
        """Not known yet."""
        self.at = np.zeros(12)
        self.acting = np.zeros(6)
        self.felt = False

    @property
    def pose(self) -> Transform:
        """The pose of the TCP in the base."""
        a = self.at
        rotation = (a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8])
        return Transform(rotation, (a[9], a[10], a[11]))

    @property
    def touch(self) -> Touch | None:
        """What surfaces do there; None where that has yet to be found."""
        a = self.acting
        return Touch((a[0], a[1], a[2]), (a[3], a[4], a[5])) if self.felt else None

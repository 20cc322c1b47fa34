"""What a robot that yields feels at its TCP, in the form in which motions ask for it: heirs find it."""

# mypy: allow-untyped-decorators

from __future__ import annotations

import cython


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

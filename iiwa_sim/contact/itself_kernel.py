"""The links of an arm that meet each other: what that does to its joints.

Two links that are in each other by more than `ALLOWED_M` push each other apart at the point that is deepest,
straight out, with a stiffness times the depth beyond that, without friction. That makes a torque on each
joint between them, and on no other.

Looked at are links with at least two others between them, that are apart where the arm is at home: all others
overlap, or cannot meet. `free_m` says how far the arm may move before two of them could.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cython
import numpy as np
from numpy.typing import NDArray

from iiwa_sim.robot.capsules import Capsule

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.capsules_kernel import Capsules
else:
    from iiwa_sim.contact.capsules_kernel import Capsules

STIFFNESS_N_PER_M = 5e4
"""Of links against each other; no arm's data sheet tells it."""
_STIFFNESS = cython.declare(cython.double, STIFFNESS_N_PER_M)
ALLOWED_M = 0.01
"""Capsules may be in each other by this: the shapes of a URDF are coarse, and no pose in which the real arm
is clear is to be a touch."""
_ALLOWED_M = cython.declare(cython.double, ALLOWED_M)
LEAST_LINKS_BETWEEN = 3
"""Of two links that are looked at one is moved by so many joints more, at least."""


@cython.cclass
class Itself(Capsules):
    """The capsules of one arm, and of tools fixed to its flange, that meet each other."""

    torques: Any = cython.declare(object, visibility="readonly")
    """Torque (Nm) on each joint; None where no links are in each other."""
    colliding: Any = cython.declare(object, visibility="readonly")
    """The names of two links that are in each other, the deepest; None where none are."""
    free_m: float = cython.declare(cython.double, visibility="readonly")
    """How far two links that are looked at are apart (m), at least."""
    _pair_count: cython.Py_ssize_t
    _pairs: cython.Py_ssize_t[:, ::1]

    def __init__(
        self,
        fixed: NDArray[np.float64],
        capsules: Sequence[Capsule],
        worn: Sequence[Capsule],
        home: Sequence[float],
    ) -> None:
        """As `Capsules`; `home` is where no links are in each other (rad)."""
        Capsules.__init__(self, fixed, capsules, worn)
        self.go_to(home)
        pairs = [
            (a, b)
            for a in range(self._capsule_count)
            for b in range(a + 1, self._capsule_count)
            if self._moved_by[b] - self._moved_by[a] >= LEAST_LINKS_BETWEEN and self.apart(a, b) > 0.0
        ]
        self._pair_count = len(pairs)
        self._pairs = np.array(pairs, dtype=np.intp).reshape(len(pairs), 2)
        self.torques: Any = None
        self.colliding: Any = None
        self.free_m = 0.0

    def look(self, joints: Sequence[float]) -> None:
        """The arm is at joint positions (rad)."""
        self.go_to(joints)
        least: cython.double = 1e9
        deepest: cython.double = 0.0
        torques: Any = None
        self.colliding = None
        ax, p = self._axes, self._points
        for number in range(self._pair_count):
            a, b = self._pairs[number, 0], self._pairs[number, 1]
            apart = self.apart(a, b) + _ALLOWED_M
            least = min(least, apart)
            if apart >= 0.0:
                continue
            if torques is None:
                torques = [0.0] * self._count
            if apart < deepest:
                deepest = apart
                self.colliding = (self._capsules[a].link, self._capsules[b].link)
            # What acts on b is against n, in the middle of what both share; so on the joints from a to b.
            force = -_STIFFNESS * -apart
            half = -0.5 * apart
            x, y, z = self._px + half * self._nx, self._py + half * self._ny, self._pz + half * self._nz
            for k in range(self._moved_by[a], self._moved_by[b]):
                dx, dy, dz = x - p[k, 0], y - p[k, 1], z - p[k, 2]
                torques[k] += force * (
                    self._nx * (ax[k, 1] * dz - ax[k, 2] * dy)
                    + self._ny * (ax[k, 2] * dx - ax[k, 0] * dz)
                    + self._nz * (ax[k, 0] * dy - ax[k, 1] * dx)
                )
        self.free_m = least
        self.torques = None if torques is None else tuple(torques)

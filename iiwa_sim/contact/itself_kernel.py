"""The links of an arm that meet each other: what that does to its joints.

Two links that are in each other by more than `ALLOWED_M` push each other apart at the point that is deepest,
straight out, with a stiffness times the depth beyond that, without friction. That makes a torque on each
joint between them, and on no other.

Looked at are links with at least two others between them, that are apart where the arm is at home: all others
overlap, or cannot meet. How far two links are apart changes only as joints between them turn, by no more than
that moves points of the outer one: so most looks need no distance, and few need all of them.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cython
import numpy as np
from cython.cimports.libc.math import fabs
from numpy.typing import NDArray

from iiwa_sim.robot.capsules import Capsule

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.capsules_kernel import Capsules
else:
    from iiwa_sim.contact.capsules_kernel import Capsules

STIFFNESS_N_PER_M = 5e4
"""Stiffness of links against each other; no arm's data sheet tells it."""
_STIFFNESS = cython.declare(cython.double, STIFFNESS_N_PER_M)
ALLOWED_M = 0.01
"""Capsules may be in each other by this: the shapes of a URDF are coarse, and no pose in which the real arm
is clear is to be a touch."""
_ALLOWED_M = cython.declare(cython.double, ALLOWED_M)
LEAST_LINKS_BETWEEN = 3
"""Least number of joints between two links that are looked at."""


@cython.cclass
class Itself(Capsules):
    """The capsules of one arm, and of tools fixed to its flange, that meet each other."""

    torques: Any = cython.declare(object, visibility="readonly")
    """Torque (Nm) on each joint; None where no links are in each other."""
    colliding: Any = cython.declare(object, visibility="readonly")
    """The names of two links that are in each other, the deepest; None where none are."""
    free_m: float = cython.declare(cython.double, visibility="readonly")
    """How far (m) links may go towards each other, at least, before two of them push each other."""
    _pair_count: cython.Py_ssize_t
    _pairs: cython.Py_ssize_t[:, ::1]
    # Pairs of the same two joints that move them last are a group.
    _group_count: cython.Py_ssize_t
    _group: cython.Py_ssize_t[::1]  # of each pair
    _reach: cython.double[:, ::1]  # no point of the outer one is farther (m) from the axis of a joint between
    _fastest: cython.double[::1]  # they go towards each other by no more (m/s)
    _known: cython.double[::1]  # how far its pairs were apart (m), at least, when that was found
    _free: cython.double[::1]  # what is left of that
    _asked: cython.char[::1]  # whether this look measures its pairs
    _before: cython.double[::1]  # joint positions (rad) of the last look

    def __init__(
        self,
        fixed: NDArray[np.float64],
        capsules: Sequence[Capsule],
        worn: Sequence[Capsule],
        home: Sequence[float],
        velocity: Sequence[float],
    ) -> None:
        """The arm is that of `Capsules`, with the same arguments; `home` is where no links are in each other
        (rad), and no joint is faster than its `velocity` (rad/s) by more than 1 %."""
        Capsules.__init__(self, fixed, capsules, worn)
        self.go_to(home)
        moved_by: Any = np.asarray(self._moved_by).tolist()
        pairs = [
            (a, b)
            for a in range(self._capsule_count)
            for b in range(a + 1, self._capsule_count)
            if moved_by[b] - moved_by[a] >= LEAST_LINKS_BETWEEN and self.apart(a, b) > 0.0
        ]
        self._pair_count = len(pairs)
        self._pairs = np.array(pairs, dtype=np.intp).reshape(len(pairs), 2)
        between = [(moved_by[a], moved_by[b]) for a, b in pairs]
        groups = sorted(set(between))
        self._group_count = len(groups)
        self._group = np.array([groups.index(each) for each in between], dtype=np.intp)
        reach: Any = np.zeros((len(groups), self._count))
        for group, (first, last) in enumerate(groups):
            of_outer: Any = np.asarray(self._reaches)[[n for n, by in enumerate(moved_by) if by == last]]
            reach[group, first:last] = of_outer[:, first:last].max(axis=0)
        self._reach = reach
        self._fastest = 1.01 * reach @ np.array(velocity)
        self._known, self._free = np.zeros((2, len(groups)))
        self._asked = np.zeros(len(groups), dtype=np.int8)
        self._before = np.zeros(self._count)
        self.torques: Any = None
        self.colliding: Any = None
        self.free_m = 0.0
        self.forget()

    def forget(self) -> None:
        """Know nothing of how far links are apart: the arm is put elsewhere."""
        self._known[:] = 0.0
        self._free[:] = -1.0

    def watch(self, joints: Sequence[float], tick_s: float) -> int:
        """The arm is at joint positions (rad) in this tick. Tells in how many ticks to look again."""
        q: cython.double
        near: cython.bint = False
        known, free, reach = self._known, self._free, self._reach
        for k in range(self._count):
            q = joints[k]
            gone = fabs(q - self._before[k])
            self._before[k] = q
            for group in range(self._group_count):
                free[group] -= reach[group, k] * gone
        for group in range(self._group_count):
            self._asked[group] = free[group] < 0.5 * known[group]
            near = near or self._asked[group]
        if near:
            self._measure(joints)
        ticks: cython.double = 1e9
        self.free_m = 1e9
        for group in range(self._group_count):
            self.free_m = min(self.free_m, free[group])
            ticks = min(ticks, free[group] / (self._fastest[group] * tick_s))
        return int(max(ticks, 1.0))

    @cython.cfunc
    def _measure(self, joints: Any) -> object:
        """Find how far apart the pairs are that this is asked of, and what those do that are in each other.
        All pairs that may be are asked."""
        self.go_to(joints)
        known, free = self._known, self._free
        for group in range(self._group_count):
            if self._asked[group]:
                free[group] = 1e9
        deepest: cython.double = 0.0
        torques: Any = None
        self.colliding = None
        ax, p = self._axes, self._points
        for number in range(self._pair_count):
            group = self._group[number]
            if not self._asked[group]:
                continue
            a, b = self._pairs[number, 0], self._pairs[number, 1]
            apart = self.apart(a, b) + _ALLOWED_M
            free[group] = min(free[group], apart)
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
        for group in range(self._group_count):
            if self._asked[group]:
                known[group] = free[group]
        self.torques = None if torques is None else tuple(torques)
        return None

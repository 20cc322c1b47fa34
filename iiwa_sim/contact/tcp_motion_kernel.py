"""How the TCP accelerates, from where it is in three ticks in a row, and what a body fixed to it does then.

A point r of such a body is at p + R r, so it accelerates by p'' + R'' r. Both second derivatives are taken
from three poses, a tick apart each: they are those of the middle one. Where it is known to which pose the
motion goes on, that is the present one; else it is that of a tick ago, and inertia is felt so late. The
weight is always that of the present pose.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from typing import Any

import cython
import numpy as np

from iiwa_sim.contact.moments import GRAVITY_M_S2, Moments
from iiwa_sim.frames import IDENTITY, Transform
from iiwa_sim.wrench import NO_WRENCH, Wrench

_GRAVITY = cython.declare(cython.double, GRAVITY_M_S2)


@cython.cclass
class TcpMotion:
    """The poses of a TCP in three ticks; the numbers are declared in the .pxd."""

    def __init__(self, pose: Transform) -> None:
        """The TCP is at `pose`; how it has come there is not known, and nothing is felt of that."""
        self._now, self._before, self._earlier, self._coming = np.zeros((4, 12))
        self._linear, self._turning, self._of = np.zeros(3), np.zeros(9), np.zeros(10)
        self.rest(pose)
        self._known = 1
        self.still = False

    def rest(self, pose: Transform) -> None:
        """The TCP rests at `pose`."""
        _take(pose, self._now)
        self._before[:] = self._now
        self._earlier[:] = self._now
        self._linear[:] = 0.0
        self._turning[:] = 0.0
        self._known = 3
        self.still = True

    def copy(self) -> TcpMotion:
        """Return another one that goes on in the same way."""
        other = TcpMotion(IDENTITY)
        for k in range(12):
            other._now[k], other._before[k], other._earlier[k] = (
                self._now[k],
                self._before[k],
                self._earlier[k],
            )
        for k in range(3):
            other._linear[k] = self._linear[k]
        for k in range(9):
            other._turning[k] = self._turning[k]
        other._known, other.still = self._known, self.still
        return other

    def step(self, pose: Transform, tick_s: float, coming: Transform | None = None) -> None:
        """A tick has brought it to `pose`; the next one brings it to `coming`, if that is known."""
        self.go_to(pose, tick_s, coming)

    @cython.cfunc
    def go_to(self, pose: Any, tick_s: cython.double, coming: Any) -> object:
        """`step` for kernels."""
        self._earlier, self._before, self._now = self._before, self._now, self._earlier
        _take(pose, self._now)
        if self._known < 3:
            self._known += 1
        if coming is None:
            self._differ(self._earlier, self._before, self._now, self._known >= 3, tick_s)
        else:
            _take(coming, self._coming)
            self._differ(self._before, self._now, self._coming, self._known >= 2, tick_s)
        return None

    @cython.cfunc
    @cython.exceptval(check=False)
    def _differ(
        self,
        first: cython.double[::1],
        middle: cython.double[::1],
        last: cython.double[::1],
        known: cython.bint,
        dt: cython.double,
    ) -> cython.void:
        """Find the second derivatives at the middle one of three poses; 0 where not all are known."""
        same: cython.bint = True
        for k in range(12):
            if last[k] != middle[k] or middle[k] != first[k]:
                same = False
        self.still = same and known
        if same or not known:
            self._linear[:] = 0.0
            self._turning[:] = 0.0
            return
        scale: cython.double = 1.0 / (dt * dt)
        for i in range(3):
            total = 0.0
            for k in range(3):
                total += middle[3 * k + i] * ((last[9 + k] - middle[9 + k]) - (middle[9 + k] - first[9 + k]))
            self._linear[i] = scale * total
            for j in range(3):
                total = 0.0
                for k in range(3):
                    at = 3 * k + j
                    total += middle[3 * k + i] * ((last[at] - middle[at]) - (middle[at] - first[at]))
                self._turning[3 * i + j] = scale * total

    @cython.ccall
    def weight(self, moments: Moments) -> Wrench:
        """What a body does at rest; its moments are in the frame of the TCP, the wrench along its axes."""
        self._take_moments(moments)
        self.weigh(self._of)
        return (self.gx, self.gy, self.gz, self.hx, self.hy, self.hz)

    @cython.ccall
    def wrench(self, moments: Moments) -> Wrench:
        """What a body does, by its weight and its inertia, as in `weight`."""
        weight = self.weight(moments)
        if self.still:
            return NO_WRENCH if weight == NO_WRENCH else weight
        self.act(self._of)
        return (self.fx, self.fy, self.fz, self.tx, self.ty, self.tz)

    @cython.cfunc
    def _take_moments(self, moments: Any) -> object:
        m = self._of
        m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8], m[9] = moments
        return None

    @cython.cfunc
    @cython.exceptval(check=False)
    def weigh(self, moments: cython.double[::1]) -> cython.void:
        """`weight` for kernels: into g and h."""
        m, x, y, z = moments[0], moments[1], moments[2], moments[3]
        r = self._now
        gx: cython.double = -_GRAVITY * r[6]
        gy: cython.double = -_GRAVITY * r[7]
        gz: cython.double = -_GRAVITY * r[8]
        self.gx, self.gy, self.gz = m * gx, m * gy, m * gz
        self.hx, self.hy, self.hz = y * gz - z * gy, z * gx - x * gz, x * gy - y * gx

    @cython.cfunc
    @cython.exceptval(check=False)
    def act(self, moments: cython.double[::1]) -> cython.void:
        """`wrench` for kernels, of a body that has just been weighed: into f and t."""
        if self.still:
            self.fx, self.fy, self.fz, self.tx, self.ty, self.tz = (
                self.gx,
                self.gy,
                self.gz,
                self.hx,
                self.hy,
                self.hz,
            )
            return
        m, x, y, z = moments[0], moments[1], moments[2], moments[3]
        xx, yy, zz, xy, xz, yz = moments[4], moments[5], moments[6], moments[7], moments[8], moments[9]
        a, b = self._linear, self._turning
        self.fx = self.gx - (m * a[0] + (b[0] * x + b[1] * y + b[2] * z))
        self.fy = self.gy - (m * a[1] + (b[3] * x + b[4] * y + b[5] * z))
        self.fz = self.gz - (m * a[2] + (b[6] * x + b[7] * y + b[8] * z))
        # The integral of r x (R'' r): by components of J R''^T.
        tx: cython.double = (y * a[2] - z * a[1]) + (
            (xy * b[6] + yy * b[7] + yz * b[8]) - (xz * b[3] + yz * b[4] + zz * b[5])
        )
        ty: cython.double = (z * a[0] - x * a[2]) + (
            (xz * b[0] + yz * b[1] + zz * b[2]) - (xx * b[6] + xy * b[7] + xz * b[8])
        )
        tz: cython.double = (x * a[1] - y * a[0]) + (
            (xx * b[3] + xy * b[4] + xz * b[5]) - (xy * b[0] + yy * b[1] + yz * b[2])
        )
        self.tx, self.ty, self.tz = self.hx - tx, self.hy - ty, self.hz - tz


@cython.cfunc
@cython.exceptval(check=True)
def _take(pose: Any, n: cython.double[::1]) -> cython.void:
    """Write down a pose."""
    rotation, place = pose
    n[0], n[1], n[2], n[3], n[4], n[5], n[6], n[7], n[8] = rotation
    n[9], n[10], n[11] = place

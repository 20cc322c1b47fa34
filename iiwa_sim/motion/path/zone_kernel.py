"""Where a move may leave its path to blend into the next one: a zone round its target."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence

import cython
import numpy as np
from cython.cimports.libc.math import cos, fabs, sin, sqrt

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import Array
from iiwa_sim.robot.arm_kernel import Tcp

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.path.piecewise_kernel import Polynomial
else:
    from iiwa_sim.motion.path.piecewise_kernel import Polynomial

HALF = 0.49
"""A path is left to blends up to this part from either end, so that it is never all blends."""
_HALF = cython.declare(cython.double, 0.49)
_STANDSTILL = 1e-7  # m or rad
_NO_TCP = np.empty((0, 12))
_PLACES = cython.declare(cython.int, 12)  # that are looked at, to find where a path leaves a zone first
_CLOSE = cython.declare(cython.double, 1e-9)  # in s


@cython.cclass
class Zone:
    """A neighbourhood of a target: everything no farther from it than `radius`."""

    def __init__(self, radius: float, centre: Sequence[float] | Array, fixed: Array) -> None:
        """`fixed` is `Tcp.fixed`, or an array without rows where distances are those of joints."""
        self.radius = radius
        """In m, or rad where it is one of joints."""
        self._centre = np.array(centre)
        self._fixed = fixed
        self.of_tcp = self._fixed.shape[0] > 0
        """Whether it is the TCP whose distance counts."""

    @cython.cfunc
    @cython.exceptval(check=False)
    def distance_of(self, joints: cython.double[:, ::1], row: cython.Py_ssize_t) -> cython.double:
        """How far a row of joint positions (rad) is from the target: the TCP (m), or the farthest joint
        (rad)."""
        if not self.of_tcp:
            farthest: cython.double = 0.0
            for j in range(self._centre.shape[0]):
                farthest = max(farthest, fabs(joints[row, j] - self._centre[j]))
            return farthest
        fixed = self._fixed
        last: cython.Py_ssize_t = fixed.shape[0] - 1
        x: cython.double = fixed[last, 9]
        y: cython.double = fixed[last, 10]
        z: cython.double = fixed[last, 11]
        for k in range(last - 1, -1, -1):
            s = sin(joints[row, k])
            c = cos(joints[row, k])
            u = c * x - s * y
            v = s * x + c * y
            x = fixed[k, 9] + fixed[k, 0] * u + fixed[k, 1] * v + fixed[k, 2] * z
            y = fixed[k, 10] + fixed[k, 3] * u + fixed[k, 4] * v + fixed[k, 5] * z
            z = fixed[k, 11] + fixed[k, 6] * u + fixed[k, 7] * v + fixed[k, 8] * z
        x -= self._centre[0]
        y -= self._centre[1]
        z -= self._centre[2]
        return sqrt(x * x + y * y + z * z)

    def distance(self, joints: Sequence[float]) -> float:
        """How far joint positions (rad) are from the target (m, or rad)."""
        found: float = self.distance_of(np.array([joints], dtype=np.float64), 0)
        return found

    def clipped(self, first: Polynomial, second: Polynomial) -> Zone:
        """This zone, made so small that it ends before the middle of the path to its target and of that from
        it."""
        radius = self.radius
        for half in (self.distance(first.joints(1.0 - HALF)), self.distance(second.joints(HALF))):
            # A line that turns on the spot goes nowhere: there half of the turn is the only bound.
            if half > _STANDSTILL:
                radius = min(radius, half)
        return Zone(radius, np.asarray(self._centre), np.asarray(self._fixed))

    def part_inside(self, path: Polynomial, *, at_end: bool) -> float:
        """The part of a path, up to `HALF`, from the target at one of its ends to the border."""
        if self.of_tcp and path.tcp_length_m is not None:
            length_m: cython.double = path.tcp_length_m
            return HALF if self.radius >= HALF * length_m else self.radius / length_m
        room: cython.double[:, :, ::1] = np.empty((1, 1, path.joint_count))
        from_end: cython.bint = at_end
        inside: cython.double = 0.0
        outside: cython.double = 0.0
        left: cython.double = self.radius  # of it at the one inside,
        beyond: cython.double = 0.0  # and how far the other is outside
        last: cython.int = 0  # which of both was found last
        k: cython.int
        for k in range(1, _PLACES + 1):
            part: cython.double = _HALF * k / _PLACES
            beyond = self._beyond(path, from_end, part, room)
            if beyond > 0.0:
                outside = part
                break
            inside, left = part, -beyond
        if outside == 0.0:
            return HALF
        while outside - inside > _CLOSE and left > _CLOSE * self.radius:
            # False position; where one side stays, it counts half.
            part = inside + (outside - inside) * left / (left + beyond)
            if not inside < part < outside:
                part = 0.5 * (inside + outside)
            beyond_there: cython.double = self._beyond(path, from_end, part, room)
            if beyond_there > 0.0:
                outside, beyond = part, beyond_there
                if last == 1:
                    left *= 0.5
                last = 1
            else:
                inside, left = part, -beyond_there
                if last == -1:
                    beyond *= 0.5
                last = -1
        found: float = inside
        return found

    @cython.cfunc
    @cython.exceptval(check=False)
    def _beyond(
        self, path: Polynomial, at_end: cython.bint, part: cython.double, room: cython.double[:, :, ::1]
    ) -> cython.double:
        """How far outside of the zone a path is at a part from the target; negative inside."""
        path.place(1.0 - part if at_end else part, room, 0)
        return self.distance_of(room[0], 0) - self.radius


def sphere(radius_m: float, target: Joints, tcp: Tcp) -> Zone:
    """All places where the TCP is no farther than a radius (m) from where it is at joint positions (rad)."""
    return Zone(radius_m, tcp.pose(target).translation, tcp.fixed)


def joint_ball(part: float, start: Joints, target: Joints) -> Zone:
    """All places where no joint is farther (rad) from the target than a part of the largest way of a move."""
    way = max([abs(b - a) for a, b in zip(start, target, strict=True)])
    return Zone(part * way, target, _NO_TCP)

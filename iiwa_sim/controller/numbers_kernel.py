"""The numbers of a told state that follow from joint positions: joint velocities, flange, TCP.

They are found for every line of the status port, and for every tick of a robot that is recorded; there they
are rounded, since in full they would be half of a file.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence
from math import hypot
from typing import Any

import cython
import numpy as np
from cython.cimports.libc.math import atan2, floor

from iiwa_sim.frames import Transform
from iiwa_sim.robot.arm_kernel import Tcp as FlangeOrTcp

if cython.compiled:
    from cython.cimports.iiwa_sim.robot.arm_kernel import Tcp
else:
    Tcp = FlangeOrTcp

# Steps of 0.1 um, 1e-7 rad and 1e-7 rad/s, 1e-4 N and Nm.
_PER_MM = cython.declare(cython.double, 1e4)
_PER_UNIT = cython.declare(cython.double, 1e7)
_PER_N = cython.declare(cython.double, 1e4)
_PI = cython.declare(cython.double, 3.141592653589793)
_GIMBAL_LOCK = cython.declare(cython.double, 5e-13)  # that of `iiwa_sim.frames`


@cython.cclass
class Numbers:
    """Finds them for one robot. Joint positions are rad, base first."""

    _rounded: cython.bint
    _flange: Tcp
    _tool_in_flange: object
    _tool: cython.double[::1]  # nine numbers of its rotation, row by row, and its place (m)
    _turned: cython.double[::1]
    _place: cython.double[::1]

    def __init__(self, flange: FlangeOrTcp, rounded: bool) -> None:
        """`flange` is that of the robot, in the form of a TCP; it is the caller's no more.

        Frames are those that `Frame.from_transform` finds, in full bit for bit.
        """
        self._rounded = rounded
        self._flange = flange
        self._tool_in_flange: Any = None
        self._tool = np.zeros(12)
        self._turned = np.zeros(9)
        self._place = np.zeros(3)

    def velocities(
        self, joints: Sequence[float], before: Sequence[float], tick_s: cython.double
    ) -> list[float]:
        """Velocities of the joints (rad/s), between their positions and those a tick ago (rad)."""
        velocity: cython.double
        now: cython.double
        then: cython.double
        k: cython.Py_ssize_t
        found = []
        for k in range(len(joints)):
            now = joints[k]
            then = before[k]
            velocity = (now - then) / tick_s
            found.append(_to_step(velocity, _PER_UNIT) if self._rounded else velocity)
        return found

    def forces(self, values: Sequence[float]) -> Sequence[float]:
        """Forces (N) or torques (Nm)."""
        return [_to_step(value, _PER_N) for value in values] if self._rounded else values

    def frames(self, joints: Sequence[float], tool_in_flange: Transform) -> tuple[list[float], list[float]]:
        """Flange and TCP in the base: each x y z (mm) alpha beta gamma (rad)."""
        i: cython.Py_ssize_t
        k: cython.Py_ssize_t
        if tool_in_flange is not self._tool_in_flange:
            self._tool_in_flange = tool_in_flange
            tool = (*tool_in_flange.rotation, *tool_in_flange.translation)
            for k in range(12):
                self._tool[k] = tool[k]
        self._flange.go_to(joints)
        r, p, t = self._flange.turned, self._flange.place, self._tool
        for i in range(3):
            a, b, c = r[3 * i], r[3 * i + 1], r[3 * i + 2]
            self._place[i] = a * t[9] + b * t[10] + c * t[11] + p[i]
            for k in range(3):
                self._turned[3 * i + k] = a * t[k] + b * t[3 + k] + c * t[6 + k]
        return self._frame(r, p), self._frame(self._turned, self._place)

    def tcp(self, joints: Sequence[float], tool_in_flange: Transform) -> list[float]:
        """The TCP in the base, as in `frames`."""
        _, tcp = self.frames(joints, tool_in_flange)
        return tcp

    @cython.cfunc
    def _frame(self, r: cython.double[::1], p: cython.double[::1]) -> list[float]:
        """A pose, by its rotation and its place (m), as a frame."""
        alpha: cython.double
        gamma: cython.double = 0.0
        k: cython.Py_ssize_t
        cos_beta: cython.double = hypot(r[0], r[3])  # Python's: that of C differs in the last digit
        if cos_beta < _GIMBAL_LOCK:
            alpha = atan2(-r[1], r[4])
        else:
            alpha = atan2(r[3], r[0])
            sa, ca = r[3] / cos_beta, r[0] / cos_beta
            gamma = atan2(sa * r[2] - ca * r[5], ca * r[4] - sa * r[1])
        beta: cython.double = atan2(-r[6], cos_beta)
        frame = [1e3 * p[0], 1e3 * p[1], 1e3 * p[2], _half_open(alpha), beta, _half_open(gamma)]
        if self._rounded:
            for k in range(6):
                frame[k] = _to_step(frame[k], _PER_MM if k < 3 else _PER_UNIT)
        return frame


@cython.cfunc
@cython.exceptval(check=False)
@cython.inline
def _half_open(angle: cython.double) -> cython.double:
    """An angle of atan2 with -pi, which it gives for a negative zero, as pi."""
    return _PI if angle <= -_PI else angle


@cython.cfunc
@cython.exceptval(check=False)
@cython.inline
def _to_step(value: cython.double, steps: cython.double) -> cython.double:
    """The value rounded to the nearest step."""
    return floor(value * steps + 0.5) / steps

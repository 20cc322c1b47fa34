"""The numbers of a recorded state that follow from joint positions, rounded: joint velocities, flange, TCP.

They are found for every tick of a robot that is recorded, in a fifth of the time that arrays would take.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cython
import numpy as np
from cython.cimports.libc.math import floor, sqrt

from iiwa_sim.frames import Transform
from iiwa_sim.robot.tcp_kernel import Tcp as FlangeOrTcp

if cython.compiled:
    from cython.cimports.iiwa_sim.robot.arctangent_kernel import arctangent
    from cython.cimports.iiwa_sim.robot.tcp_kernel import Tcp
else:
    from iiwa_sim.robot.arctangent_kernel import arctangent

    Tcp = FlangeOrTcp

# Steps of 0.1 um, 1e-7 rad and 1e-7 rad/s: in full, what is rounded would be more than half of a file.
_PER_MM = cython.declare(cython.double, 1e4)
_PER_UNIT = cython.declare(cython.double, 1e7)
_GIMBAL_LOCK = cython.declare(cython.double, 5e-13)  # that of `iiwa_sim.frames`


@cython.cclass
class Numbers:
    """Finds them for one robot. Joint positions are rad, base first."""

    _flange: Tcp
    _tool_in_flange: object
    _tool: cython.double[::1]  # nine numbers of its rotation, row by row, and its place (m)
    _turned: cython.double[::1]
    _place: cython.double[::1]

    def __init__(self, flange: FlangeOrTcp) -> None:
        """`flange` is that of the robot, in the form of a TCP; it is the caller's no more."""
        self._flange = flange
        self._tool_in_flange: Any = None
        self._tool = np.zeros(12)
        self._turned = np.zeros(9)
        self._place = np.zeros(3)

    def velocities(
        self, joints: Sequence[float], before: Sequence[float], tick_s: cython.double
    ) -> list[float]:
        """Of the joints (rad/s), between their positions and those a tick ago."""
        now: cython.double
        then: cython.double
        k: cython.Py_ssize_t
        found = []
        for k in range(len(joints)):
            now = joints[k]
            then = before[k]
            found.append(_rounded((now - then) / tick_s, _PER_UNIT))
        return found

    def frames(self, joints: Sequence[float], tool_in_flange: Transform) -> tuple[list[float], list[float]]:
        """Flange and TCP in the base: each x y z (mm) alpha beta gamma (rad), as `euler_from_rotation` has
        them."""
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
        return _frame(r, p), _frame(self._turned, self._place)


@cython.cfunc
def _frame(r: cython.double[::1], p: cython.double[::1]) -> list[float]:
    """A pose, by its rotation and its place (m), as a frame."""
    alpha: cython.double
    gamma: cython.double = 0.0
    cos_beta = sqrt(r[0] * r[0] + r[3] * r[3])
    if cos_beta < _GIMBAL_LOCK:
        alpha = arctangent(-r[1], r[4])
    else:
        alpha = arctangent(r[3], r[0])
        sa, ca = r[3] / cos_beta, r[0] / cos_beta
        gamma = arctangent(sa * r[2] - ca * r[5], ca * r[4] - sa * r[1])
    beta: cython.double = arctangent(-r[6], cos_beta)
    return [
        _rounded(1e3 * p[0], _PER_MM),
        _rounded(1e3 * p[1], _PER_MM),
        _rounded(1e3 * p[2], _PER_MM),
        _rounded(alpha, _PER_UNIT),
        _rounded(beta, _PER_UNIT),
        _rounded(gamma, _PER_UNIT),
    ]


@cython.cfunc
@cython.exceptval(check=False)
@cython.inline
def _rounded(value: cython.double, steps: cython.double) -> cython.double:
    """To the nearest step."""
    return floor(value * steps + 0.5) / steps

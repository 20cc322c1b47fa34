"""The pose of the flange while the TCP moves in a straight line and turns on the shortest arc."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from math import dist

import cython
import numpy as np
from cython.cimports.libc.math import cos, sin

from iiwa_sim.frames import Transform, turn_between

_ROUNDING_RAD = cython.declare(cython.double, 1e-12)  # a smaller turn is none


@cython.cclass
class TcpLine:
    """A straight line of the TCP; s is the part of the way, and of the turn, that is done.

    Rodrigues: R(s) = R0 + sin(s angle) K R0 + (1 - cos(s angle)) K K R0 turns the flange. Its origin lies at
    -R(s) tool from the TCP, which moves straight. So each of the twelve numbers of its pose is
    start + s way + sin sine + (1 - cos) versine.
    """

    def __init__(self, start_flange: Transform, target_flange: Transform, tool_in_flange: Transform) -> None:
        """Poses in the base."""
        numbers = np.zeros((8, 12))
        self._start, self._sine, self._versine = numbers[0], numbers[1], numbers[2]
        self._way = np.empty(3)
        tool: cython.double[::1] = numbers[3]
        target: cython.double[::1] = numbers[4]
        cross: cython.double[::1] = numbers[5]
        start_tcp: cython.double[::1] = numbers[6]
        target_tcp: cython.double[::1] = numbers[7]
        for k in range(9):
            self._start[k], target[k], tool[k] = start_flange[0][k], target_flange[0][k], tool_in_flange[0][k]
        for k in range(9, 12):
            self._start[k], target[k] = start_flange[1][k - 9], target_flange[1][k - 9]
            tool[k] = tool_in_flange[1][k - 9]
        _compose(self._start, tool, start_tcp)
        _compose(target, tool, target_tcp)
        for k in range(3):
            self._way[k] = target_tcp[9 + k] - start_tcp[9 + k]
        (*start, x0, y0, z0), (*end, x1, y1, z1) = numbers[6:].tolist()
        self.length_m = dist((x0, y0, z0), (x1, y1, z1))
        """How far the TCP goes."""
        (x, y, z), angle = turn_between(start, end)
        self._angle = angle if angle > _ROUNDING_RAD else 0.0
        cross[1], cross[2], cross[3], cross[5], cross[6], cross[7] = -z, y, z, -x, -y, x
        _multiply(cross, self._start, self._sine)
        _multiply(cross, self._sine, self._versine)
        for k in range(9, 12):
            tool[k] = -tool[k]
        _rotate(self._sine, tool, self._sine)
        _rotate(self._versine, tool, self._versine)

    def flange(self, s: float) -> Transform:
        """Pose of the flange in the base."""
        poses = np.empty((1, 12))
        self.pose(s, poses, 0)
        numbers = tuple(poses[0].tolist())
        return Transform(numbers[:9], numbers[9:])

    @cython.ccall
    @cython.exceptval(check=False)
    def pose(self, s: cython.double, poses: cython.double[:, ::1], row: cython.Py_ssize_t) -> cython.void:
        """The pose of the flange in the base at s (rotation, place in m), into that row (12,)."""
        half: cython.double = 0.5 * s * self._angle
        a: cython.double = sin(half)
        versine: cython.double = 2.0 * a * a
        a = 2.0 * a * cos(half)
        for k in range(12):
            poses[row, k] = self._start[k] + a * self._sine[k] + versine * self._versine[k]
        for k in range(3):
            poses[row, 9 + k] += s * self._way[k]


@cython.cfunc
@cython.exceptval(check=False)
def _compose(a: cython.double[::1], b: cython.double[::1], product: cython.double[::1]) -> cython.void:
    """The pose `b`, whose outer frame is at the pose `a`, in the outer frame of that, into another one."""
    _multiply(a, b, product)
    _rotate(a, b, product)
    for k in range(9, 12):
        product[k] += a[k]


@cython.cfunc
@cython.exceptval(check=False)
def _multiply(a: cython.double[::1], b: cython.double[::1], product: cython.double[::1]) -> cython.void:
    """The product of two matrices (3, 3), row by row, into a third one."""
    for i in range(3):
        for k in range(3):
            product[3 * i + k] = a[3 * i] * b[k] + a[3 * i + 1] * b[3 + k] + a[3 * i + 2] * b[6 + k]


@cython.cfunc
@cython.exceptval(check=False)
def _rotate(a: cython.double[::1], b: cython.double[::1], place: cython.double[::1]) -> cython.void:
    """The place of a pose (12,), turned by the rotation of another, into that of a third one."""
    x, y, z = b[9], b[10], b[11]
    for i in range(3):
        place[9 + i] = a[3 * i] * x + a[3 * i + 1] * y + a[3 * i + 2] * z

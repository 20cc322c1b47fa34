"""Forward kinematics and Jacobian of the TCP of a robot with one tool."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence
from math import hypot
from typing import Any

import cython
import numpy as np
from numpy.typing import NDArray

from iiwa_sim.frames import Transform, compose, inverse

if cython.compiled:
    from cython.cimports.iiwa_sim.robot.record_kernel import record
    from cython.cimports.iiwa_sim.robot.trigonometry_kernel import sines_and_cosines
else:
    from iiwa_sim.robot.record_kernel import record
    from iiwa_sim.robot.trigonometry_kernel import sines_and_cosines


@cython.cclass
class Tcp:
    """A frame fixed to the flange. Joint positions are rad, base first; poses are in the base, in m.

    It caches the last joint positions: several callers ask for the same ones in a tick.
    """

    def __init__(self, fixed: Sequence[Transform], tool_in_flange: Transform) -> None:
        """Every joint turns about the z axis of its own frame. `fixed` are the poses of the first one in
        the base, of each other in the one before at zero position, and of the flange in the last."""
        self.tool_in_flange = tool_in_flange
        self.joint_count = len(fixed) - 1
        rows = [*fixed[: self.joint_count], compose(fixed[self.joint_count], tool_in_flange)]
        self.fixed = np.array([(*rotation, *translation) for rotation, translation in rows])
        self._fixed = self.fixed
        to_flange = inverse(tool_in_flange)
        self._to_flange = np.array((*to_flange.rotation, *to_flange.translation))
        self._q = np.full(self.joint_count, np.nan)  # different from any
        self._sines = np.empty((2, self.joint_count))
        self.turned = np.empty(9)
        self.place = np.empty(3)
        self._axes = np.empty((self.joint_count, 3))
        self._points = np.empty((self.joint_count, 3))
        self._columns_array = np.empty((6, self.joint_count))
        self.columns = self._columns_array
        self.torque = np.empty(self.joint_count)
        self._has_columns = False
        self._pose: Any = None

    def longest_levers(self) -> tuple[float, ...]:
        """No joint's axis is farther from the TCP (m), wherever the robot is, base first: the arm stretched
        from there on."""
        ways = [hypot(*row[9:]) for row in self.fixed.tolist()]
        return tuple([sum(ways[joint:]) for joint in range(1, len(ways))])

    def pose(self, joints: Sequence[float]) -> Transform:
        """Pose of the TCP."""
        if not self.go_to(joints) or self._pose is None:
            r, p = self.turned, self.place
            rotation = (r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8])
            self._pose = record(Transform, (rotation, (p[0], p[1], p[2])))
        pose: Transform = self._pose
        return pose

    def flange_at(self, tcp: Transform) -> Transform:
        """Pose of the flange where the TCP is at a pose."""
        turned: list[float] = []
        place: list[float] = []
        a: cython.double
        b: cython.double
        c: cython.double
        at: cython.double
        t = self._to_flange
        for row in range(3):
            a, b, c = tcp[0][3 * row], tcp[0][3 * row + 1], tcp[0][3 * row + 2]
            at = tcp[1][row]
            turned += [a * t[k] + b * t[3 + k] + c * t[6 + k] for k in range(3)]
            place.append(a * t[9] + b * t[10] + c * t[11] + at)
        pose: Transform = record(Transform, (tuple(turned), tuple(place)))
        return pose

    def jacobian(self, joints: Sequence[float]) -> NDArray[np.float64]:
        """Jacobian (6, n): velocity (m/s), then angular velocity (rad/s), in base axes."""
        self.go_to(joints)
        self.find_columns()
        return self._columns_array.copy()

    def torques(self, joints: Sequence[float], wrench: Sequence[float]) -> tuple[float, ...]:
        """Joint torques (Nm) of a wrench at the TCP along its axes (N, Nm), by the transposed Jacobian."""
        self.find_torques(joints, wrench)
        return tuple([self.torque[k] for k in range(self.joint_count)])

    @cython.cfunc
    def find_torques(self, joints: Any, wrench: Any) -> object:
        """Compute `torques`."""
        fx: cython.double
        fy: cython.double
        fz: cython.double
        tx: cython.double
        ty: cython.double
        tz: cython.double
        fx, fy, fz, tx, ty, tz = wrench
        self.go_to(joints)
        self.find_columns()
        r, j = self.turned, self.columns
        ax = r[0] * fx + r[1] * fy + r[2] * fz
        ay = r[3] * fx + r[4] * fy + r[5] * fz
        az = r[6] * fx + r[7] * fy + r[8] * fz
        bx = r[0] * tx + r[1] * ty + r[2] * tz
        by = r[3] * tx + r[4] * ty + r[5] * tz
        bz = r[6] * tx + r[7] * ty + r[8] * tz
        for k in range(self.joint_count):
            force = j[0, k] * ax + j[1, k] * ay + j[2, k] * az
            self.torque[k] = force + (j[3, k] * bx + j[4, k] * by + j[5, k] * bz)
        return None

    @cython.cfunc
    @cython.exceptval(-1)
    def go_to(self, joints: Any) -> cython.bint:
        """Compute the pose for joint positions (rad); returns whether it was cached."""
        if len(joints) != self.joint_count:
            raise ValueError(f"{len(joints)} joint positions, expected {self.joint_count}")
        same: cython.bint = True
        q: cython.double
        for k in range(self.joint_count):
            q = joints[k]
            if q != self._q[k]:
                self._q[k] = q
                same = False
        if same:
            return True
        self._has_columns = False
        self._pose = None
        sines_and_cosines(self._q, self.joint_count, self._sines)
        f = self._fixed
        r0: cython.double = 1.0
        r1: cython.double = 0.0
        r2: cython.double = 0.0
        r3: cython.double = 0.0
        r4: cython.double = 1.0
        r5: cython.double = 0.0
        r6: cython.double = 0.0
        r7: cython.double = 0.0
        r8: cython.double = 1.0
        x: cython.double = 0.0
        y: cython.double = 0.0
        z: cython.double = 0.0
        for k in range(self.joint_count + 1):
            x += r0 * f[k, 9] + r1 * f[k, 10] + r2 * f[k, 11]
            y += r3 * f[k, 9] + r4 * f[k, 10] + r5 * f[k, 11]
            z += r6 * f[k, 9] + r7 * f[k, 10] + r8 * f[k, 11]
            a0 = r0 * f[k, 0] + r1 * f[k, 3] + r2 * f[k, 6]
            a1 = r0 * f[k, 1] + r1 * f[k, 4] + r2 * f[k, 7]
            a2 = r0 * f[k, 2] + r1 * f[k, 5] + r2 * f[k, 8]
            a3 = r3 * f[k, 0] + r4 * f[k, 3] + r5 * f[k, 6]
            a4 = r3 * f[k, 1] + r4 * f[k, 4] + r5 * f[k, 7]
            a5 = r3 * f[k, 2] + r4 * f[k, 5] + r5 * f[k, 8]
            a6 = r6 * f[k, 0] + r7 * f[k, 3] + r8 * f[k, 6]
            a7 = r6 * f[k, 1] + r7 * f[k, 4] + r8 * f[k, 7]
            a8 = r6 * f[k, 2] + r7 * f[k, 5] + r8 * f[k, 8]
            r2, r5, r8 = a2, a5, a8
            if k == self.joint_count:
                r0, r1, r3, r4, r6, r7 = a0, a1, a3, a4, a6, a7
                break
            self._points[k, 0], self._points[k, 1], self._points[k, 2] = x, y, z
            self._axes[k, 0], self._axes[k, 1], self._axes[k, 2] = r2, r5, r8
            s, c = self._sines[0, k], self._sines[1, k]
            r0, r1 = c * a0 + s * a1, c * a1 - s * a0
            r3, r4 = c * a3 + s * a4, c * a4 - s * a3
            r6, r7 = c * a6 + s * a7, c * a7 - s * a6
        r = self.turned
        r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8] = r0, r1, r2, r3, r4, r5, r6, r7, r8
        self.place[0], self.place[1], self.place[2] = x, y, z
        return False

    @cython.cfunc
    @cython.exceptval(check=False)
    def find_columns(self) -> cython.void:
        """Compute the Jacobian for the cached joint positions."""
        if self._has_columns:
            return
        self._has_columns = True
        j, a, p = self.columns, self._axes, self._points
        for k in range(self.joint_count):
            x = self.place[0] - p[k, 0]
            y = self.place[1] - p[k, 1]
            z = self.place[2] - p[k, 2]
            j[0, k] = a[k, 1] * z - a[k, 2] * y
            j[1, k] = a[k, 2] * x - a[k, 0] * z
            j[2, k] = a[k, 0] * y - a[k, 1] * x
            j[3, k], j[4, k], j[5, k] = a[k, 0], a[k, 1], a[k, 2]

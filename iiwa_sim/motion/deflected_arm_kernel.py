"""The arm beside a plan: its joints where the TCP is deflected, as far as they can follow.

The closed-form inverse gives the joints, on the branch they are on. Where the deflected pose is out of reach,
or a joint would pass its `JointBounds`, the joints make the motion within these that deviates least from the
wanted one, weighted by mass (Gauss's principle of least constraint). So at a limit, and beyond its reach, the
arm is stopped as by a wall without elasticity, and slides along it. At singular poses the joints' own inertia
keeps it from infinite speeds.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from typing import Any

import cython
import numpy as np
from cython.cimports.libc.math import cos, sin, sqrt

from iiwa_sim.frames import Rotation, Transform, Vector, multiply, rotation_vector, transpose
from iiwa_sim.motion.least_constraint import least_deviation
from iiwa_sim.motion.shift_kernel import MASS_KG

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.joint_bounds_kernel import JointBounds
    from cython.cimports.iiwa_sim.robot.arm_kernel import Kinematics
else:
    from iiwa_sim.motion.joint_bounds_kernel import JointBounds
    from iiwa_sim.robot.arm_kernel import Kinematics

INERTIA_KGM2 = 0.2
"""Apparent moment of inertia of the TCP about any axis. Our decision: its stiffest swing is as fast as that
of the mass on the stiffest spring, 31.6 rad/s."""
REDUNDANCY_INERTIA_KGM2 = 0.2
"""Apparent moment of inertia of the arm when it swivels round a TCP that stays. Our decision."""
JOINT_INERTIA_KGM2 = 1e-4
"""Moment of inertia of each joint for itself: felt only near singular poses."""


@cython.cclass
class DeflectedArm:
    """The joints that follow a plan and a deflection from it.

    A deflection is seven numbers: translation (m) and rotation vector (rad) of the TCP in base axes, and
    redundancy (rad).
    """

    def __init__(self, kinematics: Kinematics, bounds: JointBounds) -> None:
        """The bounds are those of this arm."""
        self.kinematics = kinematics
        self._bounds = bounds
        masses = [MASS_KG] * 3 + [INERTIA_KGM2] * 3 + [REDUNDANCY_INERTIA_KGM2]
        self._weights: Any = np.sqrt(np.array(masses[: kinematics.coordinates]))
        self.joints: Any = None
        self.planned: Any = None
        self.at = np.zeros(12)
        self.redundancy = 0.0
        self.turned = np.zeros(9)

    @cython.cfunc
    def plan(self, planned: Any) -> object:
        """The plan has come to joint positions (rad)."""
        self.planned = planned
        arm = self.kinematics.arm
        arm.go_to(planned)
        for k in range(9):
            self.at[k] = arm.turned[k]
        for k in range(3):
            self.at[9 + k] = arm.place[k]
        self.redundancy = self.kinematics.redundancy_where_it_is()
        return None

    @cython.cfunc
    @cython.exceptval(-1)
    def follow(self, x: cython.double[::1], before: Any) -> cython.bint:
        """Move the joints after a deflection; says whether they could follow.

        `before` are the planned joints of the tick before. Where the joints could not follow, the deflection
        becomes the one that they have come to.
        """
        r, at = self.turned, self.at
        self._turn(x[3], x[4], x[5])
        px, py, pz = at[9] + x[0], at[10] + x[1], at[11] + x[2]
        redundancy = self.redundancy + x[6]
        joints = self.kinematics.joints_for(r, px, py, pz, redundancy, self.joints)
        if joints is not None and self._bounds.allow(self.joints, joints):
            self.joints = joints
            return True
        rotation = (r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8])
        self._follow_within_bounds(before, Transform(rotation, (px, py, pz)), redundancy)
        self._find_deflection(x)
        return False

    @cython.cfunc
    def force_of(self, torques: Any) -> object:
        """The force at the TCP and on the redundancy that does the same work as torques (Nm) on the joints:
        J^T f = torque."""
        _, jacobian = self.kinematics.tcp_and_jacobian(self.joints)
        weighted = self._weights[:, None] * jacobian
        inertia = weighted @ weighted.T + JOINT_INERTIA_KGM2 * np.eye(len(weighted))
        return self._weights * np.linalg.solve(inertia, weighted @ np.array(torques))

    @cython.cfunc
    @cython.exceptval(check=False)
    def _turn(self, a: cython.double, b: cython.double, c: cython.double) -> cython.void:
        """Turn the plan's rotation by a rotation vector (rad) in base axes."""
        r, p = self.turned, self.at
        angle: cython.double = sqrt(a * a + b * b + c * c)
        if angle == 0.0:
            for k in range(9):
                r[k] = p[k]
            return
        x, y, z = a / angle, b / angle, c / angle
        c, s, half = cos(angle), sin(angle), sin(0.5 * angle)
        share = 2.0 * half * half  # 1 - cos(angle) without losing digits at small angles
        ax, ay, az = share * x, share * y, share * z
        t0, t1, t2 = c + ax * x, ax * y - s * z, ax * z + s * y
        t3, t4, t5 = ax * y + s * z, c + ay * y, ay * z - s * x
        t6, t7, t8 = ax * z - s * y, ay * z + s * x, c + az * z
        for k in range(3):
            r[k] = t0 * p[k] + t1 * p[3 + k] + t2 * p[6 + k]
            r[3 + k] = t3 * p[k] + t4 * p[3 + k] + t5 * p[6 + k]
            r[6 + k] = t6 * p[k] + t7 * p[3 + k] + t8 * p[6 + k]

    @cython.cfunc
    def _follow_within_bounds(self, before: Any, wanted: Any, redundancy: float) -> object:
        """Move the joints as near to what is wanted as they can go in a tick, by Gauss's principle."""
        joints, kinematics = self.joints, self.kinematics
        carried = [n - b for n, b in zip(self.planned, before, strict=True)]
        guess = tuple([q + c for q, c in zip(joints, carried, strict=True)])
        pose, jacobian = kinematics.tcp_and_jacobian(guess)
        missing = [a - b for a, b in zip(wanted.translation, pose.translation, strict=True)]
        missing += _log(multiply(wanted.rotation, transpose(pose.rotation)))
        missing.append(redundancy - kinematics.redundancy(guess))
        least, greatest = self._bounds.ways(joints)
        way = least_deviation(
            self._weights[:, None] * jacobian,
            self._weights * np.array(missing[: kinematics.coordinates]),
            JOINT_INERTIA_KGM2,
            [a - c for a, c in zip(least, carried, strict=True)],
            [b - c for b, c in zip(greatest, carried, strict=True)],
        )
        self.joints = self._bounds.within(tuple([g + w for g, w in zip(guess, way, strict=True)]))
        return None

    @cython.cfunc
    def _find_deflection(self, x: cython.double[::1]) -> object:
        """How far the arm is off the plan."""
        at, kinematics = self.at, self.kinematics
        rotation, (px, py, pz) = kinematics.tcp(self.joints)
        planned = (at[0], at[1], at[2], at[3], at[4], at[5], at[6], at[7], at[8])
        swivel = kinematics.redundancy(self.joints) - self.redundancy
        off = (px - at[9], py - at[10], pz - at[11], *_log(multiply(rotation, transpose(planned))), swivel)
        for k in range(9):
            self.turned[k] = rotation[k]
        for k in range(7):
            x[k] = off[k]
        return None


def _log(rotation: Rotation) -> Vector:
    """The rotation vector (rad)."""
    (x, y, z), angle = rotation_vector(rotation)
    return (x * angle, y * angle, z * angle)

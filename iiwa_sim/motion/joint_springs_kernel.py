"""Gravity hold: every joint a damped mass on a spring around where the hold began."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from typing import Any

import cython
import numpy as np

from iiwa_sim.motion.joint_bounds_kernel import JointBounds
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.spring import damping, spring
from iiwa_sim.motion.surroundings import LONGEST_SUBSTEP_S, Pushes
from iiwa_sim.robot.arm_kernel import Kinematics

if cython.compiled:
    from cython.cimports.iiwa_sim.robot.arm_kernel import Tcp
    from cython.cimports.iiwa_sim.robot.feeling_kernel import Feeling
else:
    from iiwa_sim.robot.arm_kernel import Tcp
    from iiwa_sim.robot.feeling_kernel import Feeling

INERTIA_KGM2 = 0.5
"""Apparent moment of inertia of each joint. Our decision."""
LEAST_DAMPING_NMS_PER_RAD = 5.0
"""Our decision: without a spring 6 Nm, 10 N at 0.6 m, turn a joint at 1.2 rad/s, as when guided by hand.
Below 25.5 Nm/rad the damping ratio is above 0.7."""
# Anything more is felt as this.
_LARGEST_TORQUE_NM = cython.declare(cython.double, 1e6)


@cython.cclass
class JointSprings:
    """Joint positions over ticks: torque over stiffness away from where the hold began, once all is at rest.

    Contact and pushes act through the transposed Jacobian. A joint that would pass `JointBounds` stays on
    them, and loses the velocity it cannot have.
    """

    centre: Any = cython.declare(object, visibility="readonly")
    _tcp: Tcp
    _joint_count: cython.Py_ssize_t
    _bounds: Any
    _tick_s: cython.double
    _pushes: Any
    _feels: cython.bint  # whether there is anything to touch
    _feeling: Feeling
    _substeps: cython.Py_ssize_t
    _joints: Any
    _spring: cython.double[::1]  # over a tick
    _spring_in_contact: cython.double[::1]  # over a substep
    _half_kick: cython.double  # velocity (rad/s) for each Nm
    # Of each joint: deflection (rad), its velocity, and the torque of pushes (Nm); then both after a tick.
    _x: cython.double[::1]
    _v: cython.double[::1]
    _torques: cython.double[::1]
    _x_after: cython.double[::1]
    _v_after: cython.double[::1]
    _touching: cython.bint
    _acting: cython.double[::1]  # what surfaces do to the TCP where it is: force (N) and torque (Nm)
    _seen: cython.double[::1]  # and what they would do elsewhere
    _kicks: cython.double[::1]  # what half a kick by that adds to the velocity of each joint

    def __init__(
        self,
        kinematics: Kinematics,
        bounds: JointBounds,
        tick_s: float,
        pushes: Pushes,
        feeling: Feeling | None,
    ) -> None:
        """`feeling` is None where there is nothing to touch."""
        self._tcp = kinematics.arm
        self._joint_count = count = kinematics.joint_count
        self._bounds: Any = bounds
        self._tick_s = tick_s
        self._pushes: Any = pushes
        self._feels, self._feeling = feeling is not None, feeling
        self._substeps = ceil(tick_s / LONGEST_SUBSTEP_S - 1e-9)
        self._x, self._v, self._torques = np.zeros(count), np.zeros(count), np.zeros(count)
        self._x_after, self._v_after = np.zeros(count), np.zeros(count)
        self._acting, self._seen = np.zeros((2, 6))
        self._kicks = np.zeros(count)

    def start(self, joints: Joints, velocity: Sequence[float], stiffness_nm_per_rad: float) -> None:
        """Hold these joint positions (rad), coming from a velocity (rad/s)."""
        damped = damping(INERTIA_KGM2, stiffness_nm_per_rad, LEAST_DAMPING_NMS_PER_RAD)
        part_s: cython.double = self._tick_s / self._substeps
        self._spring = spring(INERTIA_KGM2, stiffness_nm_per_rad, damped, self._tick_s)
        self._spring_in_contact = spring(INERTIA_KGM2, stiffness_nm_per_rad, damped, part_s)
        self._half_kick = 0.5 * part_s / INERTIA_KGM2
        self.centre = self._joints = joints
        """Where the hold began (rad)."""
        self._x[:] = 0.0
        for k in range(self._joint_count):
            self._v[k] = velocity[k]
        self._touching = self._feels and self._touches(joints, self._acting)

    def step(self) -> Joints:
        """A tick."""
        x, v, x_after, v_after = self._x, self._v, self._x_after, self._v_after
        joints = self._joints
        self._find_torques()
        after = None
        if not self._touching:
            c, f = self._spring, self._torques
            for k in range(self._joint_count):
                x_after[k] = c[0] * x[k] + c[1] * v[k] + c[2] * f[k]
                v_after[k] = c[3] * x[k] + c[4] * v[k] + c[5] * f[k]
            after = self._turned()
            if self._feels and self._touches(after, self._seen):
                after = None
        if after is None:
            self._step_in_contact()
            after = self._turned()
        if not self._bounds.allow(joints, after):
            least, greatest = self._bounds.ways(joints)
            for k in range(self._joint_count):
                wanted = x_after[k] - x[k]
                way = min(max(wanted, least[k]), greatest[k])
                if way != wanted:
                    x_after[k], v_after[k] = x[k] + way, way / self._tick_s
            after = self._turned()
        for k in range(self._joint_count):
            x[k], v[k] = x_after[k], v_after[k]
        self._joints = self._bounds.within(after)
        turned: Joints = self._joints
        return turned

    @cython.cfunc
    def _turned(self) -> Any:
        """Where the joints are after the tick (rad)."""
        turned = []
        q: cython.double
        for k in range(self._joint_count):
            q = self.centre[k]
            turned.append(q + self._x_after[k])
        return tuple(turned)

    @cython.cfunc
    def _find_torques(self) -> object:
        """Find the torques (Nm) of the pushes on each joint."""
        wrench, push = self._pushes.tcp_push, self._pushes.joint_push
        pushed: cython.bint = any(wrench)
        if pushed:
            self._tcp.find_torques(self._joints, wrench)
        torque: cython.double
        for k in range(self._joint_count):
            torque = push[k]
            if pushed:
                torque += self._tcp.torque[k]
            self._torques[k] = min(max(torque, -_LARGEST_TORQUE_NM), _LARGEST_TORQUE_NM)
        return None

    @cython.cfunc
    def _touches(self, joints: Any, acting: cython.double[::1]) -> cython.bint:
        """Whether surfaces do anything to the TCP at rest at joint positions (rad), and what."""
        self._tcp.go_to(joints)
        p = self._tcp.place
        return self._feeling.acts_at(p[0], p[1], p[2], 0.0, 0.0, 0.0, False, acting)

    @cython.cfunc
    @cython.exceptval(check=False)
    def _find_kicks(self) -> cython.void:
        """Find the kicks of what surfaces do now, by the columns that are there."""
        j = self._tcp.columns
        for k in range(self._joint_count):
            torque: cython.double = 0.0
            for i in range(6):
                torque += j[i, k] * self._acting[i]
            self._kicks[k] = self._half_kick * torque

    @cython.cfunc
    def _step_in_contact(self) -> object:
        """Deflection and its velocity after a tick, by half kicks of surfaces before and after each substep
        (velocity Verlet).

        Within a tick the TCP goes straight as the joints turn: by a hundredth of a radian at most.
        """
        c, f, kicks = self._spring_in_contact, self._torques, self._kicks
        x, v = self._x_after, self._v_after
        self._tcp.go_to(self._joints)
        self._tcp.find_columns()
        j, place = self._tcp.columns, self._tcp.place
        for k in range(self._joint_count):
            x[k], v[k] = self._x[k], self._v[k]
        self._find_kicks()
        for _ in range(self._substeps):
            px: cython.double = place[0]
            py: cython.double = place[1]
            pz: cython.double = place[2]
            vx: cython.double = 0.0
            vy: cython.double = 0.0
            vz: cython.double = 0.0
            for k in range(self._joint_count):
                v[k] += kicks[k]
                before = x[k]
                x[k] = c[0] * before + c[1] * v[k] + c[2] * f[k]
                v[k] = c[3] * before + c[4] * v[k] + c[5] * f[k]
                way = x[k] - self._x[k]
                # Before its half kick the velocity is too slow by that, which no surface's damping must feel.
                rate = v[k] + kicks[k]
                px, py, pz = px + j[0, k] * way, py + j[1, k] * way, pz + j[2, k] * way
                vx, vy, vz = vx + j[0, k] * rate, vy + j[1, k] * rate, vz + j[2, k] * rate
            self._touching = self._feeling.acts_at(px, py, pz, vx, vy, vz, True, self._acting)
            self._find_kicks()
            for k in range(self._joint_count):
                v[k] += kicks[k]
        return None

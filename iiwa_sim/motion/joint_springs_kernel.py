"""Gravity hold: every joint a damped mass on a spring around where the hold began."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from operator import add
from typing import Any

import cython
import numpy as np

from iiwa_sim.motion.joint_bounds_kernel import JointBounds
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.spring import Spring, damping
from iiwa_sim.motion.surroundings import LONGEST_SUBSTEP_S, Feel, Pushes
from iiwa_sim.robot.kinematics_kernel import Kinematics
from iiwa_sim.wrench import NO_TOUCH

if cython.compiled:
    from cython.cimports.iiwa_sim.robot.tcp_kernel import Tcp
else:
    from iiwa_sim.robot.tcp_kernel import Tcp

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
    _feel: Any
    _substeps: cython.Py_ssize_t
    _joints: Any
    _spring: cython.double[::1]  # over a tick
    _spring_in_contact: cython.double[::1]  # over a substep
    _half_kick: cython.double
    _become: cython.double[:, ::1]
    # Of each joint: deflection (rad), its velocity, and the torque of pushes (Nm); then both after a tick.
    _x: cython.double[::1]
    _v: cython.double[::1]
    _torques: cython.double[::1]
    _x_after: cython.double[::1]
    _v_after: cython.double[::1]
    _touching: cython.bint
    _touches: cython.double[:, ::1]  # before the first substep, and after each: force (N) and torque (Nm)
    _kicks: cython.double[:, ::1]
    _sums: cython.double[:, ::1]

    def __init__(
        self, kinematics: Kinematics, bounds: JointBounds, tick_s: float, pushes: Pushes, feel: Feel | None
    ) -> None:
        """`feel` is None where there is nothing to touch."""
        self._tcp = kinematics.arm
        self._joint_count = count = kinematics.joint_count
        self._bounds: Any = bounds
        self._tick_s = tick_s
        self._pushes: Any = pushes
        self._feel: Any = feel
        self._substeps = ceil(tick_s / LONGEST_SUBSTEP_S - 1e-9)
        self._x, self._v, self._torques = np.zeros(count), np.zeros(count), np.zeros(count)
        self._x_after, self._v_after = np.zeros(count), np.zeros(count)
        self._touches = np.zeros((self._substeps + 1, 6))
        self._kicks = np.zeros((6, 3))
        self._sums = np.zeros((2, 6))

    def start(self, joints: Joints, velocity: Sequence[float], stiffness_nm_per_rad: float) -> None:
        """Hold these joint positions (rad), coming from a velocity (rad/s)."""
        damped = damping(INERTIA_KGM2, stiffness_nm_per_rad, LEAST_DAMPING_NMS_PER_RAD)
        count, part_s = self._substeps, self._tick_s / self._substeps
        # Over no, one, two ... all substeps of a tick.
        springs = [
            Spring(INERTIA_KGM2, stiffness_nm_per_rad, damped, part_s * parts) for parts in range(count + 1)
        ]
        self._spring = np.array(springs[count].coefficients)
        self._spring_in_contact = np.array(springs[1].coefficients)
        # What has become of a kick at the end of the tick: one half at its ends, whole between substeps.
        halves = [1.0, *[2.0] * (count - 1), 1.0]
        became = [spring.coefficients for spring in reversed(springs)]
        kick_s = 0.5 * part_s / INERTIA_KGM2
        rows = [[kick_s * half * b[k] for half, b in zip(halves, became, strict=True)] for k in (1, 4)]
        self._half_kick, self._become = kick_s, np.array(rows)
        self.centre = self._joints = joints
        """Where the hold began (rad)."""
        self._x[:] = 0.0
        for k in range(self._joint_count):
            self._v[k] = velocity[k]
        self._touching = False
        if self._feel is not None:
            self._tcp.go_to(joints)
            p = self._tcp.place
            self._touch(0, p[0], p[1], p[2], 0.0, 0.0, 0.0, 0.0)

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
            if self._feel is not None and self._meets(after):
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
        x[:] = x_after
        v[:] = v_after
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
        """Of the pushes (Nm), on each joint."""
        wrench, push = self._pushes.tcp_push, self._pushes.joint_push
        if any(wrench):
            made = self._tcp.torques(self._joints, wrench)
            push = tuple(map(add, push, made))
        torque: cython.double
        for k in range(self._joint_count):
            torque = push[k]
            self._torques[k] = min(max(torque, -_LARGEST_TORQUE_NM), _LARGEST_TORQUE_NM)
        return None

    @cython.cfunc
    def _meets(self, joints: Any) -> cython.bint:
        """Whether the TCP touches something at joint positions (rad)."""
        self._tcp.go_to(joints)
        p = self._tcp.place
        return self._feel((p[0], p[1], p[2]), NO_TOUCH[0], 0.0) != NO_TOUCH

    @cython.cfunc
    def _touch(
        self,
        row: cython.Py_ssize_t,
        x: cython.double,
        y: cython.double,
        z: cython.double,
        vx: cython.double,
        vy: cython.double,
        vz: cython.double,
        dt_s: cython.double,
    ) -> object:
        """Feel the world with the TCP here (m), at this velocity (m/s)."""
        t = self._touches
        force, torque = self._feel((x, y, z), (vx, vy, vz), dt_s)
        t[row, 0], t[row, 1], t[row, 2] = force
        t[row, 3], t[row, 4], t[row, 5] = torque
        self._touching = False
        for k in range(6):
            if t[row, k] != 0.0:
                self._touching = True
        return None

    @cython.cfunc
    def _step_in_contact(self) -> object:
        """Deflection and its velocity after a tick.

        Within a tick the TCP goes straight on: joints turn by a hundredth of a radian at most. One and the
        same spring is on every joint, so its matrix moves the TCP on, too, and substeps need no more than
        that. The joints then take one step of the whole tick, and what became of all kicks.
        """
        tcp, t, kicks, c = self._tcp, self._touches, self._kicks, self._spring_in_contact
        tcp.go_to(self._joints)
        tcp.find_columns()
        j, place = tcp.columns, tcp.place
        count: cython.Py_ssize_t = self._joint_count
        x: cython.double = 0.0
        y: cython.double = 0.0
        z: cython.double = 0.0
        vx: cython.double = 0.0
        vy: cython.double = 0.0
        vz: cython.double = 0.0
        fx: cython.double = 0.0
        fy: cython.double = 0.0
        fz: cython.double = 0.0
        for k in range(count):
            x, y, z = x + j[0, k] * self._x[k], y + j[1, k] * self._x[k], z + j[2, k] * self._x[k]
            vx, vy, vz = vx + j[0, k] * self._v[k], vy + j[1, k] * self._v[k], vz + j[2, k] * self._v[k]
            torque = self._torques[k]
            fx, fy, fz = fx + j[0, k] * torque, fy + j[1, k] * torque, fz + j[2, k] * torque
        # What surfaces do, times this, is the half kick of the TCP.
        for i in range(6):
            ax: cython.double = 0.0
            ay: cython.double = 0.0
            az: cython.double = 0.0
            for k in range(count):
                ax, ay, az = ax + j[i, k] * j[0, k], ay + j[i, k] * j[1, k], az + j[i, k] * j[2, k]
            half = self._half_kick
            kicks[i, 0], kicks[i, 1], kicks[i, 2] = half * ax, half * ay, half * az
        part_s: cython.double = self._tick_s / self._substeps
        px, py, pz = place[0] - x, place[1] - y, place[2] - z
        kx: cython.double = 0.0
        ky: cython.double = 0.0
        kz: cython.double = 0.0
        for i in range(6):
            kx, ky, kz = kx + kicks[i, 0] * t[0, i], ky + kicks[i, 1] * t[0, i], kz + kicks[i, 2] * t[0, i]
        for row in range(1, self._substeps + 1):
            vx, vy, vz = vx + kx, vy + ky, vz + kz
            x, vx = c[0] * x + c[1] * vx + c[2] * fx, c[3] * x + c[4] * vx + c[5] * fx
            y, vy = c[0] * y + c[1] * vy + c[2] * fy, c[3] * y + c[4] * vy + c[5] * fy
            z, vz = c[0] * z + c[1] * vz + c[2] * fz, c[3] * z + c[4] * vz + c[5] * fz
            self._touch(row, px + x, py + y, pz + z, vx + kx, vy + ky, vz + kz, part_s)
            kx = ky = kz = 0.0
            for i in range(6):
                kx, ky = kx + kicks[i, 0] * t[row, i], ky + kicks[i, 1] * t[row, i]
                kz += kicks[i, 2] * t[row, i]
            vx, vy, vz = vx + kx, vy + ky, vz + kz
        c, sums = self._spring, self._sums
        for i in range(6):
            sums[0, i] = sums[1, i] = 0.0
            for row in range(self._substeps + 1):
                sums[0, i] += self._become[0, row] * t[row, i]
                sums[1, i] += self._become[1, row] * t[row, i]
        for k in range(count):
            deflection: cython.double = c[0] * self._x[k] + c[1] * self._v[k] + c[2] * self._torques[k]
            velocity: cython.double = c[3] * self._x[k] + c[4] * self._v[k] + c[5] * self._torques[k]
            for i in range(6):
                deflection += sums[0, i] * j[i, k]
                velocity += sums[1, i] * j[i, k]
            self._x_after[k], self._v_after[k] = deflection, velocity
        for i in range(6):
            t[0, i] = t[self._substeps, i]
        return None

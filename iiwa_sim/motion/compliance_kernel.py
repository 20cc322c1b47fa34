"""Compliance of the TCP: a damped mass on springs around a planned motion, as far as the joints can follow.

**What yields.** Seven numbers say how far the robot is off the planned motion: the TCP's translation in the
base (m), its rotation (a rotation vector in base axes, rad), and, for a robot with redundancy, the
redundancy (rad). Each is a mass on a spring and a damper of its own, whose equilibrium moves with the plan;
so without force the robot is where the plan says, exactly. Forces are pushes, the control wrench and what
surfaces do.

**Steps.** Springs and dampers are moved on exactly (`spring.py`) at any tick rate, with contact in parts of a
tick (`shift_kernel.py`).

**Joints.** The closed-form inverse gives them, on the branch they are on. Where it does not reach what the
springs want, or a joint would pass its `JointBounds`, they do of all motions within these the one with the
least mass-weighted deviation from it (Gauss's principle of least constraint), and the springs go on from
where the robot has really come to. So at a limit, and beyond the arm's reach, it is stopped as by a soft
wall that gives nothing back, and slides along it. At singular poses the joints' own inertia keeps it from
infinite speeds.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt

from iiwa_sim.frames import Rotation, Transform, Vector, multiply, rotation_vector, transpose
from iiwa_sim.motion.joint_bounds_kernel import JointBounds
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.least_constraint import least_deviation
from iiwa_sim.motion.shift_kernel import MASS_KG
from iiwa_sim.motion.spring import Spring, damping
from iiwa_sim.motion.surroundings import Feel, Pushes
from iiwa_sim.wrench import TcpContact

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.shift_kernel import Shift
    from cython.cimports.iiwa_sim.robot.kinematics_kernel import Kinematics
    from cython.cimports.iiwa_sim.robot.trigonometry_kernel import cosine, sine
else:
    from iiwa_sim.motion.shift_kernel import Shift
    from iiwa_sim.robot.kinematics_kernel import Kinematics
    from iiwa_sim.robot.trigonometry_kernel import cosine, sine

INERTIA_KGM2 = 0.2
"""Apparent moment of inertia of the TCP about any axis. Our decision: its stiffest swing is as fast as that
of the mass on the stiffest spring, 31.6 rad/s."""
REDUNDANCY_INERTIA_KGM2 = 0.2
"""Apparent moment of inertia of the arm when it swivels round a TCP that stays. Our decision."""
JOINT_INERTIA_KGM2 = 1e-4
"""Of each joint for itself: felt only near singular poses."""
ROTATIONAL_STIFFNESS_NM_PER_RAD = 200.0
"""Published: the original's."""
REDUNDANCY_STIFFNESS_NM_PER_RAD = 100.0
"""Published: the original's, of the null space."""
# N or Nm: anything more is felt as this.
_LARGEST_FORCE = cython.declare(cython.double, 1e6)
# So far the TCP may be turned off the plan: at half a turn a rotation vector would jump.
_LARGEST_TURN_RAD = cython.declare(cython.double, 2.5)
# Off the plan by less (m, rad), and hardly moving, the robot is put on it.
_HOME = cython.declare(cython.double, 1e-9)
_new = tuple.__new__  # calling the class costs twice as much


class CartesianImpedance(NamedTuple):
    """How the TCP gives way, and with what it pushes."""

    stiffness_n_per_m: float
    """In translation, the same in all directions."""
    control: tuple[float, float, float, float, float, float]
    """Force (N) and torque (Nm) that the controller adds, along the axes of the TCP, acting on the robot."""


@cython.cclass
class Compliance:
    """Joint positions over ticks around planned ones.

    Seven numbers each are the deflection, its velocity, and forces: translation (m) and rotation vector (rad)
    in base axes, redundancy (rad).
    """

    tcp_contact: Any = cython.declare(object, visibility="readonly")
    _kinematics: Kinematics
    _bounds: Any
    _pushes: Any
    _shift: Shift
    _tick_s: cython.double
    _in_contact: cython.bint
    _weights: Any
    _turning: cython.double[::1]
    _swivelling: cython.double[::1]
    _joints: Any
    _nominal: Any
    _at: cython.double[::1]  # of the plan: the rotation of the TCP in the base, row by row, and its place (m)
    _redundancy: cython.double  # of the plan (rad)
    _was: cython.double[::1]  # that place a tick before
    _moved: cython.double[::1]  # from there, in this tick
    _turned: cython.double[::1]  # the rotation of the TCP in the base
    _x: cython.double[::1]
    _v: cython.double[::1]
    _forces: cython.double[::1]
    _forced: cython.bint  # whether any of these is not 0

    def __init__(
        self,
        kinematics: Kinematics,
        bounds: JointBounds,
        tick_s: float,
        pushes: Pushes,
        feel: Feel | None,
    ) -> None:
        """`feel` is None where there is nothing to touch."""
        self._kinematics = kinematics
        self._bounds = bounds
        self._tick_s = tick_s
        self._pushes = pushes
        self.tcp_contact: TcpContact | None = None
        """Where the TCP has come to in the last tick, and what it touches there, where that is known."""
        self._in_contact = False
        self._shift = Shift(tick_s, feel)
        masses = [MASS_KG] * 3 + [INERTIA_KGM2] * 3 + [REDUNDANCY_INERTIA_KGM2]
        self._weights = np.sqrt(np.array(masses[: kinematics.coordinates]))
        turn, swivel = ROTATIONAL_STIFFNESS_NM_PER_RAD, REDUNDANCY_STIFFNESS_NM_PER_RAD
        damped, swivel_damped = damping(INERTIA_KGM2, turn), damping(REDUNDANCY_INERTIA_KGM2, swivel)
        self._turning = np.array(Spring(INERTIA_KGM2, turn, damped, tick_s).coefficients)
        swivelling = Spring(REDUNDANCY_INERTIA_KGM2, swivel, swivel_damped, tick_s)
        self._swivelling = np.array(swivelling.coefficients)
        self._at = np.zeros(12)
        self._was = np.zeros(3)
        self._moved = np.zeros(3)
        self._x = np.zeros(7)
        self._v = np.zeros(7)
        self._forces = np.zeros(7)
        self._turned = np.zeros(9)

    def start(self, joints: Joints, velocity: Sequence[float] | None = None) -> None:
        """On a plan that rests at joint positions (rad); the robot is there, too, with a velocity (rad/s)."""
        self._joints = joints
        self._plan(joints)
        self._turned[:] = self._at[:9]
        self._x[:] = 0.0
        self._v[:] = 0.0
        if velocity is not None and any(velocity):
            _, jacobian = self._kinematics.tcp_and_jacobian(joints)
            k: cython.Py_ssize_t
            for k, v in enumerate((jacobian @ np.array(velocity)).tolist()):
                self._v[k] = v
        self._shift.start((self._at[9], self._at[10], self._at[11]))
        self.tcp_contact = None

    @property
    def on_plan(self) -> bool:
        """Whether the robot is exactly where the plan says."""
        return bool(self._is_on_plan())

    @property
    def deflection(self) -> tuple[float, ...]:
        """How far the robot is off the plan."""
        return tuple(self._x)

    @property
    def velocity(self) -> tuple[float, ...]:
        """How fast it moves relative to the plan."""
        return tuple(self._v)

    def step(self, nominal: Joints, impedance: CartesianImpedance) -> Joints:
        """A tick, in which the plan has come to `nominal` (rad)."""
        self.tcp_contact = None
        before = self._nominal
        for k in range(3):
            self._was[k] = self._at[9 + k]
        if nominal != before:
            self._plan(nominal)
        for k in range(3):
            self._moved[k] = self._at[9 + k] - self._was[k]
        self._find_forces(impedance)
        alone = not self._forced and not self._shift.touches
        if alone and self._is_on_plan() and not self._shift.meets(self._at[9:], self._moved):
            self._turned[:] = self._at[:9]
            self._joints = nominal
            return nominal
        x = self._x
        start = (x[0], x[1], x[2], x[3], x[4], x[5], x[6])
        self._swing(impedance)
        self._follow(before, start)
        if not self._forced and not self._shift.touches and self._is_home():
            self._x[:] = 0.0
            self._v[:] = 0.0
            self._joints, self.tcp_contact = nominal, None
        joints: Joints = self._joints
        return joints

    @cython.cfunc
    def _plan(self, nominal: Any) -> object:
        """The plan has come to joint positions (rad)."""
        self._nominal = nominal
        arm = self._kinematics.arm
        arm.go_to(nominal)
        for k in range(9):
            self._at[k] = arm.turned[k]
        for k in range(3):
            self._at[9 + k] = arm.place[k]
        self._redundancy = self._kinematics.redundancy_where_it_is()
        return None

    @cython.cfunc
    @cython.exceptval(check=False)
    def _is_on_plan(self) -> cython.bint:
        on: cython.bint = True
        for k in range(7):
            on = on and self._x[k] == 0.0 and self._v[k] == 0.0
        return on

    @cython.cfunc
    def _find_forces(self, impedance: Any) -> object:
        """What acts besides springs and contact, in base axes; the last is the torque on the redundancy."""
        f, r = self._forces, self._turned
        joint_push = self._pushes.joint_push
        ax: cython.double
        ay: cython.double
        az: cython.double
        bx: cython.double
        by: cython.double
        bz: cython.double
        px: cython.double
        py: cython.double
        pz: cython.double
        qx: cython.double
        qy: cython.double
        qz: cython.double
        ax, ay, az, bx, by, bz = self._pushes.tcp_push
        px, py, pz, qx, qy, qz = impedance[1]
        ax, ay, az, bx, by, bz = ax + px, ay + py, az + pz, bx + qx, by + qy, bz + qz
        f[0] = r[0] * ax + r[1] * ay + r[2] * az
        f[1] = r[3] * ax + r[4] * ay + r[5] * az
        f[2] = r[6] * ax + r[7] * ay + r[8] * az
        f[3] = r[0] * bx + r[1] * by + r[2] * bz
        f[4] = r[3] * bx + r[4] * by + r[5] * bz
        f[5] = r[6] * bx + r[7] * by + r[8] * bz
        f[6] = 0.0
        if any(joint_push):
            self._add_joint_push(joint_push)
        self._forced = False
        for k in range(7):
            if f[k] != 0.0:
                self._forced = True
                f[k] = min(max(f[k], -_LARGEST_FORCE), _LARGEST_FORCE)
        return None

    @cython.cfunc
    def _add_joint_push(self, joint_push: Any) -> object:
        """What at the TCP and on the redundancy takes the same work: J^T f = torque."""
        _, jacobian = self._kinematics.tcp_and_jacobian(self._joints)
        weighted = self._weights[:, None] * jacobian
        inertia = weighted @ weighted.T + JOINT_INERTIA_KGM2 * np.eye(len(weighted))
        made = self._weights * np.linalg.solve(inertia, weighted @ np.array(joint_push))
        k: cython.Py_ssize_t
        for k, force in enumerate(made.tolist()):
            self._forces[k] += force
        return None

    @cython.cfunc
    def _swing(self, impedance: Any) -> object:
        """Move the deflection on by a tick, for the time being without regard to joints."""
        x, v, f, c = self._x, self._v, self._forces, self._turning
        self._in_contact = self._shift.step(impedance[0], x, v, f, self._was, self._moved)
        for k in range(3, 6):
            torque = f[k] + self._shift.torque[k - 3] if self._in_contact else f[k]
            y = x[k]
            x[k] = c[0] * y + c[1] * v[k] + c[2] * torque
            v[k] = c[3] * y + c[4] * v[k] + c[5] * torque
        square: cython.double = x[3] * x[3] + x[4] * x[4] + x[5] * x[5]
        if square > _LARGEST_TURN_RAD * _LARGEST_TURN_RAD:
            share: cython.double = _LARGEST_TURN_RAD / sqrt(square)
            for k in range(3, 6):
                x[k], v[k] = share * x[k], 0.0
        c = self._swivelling
        y = x[6]
        x[6] = c[0] * y + c[1] * v[6] + c[2] * f[6]
        v[6] = c[3] * y + c[4] * v[6] + c[5] * f[6]
        return None

    @cython.cfunc
    def _follow(self, before: Any, start: Any) -> object:
        """Move the joints after the deflection, and keep of it what they can do.

        `before` are the planned joints of the tick before, `start` the deflection then.
        """
        x, r, at = self._x, self._turned, self._at
        self._turn(x[3], x[4], x[5])
        rotation = (r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8])
        wanted = _new(Transform, (rotation, (at[9] + x[0], at[10] + x[1], at[11] + x[2])))
        redundancy = self._redundancy + x[6]
        joints = self._kinematics.joints_for(
            r, at[9] + x[0], at[10] + x[1], at[11] + x[2], redundancy, self._joints
        )
        if joints is not None and self._bounds.allow(self._joints, joints):
            self._joints = joints
            self.tcp_contact = (wanted, self._shift.touch if self._in_contact else None)
            return None
        self._follow_within_bounds(before, wanted, redundancy)
        self._find_off_plan()
        for k in range(7):
            self._v[k] = (x[k] - start[k]) / self._tick_s
        return None

    @cython.cfunc
    @cython.exceptval(check=False)
    def _turn(self, a: cython.double, b: cython.double, c: cython.double) -> cython.void:
        """Turn the plan's rotation by a rotation vector (rad) in base axes."""
        r, p = self._turned, self._at
        angle: cython.double = sqrt(a * a + b * b + c * c)
        if angle == 0.0:
            for k in range(9):
                r[k] = p[k]
            return
        x, y, z = a / angle, b / angle, c / angle
        cos, sin, half = cosine(angle), sine(angle), sine(0.5 * angle)
        share = 2.0 * half * half  # 1 - cos(angle) without losing digits at small angles
        ax, ay, az = share * x, share * y, share * z
        t0, t1, t2 = cos + ax * x, ax * y - sin * z, ax * z + sin * y
        t3, t4, t5 = ax * y + sin * z, cos + ay * y, ay * z - sin * x
        t6, t7, t8 = ax * z - sin * y, ay * z + sin * x, cos + az * z
        for k in range(3):
            r[k] = t0 * p[k] + t1 * p[3 + k] + t2 * p[6 + k]
            r[3 + k] = t3 * p[k] + t4 * p[3 + k] + t5 * p[6 + k]
            r[6 + k] = t6 * p[k] + t7 * p[3 + k] + t8 * p[6 + k]

    @cython.cfunc
    def _follow_within_bounds(self, before: Any, wanted: Any, redundancy: float) -> object:
        """Move the joints as near to what is wanted as they can go in a tick, by Gauss's principle."""
        joints, kinematics = self._joints, self._kinematics
        carried = [n - b for n, b in zip(self._nominal, before, strict=True)]
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
        self._joints = self._bounds.within(tuple([g + w for g, w in zip(guess, way, strict=True)]))
        return None

    @cython.cfunc
    def _find_off_plan(self) -> object:
        """How far the robot is off the plan."""
        at, kinematics = self._at, self._kinematics
        rotation, (x, y, z) = kinematics.tcp(self._joints)
        planned = (at[0], at[1], at[2], at[3], at[4], at[5], at[6], at[7], at[8])
        swivel = kinematics.redundancy(self._joints) - self._redundancy
        off = (x - at[9], y - at[10], z - at[11], *_log(multiply(rotation, transpose(planned))), swivel)
        for k in range(9):
            self._turned[k] = rotation[k]
        for k in range(7):
            self._x[k] = off[k]
        return None

    @cython.cfunc
    def _is_home(self) -> cython.bint:
        """Whether the robot is as good as on the plan, and at rest relative to it."""
        for k in range(7):
            if fabs(self._x[k]) >= _HOME or fabs(self._v[k]) >= _HOME:
                return False
        return max([abs(q - n) for q, n in zip(self._joints, self._nominal, strict=True)]) < _HOME


def _log(rotation: Rotation) -> Vector:
    """The rotation vector (rad)."""
    (x, y, z), angle = rotation_vector(rotation)
    return (x * angle, y * angle, z * angle)

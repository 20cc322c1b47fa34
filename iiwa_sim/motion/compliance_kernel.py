"""Compliance of the TCP: a damped mass on springs around a planned motion, as far as the joints can follow.

**What yields.** Seven numbers say how far the robot is off the planned motion: the TCP's translation in the
base (m), its rotation (a rotation vector in base axes, rad), and, for a robot with redundancy, the
redundancy (rad). Each is a mass on a spring and a damper of its own, whose equilibrium moves with the plan;
so without force the robot is where the plan says, exactly. Forces are pushes, the control wrench and what
surfaces do.

**Steps.** Springs and dampers are moved on exactly (`spring.py`) at any tick rate, with contact in parts of a
tick (`shift_kernel.py`).

**Joints.** They follow as far as they can (`deflected_arm_kernel.py`). Where they cannot, the springs go on
from the pose that the arm has reached.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt

from iiwa_sim.motion.deflected_arm_kernel import INERTIA_KGM2, REDUNDANCY_INERTIA_KGM2
from iiwa_sim.motion.joint_bounds_kernel import JointBounds
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.spring import damping, spring
from iiwa_sim.motion.surroundings import Pushes

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.deflected_arm_kernel import DeflectedArm
    from cython.cimports.iiwa_sim.motion.shift_kernel import Shift
    from cython.cimports.iiwa_sim.robot.arm_kernel import Kinematics
    from cython.cimports.iiwa_sim.robot.feeling_kernel import Feeling, Reached
else:
    from iiwa_sim.motion.deflected_arm_kernel import DeflectedArm
    from iiwa_sim.motion.shift_kernel import Shift
    from iiwa_sim.robot.arm_kernel import Kinematics
    from iiwa_sim.robot.feeling_kernel import Feeling, Reached

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
    _reached: Reached
    _arm: DeflectedArm
    _pushes: Any
    _shift: Shift
    _tick_s: cython.double
    _in_contact: cython.bint
    _turning: cython.double[::1]
    _swivelling: cython.double[::1]
    _at: cython.double[::1]  # the arm's: of the plan, the rotation of the TCP and its place (m)
    _was: cython.double[::1]  # that place a tick before
    _moved: cython.double[::1]  # from there, in this tick
    _turned: cython.double[::1]  # the arm's: the rotation of the TCP in the base
    _x: cython.double[::1]
    _start: cython.double[::1]  # where that was a tick before
    _v: cython.double[::1]
    _forces: cython.double[::1]
    _forced: cython.bint  # whether any of these is not 0
    _impedance: Any  # of the last tick, and what it says: stiffness (N/m), force (N) and torque (Nm)
    _stiffness: cython.double
    _control: cython.double[::1]
    _joint_push: Any  # of the last tick
    _joints_pushed: cython.bint  # whether any number of that is not 0

    def __init__(
        self,
        kinematics: Kinematics,
        bounds: JointBounds,
        tick_s: float,
        pushes: Pushes,
        feeling: Feeling | None,
    ) -> None:
        """`feeling` is None where there is nothing to touch."""
        self._arm = DeflectedArm(kinematics, bounds)
        self._at, self._turned = self._arm.at, self._arm.turned
        self._tick_s = tick_s
        self._pushes = pushes
        self._reached = Reached()
        self.tcp_contact: Reached | None = None
        """Where the TCP has come to in the last tick, and what it touches there, where that is known."""
        self._in_contact = False
        self._shift = Shift(tick_s, feeling)
        turn, swivel = ROTATIONAL_STIFFNESS_NM_PER_RAD, REDUNDANCY_STIFFNESS_NM_PER_RAD
        damped, swivel_damped = damping(INERTIA_KGM2, turn), damping(REDUNDANCY_INERTIA_KGM2, swivel)
        self._turning = spring(INERTIA_KGM2, turn, damped, tick_s)
        self._swivelling = spring(REDUNDANCY_INERTIA_KGM2, swivel, swivel_damped, tick_s)
        self._was = np.zeros(3)
        self._moved = np.zeros(3)
        self._x, self._start = np.zeros((2, 7))
        self._v = np.zeros(7)
        self._forces = np.zeros(7)
        self._control = np.zeros(6)
        self._impedance, self._joint_push = None, None
        self._joints_pushed = False

    def start(self, joints: Joints, velocity: Sequence[float] | None = None) -> None:
        """Begin on a plan that rests at joint positions (rad); the robot is there with a velocity (rad/s)."""
        self._arm.joints = joints
        self._arm.plan(joints)
        self._turned[:] = self._at[:9]
        self._x[:] = 0.0
        self._v[:] = 0.0
        if velocity is not None and any(velocity):
            _, jacobian = self._arm.kinematics.tcp_and_jacobian(joints)
            k: cython.Py_ssize_t
            for k, v in enumerate((jacobian @ np.array(velocity)).tolist()):
                self._v[k] = v
        self._shift.start(self._at)
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
        arm = self._arm
        before = arm.planned
        for k in range(3):
            self._was[k] = self._at[9 + k]
        if nominal != before:
            arm.plan(nominal)
        for k in range(3):
            self._moved[k] = self._at[9 + k] - self._was[k]
        self._find_forces(impedance)
        alone = not self._forced and not self._shift.touches
        if alone and self._is_on_plan() and not self._shift.meets(self._at, self._moved):
            for k in range(9):
                self._turned[k] = self._at[k]
            arm.joints = nominal
            return nominal
        x = self._x
        for k in range(7):
            self._start[k] = x[k]
        self._swing()
        if arm.follow(x, before):
            self.tcp_contact = self._reached
            self._hand_on()
        else:
            for k in range(7):
                self._v[k] = (x[k] - self._start[k]) / self._tick_s
        if not self._forced and not self._shift.touches and self._is_home():
            self._x[:] = 0.0
            self._v[:] = 0.0
            arm.joints, self.tcp_contact = nominal, None
        joints: Joints = arm.joints
        return joints

    @cython.cfunc
    @cython.exceptval(check=False)
    def _hand_on(self) -> cython.void:
        """Tell where the TCP is, and what it feels there if that was found."""
        reached, shift = self._reached, self._shift
        for k in range(9):
            reached.at[k] = self._turned[k]
        for k in range(3):
            reached.at[9 + k] = self._at[9 + k] + self._x[k]
        reached.felt = self._in_contact
        for k in range(6):
            reached.acting[k] = shift.acting[k]

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
        f, r, c = self._forces, self._turned, self._control
        if impedance is not self._impedance:
            stiffness, control = impedance
            self._stiffness = stiffness
            for n in range(6):
                c[n] = control[n]
            self._impedance = impedance
        joint_push = self._pushes.joint_push
        if joint_push is not self._joint_push:
            self._joint_push, self._joints_pushed = joint_push, any(joint_push)
        ax: cython.double
        ay: cython.double
        az: cython.double
        bx: cython.double
        by: cython.double
        bz: cython.double
        ax, ay, az, bx, by, bz = self._pushes.tcp_push
        ax, ay, az, bx, by, bz = ax + c[0], ay + c[1], az + c[2], bx + c[3], by + c[4], bz + c[5]
        f[0] = r[0] * ax + r[1] * ay + r[2] * az
        f[1] = r[3] * ax + r[4] * ay + r[5] * az
        f[2] = r[6] * ax + r[7] * ay + r[8] * az
        f[3] = r[0] * bx + r[1] * by + r[2] * bz
        f[4] = r[3] * bx + r[4] * by + r[5] * bz
        f[5] = r[6] * bx + r[7] * by + r[8] * bz
        f[6] = 0.0
        if self._joints_pushed:
            k: cython.Py_ssize_t
            for k, force in enumerate(self._arm.force_of(joint_push).tolist()):
                f[k] += force
        self._forced = False
        for k in range(7):
            if f[k] != 0.0:
                self._forced = True
                f[k] = min(max(f[k], -_LARGEST_FORCE), _LARGEST_FORCE)
        return None

    @cython.cfunc
    def _swing(self) -> object:
        """Move the deflection on by a tick, for the time being without regard to joints."""
        x, v, f, c = self._x, self._v, self._forces, self._turning
        self._in_contact = self._shift.step(self._stiffness, x, v, f, self._was, self._moved)
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
    def _is_home(self) -> cython.bint:
        """Whether the robot is as good as on the plan, and at rest relative to it."""
        for k in range(7):
            if fabs(self._x[k]) >= _HOME or fabs(self._v[k]) >= _HOME:
                return False
        return max([abs(q - n) for q, n in zip(self._arm.joints, self._arm.planned, strict=True)]) < _HOME

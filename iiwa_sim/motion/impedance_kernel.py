"""Impedance: a compliant robot as a damped mass on springs, at the TCP or in every joint."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from typing import Any

import cython
import numpy as np
from cython.cimports.iiwa_sim.contact.tcp_contact_kernel import TcpContact, TcpState
from cython.cimports.iiwa_sim.robot.arm_kernel import Kinematics, Tcp
from cython.cimports.libc.math import cos, fabs, sin, sqrt

from iiwa_sim.frames import turn_between
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.springs import (
    INERTIA_KGM2,
    JOINT_INERTIA_KGM2,
    LEAST_DAMPING_NMS_PER_RAD,
    LEAST_DAMPING_NS_PER_M,
    LONGEST_SUBSTEP_S,
    MASS_KG,
    REDUNDANCY_STIFFNESS_NM_PER_RAD,
    ROTATIONAL_STIFFNESS_NM_PER_RAD,
    SINGULAR_INERTIA_KGM2,
    CartesianImpedance,
    damping,
    least_deviation,
    spring,
)

_LARGEST = cython.declare(cython.double, 1e6)  # N or Nm: anything more acts as this
# Off the plan by less (m, rad), and hardly moving, the robot is put on it.
_HOME = cython.declare(cython.double, 1e-9)


@cython.cclass
class JointBounds:
    """Bounds on the motion of joints in a tick, which keep limits of position and velocity.

    A joint goes no faster than its velocity limit. Near a position limit it can always brake before that
    limit, from constant speed, with the limits of a stop.
    """

    _tick_s: cython.double
    _joint_count: cython.Py_ssize_t
    _low: cython.double[::1]
    _high: cython.double[::1]
    _full: cython.double[::1]  # distance in a tick at the velocity limit
    _acceleration: cython.double[::1]
    _lag_s: cython.double[::1]  # until full jerk has built up half of the acceleration, and a tick

    def __init__(
        self,
        tick_s: float,
        position_min: Sequence[float],
        position_max: Sequence[float],
        velocity: Sequence[float],
        stop_acceleration: Sequence[float],
        stop_jerk: Sequence[float],
    ) -> None:
        """Take the limits of each joint, in rad and s."""
        self._tick_s = tick_s
        self._joint_count = len(position_min)
        self._low, self._high = np.array(position_min, float), np.array(position_max, float)
        self._full = tick_s * np.array(velocity, float)
        self._acceleration = np.array(stop_acceleration, float)
        self._lag_s = 0.5 * np.array(stop_acceleration) / np.array(stop_jerk) + tick_s

    def ranges(self, joints: Joints) -> tuple[list[float], list[float]]:
        """Return the least and the greatest motion (rad) of each joint in the next tick."""
        count = self._joint_count
        least = [-self._farthest(joints[k] - self._low[k], k) for k in range(count)]
        return least, [self._farthest(self._high[k] - joints[k], k) for k in range(count)]

    @cython.ccall
    @cython.exceptval(-1)
    def allow(self, joints: Joints, after: Joints) -> cython.bint:
        """Return whether joints may go from one place to another (rad) in the next tick."""
        q: cython.double
        motion: cython.double
        for k in range(self._joint_count):
            q = joints[k]
            motion = after[k]
            motion -= q
            if not fabs(motion) <= self._farthest(self._high[k] - q if motion > 0.0 else q - self._low[k], k):
                return False
        return True

    def within(self, joints: Joints) -> Joints:
        """Return the nearest joint positions within the limits: takes rounding away."""
        low, high = self._low, self._high
        return tuple([min(max(joints[k], low[k]), high[k]) for k in range(self._joint_count)])

    @cython.cfunc
    @cython.exceptval(check=False)
    def _farthest(self, room: cython.double, k: cython.Py_ssize_t) -> cython.double:
        """Return the largest motion with so much room before a limit; braking takes v (v / a + a / j) / 2."""
        if room <= 0.0:
            return 0.0
        a: cython.double = self._acceleration[k]
        lag: cython.double = self._lag_s[k]
        return min(self._tick_s * a * (sqrt(lag * lag + 2.0 * room / a) - lag), room, self._full[k])


@cython.cclass
class Springs:
    """Masses on springs and dampers, which forces and surfaces at the TCP push.

    Springs and dampers are integrated exactly over a tick. In contact a tick has several substeps, with half
    kicks of the contact force before and after each (velocity Verlet). Energy does not grow on stiff
    surfaces.
    """

    count: cython.Py_ssize_t
    x: cython.double[::1]  # deflection of each mass: m or rad
    v: cython.double[::1]  # its velocity
    forces: cython.double[::1]  # on each mass besides surfaces: N or Nm
    before: cython.double[::1]  # deflection a tick before
    jacobian: cython.double[:, ::1]  # from x to place and rotation of the TCP (6, count)
    touches: cython.bint  # whether surfaces act on the TCP where it is,
    acting: cython.double[::1]  # by this force (N) and torque (Nm)
    _seen: cython.double[::1]  # and elsewhere
    _contact: TcpContact  # None where there are no surfaces
    _tick_s: cython.double
    _substeps: cython.Py_ssize_t
    _whole: cython.double[:, ::1]  # factors over a tick (count, 6), see `spring`
    _part: cython.double[:, ::1]  # over a substep
    _half_kicks: cython.double[::1]  # velocity for each N or Nm in half a substep,
    _kicks: cython.double[::1]  # and by what surfaces do now
    _next_x: cython.double[::1]
    _next_v: cython.double[::1]

    def __init__(self, count: int, tick_s: float, contact: Any) -> None:
        """`contact` is that of the TCP, None where there are no surfaces."""
        self.count = count
        self.x, self.v, self.forces, self.before, self._next_x, self._next_v = np.zeros((6, count))
        self._half_kicks, self._kicks = np.zeros((2, count))
        self.jacobian = np.eye(6, count)
        self.acting, self._seen = np.zeros((2, 6))
        self._contact, self._tick_s = contact, tick_s
        self._substeps = ceil(tick_s / LONGEST_SUBSTEP_S - 1e-9)
        self._whole, self._part = np.zeros((2, count, 6))

    def stiffen(self, first: int, last: int, mass: float, stiffness: float, least: float = 0.0) -> None:
        """Set springs from `first` to `last - 1`, and their dampers, which have `least` damping."""
        damped, part_s = damping(mass, stiffness, least), self._tick_s / self._substeps
        np.asarray(self._whole)[first:last] = spring(mass, stiffness, damped, self._tick_s)
        np.asarray(self._part)[first:last] = spring(mass, stiffness, damped, part_s)
        np.asarray(self._half_kicks)[first:last] = 0.5 * part_s / mass

    @cython.cfunc
    def start(self, place: cython.double[::1], velocity: Any) -> object:
        """Begin without deflection, with the TCP at a place (m); the velocity is of the first masses."""
        self.x[:] = 0.0
        self.v[:] = 0.0
        np.asarray(self.v)[: len(velocity)] = velocity
        self.touches = self._contact is not None and self._contact.acts_at(
            place[0], place[1], place[2], 0.0, 0.0, 0.0, False, self.acting
        )
        return None

    @cython.cfunc
    @cython.exceptval(-1)
    def step(self, place: cython.double[::1], moved: cython.double[::1]) -> cython.bint:
        """Make a tick; return whether there was contact in it.

        The TCP was at a place (m), and goes from there by the masses, and by what the plan has `moved` (m).
        """
        x, v, a, u, f = self.x, self.v, self._next_x, self._next_v, self.forces
        c = self._whole
        for k in range(self.count):
            self.before[k] = x[k]
        if not self.touches:
            for k in range(self.count):
                a[k] = c[k, 0] * x[k] + c[k, 1] * v[k] + c[k, 2] * f[k]
                u[k] = c[k, 3] * x[k] + c[k, 4] * v[k] + c[k, 5] * f[k]
            if self._contact is None or not self._acts(place, moved, 1.0, a, u, False, self._seen):
                for k in range(self.count):
                    x[k], v[k] = a[k], u[k]
                return False
        c, kicks = self._part, self._kicks
        self._find_kicks()
        for n in range(self._substeps):
            for k in range(self.count):
                v[k] += kicks[k]
                before = x[k]
                x[k] = c[k, 0] * before + c[k, 1] * v[k] + c[k, 2] * f[k]
                v[k] = c[k, 3] * before + c[k, 4] * v[k] + c[k, 5] * f[k]
                # Before its half kick the velocity is too slow by that, which damping must not see.
                u[k] = v[k] + kicks[k]
            share: cython.double = (n + 1.0) / self._substeps
            self.touches = self._acts(place, moved, share, x, u, True, self.acting)
            self._find_kicks()
            for k in range(self.count):
                v[k] += kicks[k]
        return True

    @cython.cfunc
    @cython.exceptval(check=False)
    def _find_kicks(self) -> cython.void:
        """Find what surfaces add to the velocity of each mass in half a substep."""
        j, f, h, kicks = self.jacobian, self.acting, self._half_kicks, self._kicks
        for k in range(self.count):
            force = j[0, k] * f[0] + j[1, k] * f[1] + j[2, k] * f[2]
            kicks[k] = h[k] * (force + j[3, k] * f[3] + j[4, k] * f[4] + j[5, k] * f[5])

    @cython.cfunc
    @cython.exceptval(-1)
    def _acts(
        self,
        place: cython.double[::1],
        moved: cython.double[::1],
        share: cython.double,
        x: cython.double[::1],
        v: cython.double[::1],
        remember: cython.bint,
        acting: cython.double[::1],
    ) -> cython.bint:
        """Return True if surfaces act on the TCP after a `share` of the tick."""
        j, before, tick = self.jacobian, self.before, self._tick_s
        p = cython.declare(cython.double[6])
        for i in range(3):
            p[i], p[3 + i] = place[i] + share * moved[i], moved[i] / tick
            for k in range(self.count):
                p[i] += j[i, k] * (x[k] - before[k])
                p[3 + i] += j[i, k] * v[k]
        return self._contact.acts_at(p[0], p[1], p[2], p[3], p[4], p[5], remember, acting)


@cython.cclass
class TcpSprings:
    """Joint positions over ticks while the TCP is compliant around a planned motion.

    Seven numbers are the deflection from the plan: translation (m) and rotation vector (rad) of the TCP in
    base axes, and the redundancy (rad) of a robot that has one. Each is a mass on a spring and a damper of
    its own, whose equilibrium moves with the plan.

    The closed-form inverse gives the joints, on the branch they are on. If the deflected pose is out of
    reach, or a joint would pass its `JointBounds`, the joints do not reach it. They make the motion within
    bounds that deviates least from the wanted one, weighted by mass. The arm stops as at a wall without
    elasticity, and slides along it. The springs then go on from the pose that it has reached.
    """

    tcp_contact: Any = cython.declare(object, visibility="readonly")
    _kinematics: Kinematics
    _bounds: JointBounds
    _pushes: Any
    _springs: Springs
    _reached: TcpState
    _tick_s: cython.double
    _weights: Any  # roots of the masses
    _joints: Any  # where the arm is (rad)
    _planned: Any  # where the plan is (rad)
    _at: cython.double[::1]  # of the plan: rotation of the TCP in the base, row by row, and its place (m)
    _redundancy: cython.double  # of the plan (rad)
    _tcp: cython.double[::1]  # of the arm: rotation and place, as of the plan,
    _place: cython.double[::1]  # which is the latter
    _moved: cython.double[::1]  # how far the plan goes in this tick (m)
    _x: cython.double[::1]  # of the springs
    _v: cython.double[::1]
    _forced: cython.bint  # whether a force besides surfaces is not 0
    _impedance: Any  # of the last tick

    def __init__(
        self, kinematics: Any, bounds: JointBounds, tick_s: float, pushes: Any, contact: Any
    ) -> None:
        """Take what pushes the robot besides surfaces, and the contact at its TCP, None for no surfaces."""
        self._kinematics, self._bounds, self._pushes = kinematics, bounds, pushes
        self._springs = springs = Springs(7, tick_s, contact)
        springs.stiffen(3, 6, INERTIA_KGM2, ROTATIONAL_STIFFNESS_NM_PER_RAD)
        springs.stiffen(6, 7, INERTIA_KGM2, REDUNDANCY_STIFFNESS_NM_PER_RAD)
        self._x, self._v = springs.x, springs.v
        self.tcp_contact: TcpState | None = None
        """Pose of the TCP after the last tick, and its contact there, if that is known."""
        self._reached = TcpState()
        self._tick_s = tick_s
        masses = [MASS_KG] * 3 + [INERTIA_KGM2] * 4
        self._weights = np.sqrt(np.array(masses[: kinematics.coordinates]))
        self._at, self._moved, self._tcp = np.zeros(12), np.zeros(3), self._reached.at
        self._place = self._tcp[9:]

    def start(self, joints: Joints, velocity: Sequence[float] = ()) -> None:
        """Begin on a plan that rests at joint positions (rad); the robot is there with a velocity (rad/s)."""
        self._joints = joints
        self._plan(joints)
        self._tcp[:] = self._at
        speeds = self._kinematics.tcp_and_jacobian(joints)[1] @ np.array(velocity) if any(velocity) else ()
        self._springs.start(self._at[9:], speeds)
        self.tcp_contact = None

    @property
    def on_plan(self) -> bool:
        """True if the robot is exactly where the plan says."""
        return bool(self._is_within(0.0))

    def step(self, nominal: Joints, impedance: CartesianImpedance) -> Joints:
        """Return the joint positions after a tick, at whose end the plan is at `nominal` (rad)."""
        at, x, v, springs = self._at, self._x, self._v, self._springs
        before = self._planned
        self.tcp_contact = None
        x0, y0, z0 = at[9], at[10], at[11]
        if nominal != before:
            self._plan(nominal)
        self._moved[0], self._moved[1], self._moved[2] = at[9] - x0, at[10] - y0, at[11] - z0
        self._find_forces(impedance)
        contact: cython.bint = springs.step(self._place, self._moved)
        if not (contact or self._forced) and self._is_within(0.0):
            self._tcp[:] = at
            self._joints = nominal
            return nominal
        if self._follow(before):
            self._reached.is_known = contact
            self._reached.acting[:] = springs.acting
            self.tcp_contact = self._reached
        else:
            for k in range(7):
                v[k] = (x[k] - springs.before[k]) / self._tick_s
        if not (self._forced or springs.touches) and self._is_within(_HOME):
            off = [abs(q - n) for q, n in zip(self._joints, nominal, strict=True)]
            if max(off) < _HOME:
                x[:] = 0.0
                v[:] = 0.0
                self._tcp[:] = at
                self._joints, self.tcp_contact = nominal, None
        joints: Joints = self._joints
        return joints

    @cython.cfunc
    def _plan(self, planned: Any) -> object:
        """Notice that the plan has reached joint positions (rad)."""
        self._planned = planned
        arm: Tcp = self._kinematics.arm
        arm.go_to(planned)
        self._at[:9], self._at[9:] = arm.turned, arm.place
        self._redundancy = arm._q[2] if self._kinematics.coordinates == 7 else 0.0
        return None

    @cython.cfunc
    @cython.exceptval(check=False)
    def _is_within(self, most: cython.double) -> cython.bint:
        """Return True if neither deflection nor its velocity is larger than this."""
        within: cython.bint = True
        for k in range(7):
            within = within and fabs(self._x[k]) <= most and fabs(self._v[k]) <= most
        return within

    @cython.cfunc
    def _find_forces(self, impedance: Any) -> object:
        """Find the forces besides springs and contact, in base axes; last, the torque on the redundancy."""
        f, r = self._springs.forces, self._tcp
        if impedance is not self._impedance:
            self._springs.stiffen(0, 3, MASS_KG, impedance.stiffness_n_per_m, LEAST_DAMPING_NS_PER_M)
            self._impedance = impedance
        w = cython.declare(cython.double[6])
        (push, joint_push), control = self._pushes(), impedance.control
        for k in range(6):
            w[k] = push[k]
            w[k] += control[k]
        for k in range(3):
            f[k] = r[3 * k] * w[0] + r[3 * k + 1] * w[1] + r[3 * k + 2] * w[2]
            f[3 + k] = r[3 * k] * w[3] + r[3 * k + 1] * w[4] + r[3 * k + 2] * w[5]
        f[6] = 0.0
        if any(joint_push):
            # The force that does the same work as the torques on the joints: J^T f = torque.
            _, jacobian = self._kinematics.tcp_and_jacobian(self._joints)
            weighted = self._weights[:, None] * jacobian
            inertia = weighted @ weighted.T + SINGULAR_INERTIA_KGM2 * np.eye(len(weighted))
            forces = self._weights * np.linalg.solve(inertia, weighted @ np.array(joint_push))
            np.asarray(f)[: len(forces)] += forces
        self._forced = False
        for k in range(7):
            self._forced = self._forced or f[k] != 0.0
            f[k] = min(max(f[k], -_LARGEST), _LARGEST)
        return None

    @cython.cfunc
    @cython.exceptval(-1)
    def _follow(self, before: Any) -> cython.bint:
        """Move the joints after the deflection from a plan that was at `before`; return whether they could.

        If they could not, the deflection becomes the one that they have reached.
        """
        x, r, at = self._x, self._tcp, self._at
        self._turn(x[3], x[4], x[5])
        for k in range(3):
            r[9 + k] = at[9 + k] + x[k]
        redundancy = self._redundancy + x[6]
        joints = self._kinematics.joints_for(r, r[9], r[10], r[11], redundancy, self._joints)
        if joints is not None and self._bounds.allow(self._joints, joints):
            self._joints = joints
            return True
        self._follow_within_bounds(before, redundancy)
        return False

    @cython.cfunc
    def _follow_within_bounds(self, before: Any, redundancy: float) -> object:
        """Move the joints as near to the wanted pose as they can go, and find the deflection there."""
        kinematics, bounds = self._kinematics, self._bounds
        planned, wanted = np.asarray(self._at).tolist(), np.asarray(self._tcp).tolist()
        carried = np.subtract(self._planned, before)
        guess = tuple((carried + np.array(self._joints)).tolist())
        pose, jacobian = kinematics.tcp_and_jacobian(guess)
        missing = [a - b for a, b in zip(wanted[9:], pose.translation, strict=True)]
        axis, angle = turn_between(pose.rotation, tuple(wanted[:9]))
        missing += [angle * each for each in axis]
        missing.append(redundancy - kinematics.redundancy(guess))
        least, greatest = bounds.ranges(self._joints)
        motion = least_deviation(
            self._weights[:, None] * jacobian,
            self._weights * np.array(missing[: kinematics.coordinates]),
            SINGULAR_INERTIA_KGM2,
            least - carried,
            greatest - carried,
        )
        self._joints = bounds.within(tuple([g + m for g, m in zip(guess, motion, strict=True)]))
        rotation, place = kinematics.arm.pose(self._joints)
        axis, angle = turn_between(tuple(planned[:9]), rotation)
        x = self._x
        for k in range(3):
            x[k], x[3 + k] = place[k] - planned[9 + k], angle * axis[k]
        x[6] = kinematics.redundancy(self._joints) - self._redundancy
        np.asarray(self._tcp)[:] = (*rotation, *place)
        return None

    @cython.cfunc
    @cython.exceptval(check=False)
    def _turn(self, a: cython.double, b: cython.double, c: cython.double) -> cython.void:
        """Turn the plan's rotation by a rotation vector (rad) in base axes."""
        r, p = self._tcp, self._at
        angle: cython.double = sqrt(a * a + b * b + c * c)
        if angle == 0.0:
            r[:9] = p[:9]
            return
        x, y, z = a / angle, b / angle, c / angle
        cosine, sine, half = cos(angle), sin(angle), sin(0.5 * angle)
        share = 2.0 * half * half  # 1 - cos(angle) without losing digits at small angles
        for k in range(3):
            u, v, w = p[k], p[3 + k], p[6 + k]
            along = share * (x * u + y * v + z * w)
            r[k] = cosine * u + sine * (y * w - z * v) + along * x
            r[3 + k] = cosine * v + sine * (z * u - x * w) + along * y
            r[6 + k] = cosine * w + sine * (x * v - y * u) + along * z


@cython.cclass
class JointSprings:
    """Gravity hold: every joint a damped mass on a spring around where the hold began.

    At rest each joint is off by torque over stiffness. Contact and pushes act through the transposed
    Jacobian. A joint that would pass `JointBounds` stays on them, and loses the velocity it cannot have.
    Within a tick the TCP goes straight as the joints turn: by a hundredth of a radian at most.
    """

    centre: Any = cython.declare(object, visibility="readonly")
    _tcp: Tcp
    _bounds: JointBounds
    _tick_s: cython.double
    _pushes: Any
    _springs: Springs
    _stands: cython.double[::1]  # the plan does not move
    _joints: Any

    def __init__(
        self, kinematics: Any, bounds: JointBounds, tick_s: float, pushes: Any, contact: Any
    ) -> None:
        """Take what pushes the robot besides surfaces, and the contact at its TCP, None for no surfaces."""
        self._tcp, self._bounds, self._pushes = kinematics.arm, bounds, pushes
        self._springs = Springs(kinematics.joint_count, tick_s, contact)
        self._springs.jacobian = self._tcp.columns
        self._tick_s = tick_s
        self._stands = np.zeros(3)

    def start(self, joints: Joints, velocity: Sequence[float], stiffness_nm_per_rad: float) -> None:
        """Hold these joint positions (rad), coming from a velocity (rad/s)."""
        springs = self._springs
        springs.stiffen(0, springs.count, JOINT_INERTIA_KGM2, stiffness_nm_per_rad, LEAST_DAMPING_NMS_PER_RAD)
        self.centre = self._joints = joints
        """Joint positions at the start of the hold (rad)."""
        self._tcp.go_to(joints)
        springs.start(self._tcp.place, velocity)

    def step(self) -> Joints:
        """Return the joint positions (rad) after a tick."""
        springs, tcp, joints = self._springs, self._tcp, self._joints
        wrench, push = self._pushes()
        tcp.find_torques(joints, wrench)
        torque: cython.double
        for k in range(springs.count):
            torque = push[k]
            springs.forces[k] = min(max(torque + tcp.torque[k], -_LARGEST), _LARGEST)
        springs.step(tcp.place, self._stands)
        x, v = springs.x, springs.v
        after = self._turned()
        if not self._bounds.allow(joints, after):
            least, greatest = self._bounds.ranges(joints)
            for k in range(springs.count):
                wanted = x[k] - springs.before[k]
                motion = min(max(wanted, least[k]), greatest[k])
                if motion != wanted:
                    x[k], v[k] = springs.before[k] + motion, motion / self._tick_s
            after = self._bounds.within(self._turned())
        self._joints = after
        turned: Joints = after
        return turned

    @cython.cfunc
    def _turned(self) -> Any:
        """Return the joints after the tick (rad)."""
        return tuple([self.centre[k] + self._springs.x[k] for k in range(self._springs.count)])

"""Compliance of the TCP: a damped mass on springs around a planned motion, as far as the joints can follow.

**What yields.** Seven numbers say how far the robot is off the planned motion: the TCP's translation in the
base (m), its rotation (a rotation vector in base axes, rad), and, for a robot with redundancy, the
redundancy (rad). Each is a mass on a spring and a damper of its own, whose equilibrium moves with the plan;
so without force the robot is where the plan says, exactly. Forces are pushes, the control wrench and what
surfaces do.

**Steps.** Springs and dampers are moved on exactly (`spring.py`) at any tick rate, with contact in parts of a
tick (`shift.py`).

**Joints.** The closed-form inverse gives them, on the branch they are on. Where it does not reach what the
springs want, or a joint would pass its `JointBounds`, they do of all motions within these the one with the
least mass-weighted deviation from it (Gauss's principle of least constraint), and the springs go on from
where the robot has really come to. So at a limit, and beyond the arm's reach, it is stopped as by a soft
wall that gives nothing back, and slides along it. At singular poses the joints' own inertia keeps it from
infinite speeds.
"""

from collections.abc import Sequence
from math import hypot
from typing import NamedTuple

import numpy as np

from iiwa_sim.frames import (
    IDENTITY,
    Rotation,
    Transform,
    Vector,
    multiply,
    rotate,
    rotation_about,
    rotation_vector,
    transpose,
)
from iiwa_sim.motion.joint_bounds import JointBounds
from iiwa_sim.motion.least_constraint import least_deviation
from iiwa_sim.motion.sampled_path import Joints
from iiwa_sim.motion.shift import MASS_KG, Shift
from iiwa_sim.motion.spring import Spring, damping
from iiwa_sim.motion.surroundings import Feel, Felt, Pushes
from iiwa_sim.robot.kinematics import Kinematics

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
LARGEST_FORCE = 1e6
"""N or Nm: anything more is felt as this."""
LARGEST_TURN_RAD = 2.5
"""So far the TCP may be turned off the plan: at half a turn a rotation vector would jump."""
HOME = 1e-9
"""Off the plan by less (m, rad), and hardly moving, the robot is put on it."""


Deflection = tuple[float, float, float, float, float, float, float]
"""Translation (m) and rotation vector (rad) in base axes, redundancy (rad); also its velocity, and forces."""
NONE: Deflection = (0.0,) * 7


class Manner(NamedTuple):
    """How the TCP yields."""

    stiffness_n_per_m: float
    """In translation, the same in all directions."""
    control: tuple[float, float, float, float, float, float]
    """Force (N) and torque (Nm) that the controller adds, along the axes of the TCP, acting on the robot."""


class Compliance:
    """Joint positions over ticks around planned ones."""

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
        self.felt: Felt | None = None
        """Where the TCP has come to in the last tick, and what it touches there, where that is known."""
        self._in_contact = False
        self._shift = Shift(tick_s, feel)
        masses = [MASS_KG] * 3 + [INERTIA_KGM2] * 3 + [REDUNDANCY_INERTIA_KGM2]
        self._weights = np.sqrt(np.array(masses[: kinematics.coordinates]))
        turn, swivel = ROTATIONAL_STIFFNESS_NM_PER_RAD, REDUNDANCY_STIFFNESS_NM_PER_RAD
        self._turning = Spring(INERTIA_KGM2, turn, damping(INERTIA_KGM2, turn), tick_s)
        self._swivelling = Spring(
            REDUNDANCY_INERTIA_KGM2, swivel, damping(REDUNDANCY_INERTIA_KGM2, swivel), tick_s
        )

    def start(self, joints: Joints, velocity: Sequence[float] | None = None) -> None:
        """On a plan that rests at joint positions (rad); the robot is there, too, with a velocity (rad/s)."""
        self._joints = self._nominal = joints
        self._nominal_tcp = self._kinematics.tcp(joints)
        self._rotation = self._nominal_tcp.rotation
        self._x, self._v = NONE, NONE
        if velocity is not None and any(velocity):
            _, jacobian = self._kinematics.tcp_and_jacobian(joints)
            self._v = _seven((jacobian @ np.array(velocity)).tolist())
        self._shift.start(self._nominal_tcp.translation)
        self.felt = None

    @property
    def on_plan(self) -> bool:
        """Whether the robot is exactly where the plan says."""
        return self._x == NONE == self._v

    def step(self, nominal: Joints, manner: Manner) -> Joints:
        """A tick, in which the plan has come to `nominal` (rad)."""
        self.felt = None
        before, was = self._nominal, self._nominal_tcp.translation
        if nominal != before:
            self._nominal, self._nominal_tcp = nominal, self._kinematics.tcp(nominal)
        x, y, z = self._nominal_tcp.translation
        moved = (x - was[0], y - was[1], z - was[2])
        forces = self._forces(manner)
        if self._on_plan_without(forces, moved):
            self._joints, self._rotation = nominal, self._nominal_tcp.rotation
            return nominal
        start = self._x
        self._swing(manner.stiffness_n_per_m, forces, was, moved)
        self._follow(before, start)
        if self._is_home(forces):
            self._joints, self._x, self._v, self.felt = nominal, NONE, NONE, None
        return self._joints

    def _forces(self, manner: Manner) -> Deflection:
        """What acts besides springs and contact, in base axes; the last is the torque on the redundancy."""
        wrench, control, joint_push = self._pushes.wrench, manner.control, self._pushes.joint_push
        forces = NONE
        pushed = any(wrench)
        if pushed or any(control):
            acting = [a + b for a, b in zip(wrench, control, strict=True)] if pushed else control
            fx, fy, fz, tx, ty, tz = acting
            force, torque = rotate(self._rotation, (fx, fy, fz)), rotate(self._rotation, (tx, ty, tz))
            forces = (*force, *torque, 0.0)
        if any(joint_push):
            # What at the TCP and on the redundancy takes the same work: J^T f = torque.
            _, jacobian = self._kinematics.tcp_and_jacobian(self._joints)
            weighted = self._weights[:, None] * jacobian
            inertia = weighted @ weighted.T + JOINT_INERTIA_KGM2 * np.eye(len(weighted))
            made = self._weights * np.linalg.solve(inertia, weighted @ np.array(joint_push))
            forces = _seven([a + b for a, b in zip(forces, made.tolist(), strict=False)])
        elif forces is NONE:
            return NONE
        if max(forces) > LARGEST_FORCE or min(forces) < -LARGEST_FORCE:
            return _seven([min(max(f, -LARGEST_FORCE), LARGEST_FORCE) for f in forces])
        return forces

    def _on_plan_without(self, forces: Deflection, moved: Vector) -> bool:
        """Whether the robot is on the plan and nothing takes it off."""
        if forces != NONE or not self.on_plan or self._shift.touches:
            return False
        return not self._shift.meets(self._nominal_tcp.translation, moved)

    def _swing(self, stiffness: float, forces: Deflection, was: Vector, moved: Vector) -> None:
        """Move the deflection on by a tick, for the time being without regard to joints."""
        fx, fy, fz, tx, ty, tz, t = forces
        x, y, z, a, b, c, r = self._x
        vx, vy, vz, va, vb, vc, vr = self._v
        shift, velocity, torque = self._shift.step(
            stiffness, (x, y, z), (vx, vy, vz), (fx, fy, fz), was, moved
        )
        self._in_contact = torque is not None
        if torque is not None:
            ux, uy, uz = torque
            tx, ty, tz = tx + ux, ty + uy, tz + uz
        xx, xv, xf, v_x, vv, vf = self._turning.coefficients
        a, va = xx * a + xv * va + xf * tx, v_x * a + vv * va + vf * tx
        b, vb = xx * b + xv * vb + xf * ty, v_x * b + vv * vb + vf * ty
        c, vc = xx * c + xv * vc + xf * tz, v_x * c + vv * vc + vf * tz
        if a * a + b * b + c * c > LARGEST_TURN_RAD * LARGEST_TURN_RAD:
            share = LARGEST_TURN_RAD / hypot(a, b, c)
            a, b, c, va, vb, vc = share * a, share * b, share * c, 0.0, 0.0, 0.0
        if r or vr or t:
            r, vr = self._swivelling.step(r, vr, t)
        self._x, self._v = (*shift, a, b, c, r), (*velocity, va, vb, vc, vr)

    def _follow(self, before: Joints, start: Deflection) -> None:
        """Move the joints after the deflection, and keep of it what they can do.

        `before` are the planned joints of the tick before, `start` the deflection then.
        """
        x, y, z, a, b, c, r = self._x
        nominal = self._nominal_tcp
        px, py, pz = nominal.translation
        self._rotation = multiply(_turned((a, b, c)), nominal.rotation) if a or b or c else nominal.rotation
        wanted = Transform(self._rotation, (px + x, py + y, pz + z))
        redundancy = self._kinematics.redundancy(self._nominal) + r
        joints = self._kinematics.joints(wanted, redundancy, self._joints)
        if joints is not None and self._bounds.allow(self._joints, joints):
            self._joints = joints
            self.felt = (wanted, self._shift.touch if self._in_contact else None)
            return
        self._follow_within_bounds(before, wanted, redundancy)
        self._x = self._off_plan()
        self._v = _seven([(a - b) / self._tick_s for a, b in zip(self._x, start, strict=True)])

    def _follow_within_bounds(self, before: Joints, wanted: Transform, redundancy: float) -> None:
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

    def _off_plan(self) -> Deflection:
        """How far the robot is off the plan."""
        nominal, kinematics = self._nominal_tcp, self._kinematics
        pose = kinematics.tcp(self._joints)
        self._rotation = pose.rotation
        (x, y, z), (px, py, pz) = pose.translation, nominal.translation
        turn = _log(multiply(pose.rotation, transpose(nominal.rotation)))
        swivel = kinematics.redundancy(self._joints) - kinematics.redundancy(self._nominal)
        return (x - px, y - py, z - pz, *turn, swivel)

    def _is_home(self, forces: Deflection) -> bool:
        """Whether the robot is as good as on the plan, at rest relative to it, and nothing takes it off."""
        return (
            forces == NONE
            and not self._shift.touches
            and max(map(abs, self._x)) < HOME
            and max(map(abs, self._v)) < HOME
            and all(abs(q - n) < HOME for q, n in zip(self._joints, self._nominal, strict=True))
        )


def _seven(values: list[float]) -> Deflection:
    """Without redundancy, nothing acts on it."""
    x, y, z, a, b, c, *r = values
    return (x, y, z, a, b, c, r[0] if r else 0.0)


def _log(rotation: Rotation) -> Vector:
    """The rotation vector (rad)."""
    (x, y, z), angle = rotation_vector(rotation)
    return (x * angle, y * angle, z * angle)


def _turned(vector: Sequence[float]) -> Rotation:
    """The rotation by a rotation vector (rad)."""
    x, y, z = vector
    angle = hypot(x, y, z)
    if angle == 0.0:
        return IDENTITY.rotation
    return rotation_about((x / angle, y / angle, z / angle), angle)

"""Gravity hold: every joint a damped mass on a spring around where the hold began."""

from math import ceil
from operator import add

import numpy as np

from iiwa_sim.frames import rotate
from iiwa_sim.motion.joint_bounds import JointBounds
from iiwa_sim.motion.sampled_path import Joints
from iiwa_sim.motion.spring import Spring, damping
from iiwa_sim.motion.surroundings import LONGEST_SUBSTEP_S, NOTHING, Feel, Pushes
from iiwa_sim.robot.kinematics import Kinematics

INERTIA_KGM2 = 0.5
"""Apparent moment of inertia of each joint. Our decision."""
LEAST_DAMPING_NMS_PER_RAD = 5.0
"""Our decision: without a spring 6 Nm, 10 N at 0.6 m, turn a joint at 1.2 rad/s, as when guided by hand.
Below 25.5 Nm/rad the damping ratio is above 0.7."""
LARGEST_TORQUE_NM = 1e6
"""Anything more is felt as this."""


class JointSprings:
    """Joint positions over ticks: torque over stiffness away from where the hold began, once all is at rest.

    Contact and pushes act through the transposed Jacobian. A joint that would pass `JointBounds` stays on
    them, and loses the velocity it cannot have.
    """

    def __init__(
        self, kinematics: Kinematics, bounds: JointBounds, tick_s: float, pushes: Pushes, feel: Feel | None
    ) -> None:
        """`feel` is None where there is nothing to touch."""
        self._kinematics = kinematics
        self._bounds = bounds
        self._tick_s = tick_s
        self._pushes = pushes
        self._feel = feel
        self._substeps = ceil(tick_s / LONGEST_SUBSTEP_S - 1e-9)

    def start(self, joints: Joints, velocity: list[float], stiffness_nm_per_rad: float) -> None:
        """Hold these joint positions (rad), coming from a velocity (rad/s)."""
        damped = damping(INERTIA_KGM2, stiffness_nm_per_rad, LEAST_DAMPING_NMS_PER_RAD)
        count, part_s = self._substeps, self._tick_s / self._substeps
        # Over no, one, two ... all substeps of a tick.
        springs = [
            Spring(INERTIA_KGM2, stiffness_nm_per_rad, damped, part_s * parts) for parts in range(count + 1)
        ]
        self._spring, self._spring_in_contact = springs[-1], springs[1]
        xx, xv, xf, vx, vv, vf = self._spring.coefficients
        self._tick_matrix = np.array([[xx, xv, xf], [vx, vv, vf]])
        # What has become of a kick at the end of the tick: one half at its ends, whole between substeps.
        halves = [1.0, *[2.0] * (count - 1), 1.0]
        became = [spring.coefficients for spring in reversed(springs)]
        rows = [[half * each[k] for half, each in zip(halves, became, strict=True)] for k in (1, 4)]
        self._half_kick = 0.5 * part_s / INERTIA_KGM2
        self._become = self._half_kick * np.array(rows)
        self._no_torques = [0.0] * len(joints)
        self.centre = self._joints = joints
        """Where the hold began (rad)."""
        self._x, self._v = [0.0] * len(joints), velocity
        self._touch = NOTHING
        if self._feel is not None:
            self._touch = self._feel(self._kinematics.tcp(joints).translation, NOTHING[0], 0.0)

    def step(self) -> Joints:
        """A tick."""
        start, joints = self._x, self._joints
        torques = self._torques()
        self._x, self._v = self._alone(torques) or self._in_contact(torques)
        after = tuple(map(add, self.centre, self._x))
        if not self._bounds.allow(joints, after):
            ways = zip(*self._bounds.ways(joints), strict=True)
            for k, (least, greatest) in enumerate(ways):
                way = min(max(self._x[k] - start[k], least), greatest)
                if way != self._x[k] - start[k]:
                    self._x[k], self._v[k] = start[k] + way, way / self._tick_s
            after = tuple(map(add, self.centre, self._x))
        self._joints = self._bounds.within(after)
        if self._touch != NOTHING:
            self._kinematics.tcp_and_its_jacobian(self._joints)  # for the pose, which is asked for before
        return self._joints

    def _torques(self) -> list[float] | None:
        """Of the pushes (Nm), on each joint; None where there are none."""
        wrench, push = self._pushes.wrench, self._pushes.joint_push
        if any(wrench):
            fx, fy, fz, tx, ty, tz = wrench
            (rotation, _), jacobian = self._kinematics.tcp_and_its_jacobian(self._joints)
            force, torque = rotate(rotation, (fx, fy, fz)), rotate(rotation, (tx, ty, tz))
            made = jacobian.T.dot(np.array((*force, *torque))).tolist()
            torques = list(map(add, push, made))
        elif any(push):
            torques = list(push)
        else:
            return None
        if max(torques) > LARGEST_TORQUE_NM or min(torques) < -LARGEST_TORQUE_NM:
            return [min(max(t, -LARGEST_TORQUE_NM), LARGEST_TORQUE_NM) for t in torques]
        return torques

    def _alone(self, torques: list[float] | None) -> tuple[list[float], list[float]] | None:
        """Deflection and its velocity after a tick; None where the TCP touches something before or then."""
        if self._touch != NOTHING:
            return None
        xx, xv, xf, vx, vv, vf = self._spring.coefficients
        if torques is None:
            x = [xx * a + xv * b for a, b in zip(self._x, self._v, strict=True)]
            v = [vx * a + vv * b for a, b in zip(self._x, self._v, strict=True)]
        else:
            state = list(zip(self._x, self._v, torques, strict=True))
            x = [xx * a + xv * b + xf * f for a, b, f in state]
            v = [vx * a + vv * b + vf * f for a, b, f in state]
        if self._feel is not None:
            place = self._kinematics.tcp(tuple(map(add, self.centre, x))).translation
            if self._feel(place, NOTHING[0], 0.0) != NOTHING:
                return None
        return x, v

    def _in_contact(self, torques: list[float] | None) -> tuple[list[float], list[float]]:
        """Deflection and its velocity after a tick.

        Within a tick the TCP goes straight on: joints turn by a hundredth of a radian at most. One and the
        same spring is on every joint, so its matrix moves the TCP on, too, and substeps need no more than
        that. The joints then take one step of the whole tick, and what became of all kicks.
        """
        feel = self._feel
        assert feel is not None
        (_, (px, py, pz)), jacobian = self._kinematics.tcp_and_its_jacobian(self._joints)
        state = np.array((self._x, self._v, self._no_torques if torques is None else torques))
        to_place = jacobian[:3].T
        (sx, sy, sz), (vx, vy, vz), (fx, fy, fz) = state.dot(to_place).tolist()
        # What surfaces do, times this, is the half kick of the TCP.
        kicks = (self._half_kick * jacobian).dot(to_place).tolist()
        (ax, ay, az), (bx, by, bz), (cx, cy, cz), (dx, dy, dz), (ex, ey, ez), (gx, gy, gz) = kicks
        part_s = self._tick_s / self._substeps
        xx, xv, xf, v_x, vv, vf = self._spring_in_contact.coefficients
        x, y, z = sx, sy, sz
        px, py, pz = px - sx, py - sy, pz - sz
        touch = self._touch
        (o, p, q), (r, s, t) = touch
        touches = [(o, p, q, r, s, t)]
        kx = ax * o + bx * p + cx * q + dx * r + ex * s + gx * t
        ky = ay * o + by * p + cy * q + dy * r + ey * s + gy * t
        kz = az * o + bz * p + cz * q + dz * r + ez * s + gz * t
        for _ in range(self._substeps):
            vx, vy, vz = vx + kx, vy + ky, vz + kz
            x, vx = xx * x + xv * vx + xf * fx, v_x * x + vv * vx + vf * fx
            y, vy = xx * y + xv * vy + xf * fy, v_x * y + vv * vy + vf * fy
            z, vz = xx * z + xv * vz + xf * fz, v_x * z + vv * vz + vf * fz
            touch = feel((px + x, py + y, pz + z), (vx + kx, vy + ky, vz + kz), part_s)
            (o, p, q), (r, s, t) = touch
            touches.append((o, p, q, r, s, t))
            kx = ax * o + bx * p + cx * q + dx * r + ex * s + gx * t
            ky = ay * o + by * p + cy * q + dy * r + ey * s + gy * t
            kz = az * o + bz * p + cz * q + dz * r + ez * s + gz * t
            vx, vy, vz = vx + kx, vy + ky, vz + kz
        self._touch = touch
        after = self._tick_matrix.dot(state) + self._become.dot(np.array(touches)).dot(jacobian)
        x_after, v_after = after.tolist()
        return x_after, v_after

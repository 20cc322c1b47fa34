"""Gravity hold: every joint a damped mass on a spring around where the hold began."""

from math import ceil

import numpy as np

from iiwa_sim.frames import rotate
from iiwa_sim.motion.joint_bounds import JointBounds
from iiwa_sim.motion.path import Joints
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
        self._spring, self._spring_in_contact = (
            Spring(INERTIA_KGM2, stiffness_nm_per_rad, damped, self._tick_s / parts)
            for parts in (1, self._substeps)
        )
        self.centre = self._joints = joints
        """Where the hold began (rad)."""
        self._x, self._v = [0.0] * len(joints), velocity
        self._touch = NOTHING
        if self._feel is not None:
            self._touch = self._feel(self._kinematics.tcp(joints).translation, NOTHING[0], 0.0)

    def step(self) -> Joints:
        """A tick."""
        start, joints = self._x, self._joints
        if any(self._pushes.wrench) or self._touches():
            self._tcp, self._jacobian = self._kinematics.tcp_and_jacobian(joints)
        torques = self._torques()
        self._x, self._v = self._alone(torques) or self._in_contact(torques)
        after = tuple([c + x for c, x in zip(self.centre, self._x, strict=True)])
        if not self._bounds.allow(joints, after):
            ways = zip(*self._bounds.ways(joints), strict=True)
            for k, (least, greatest) in enumerate(ways):
                way = min(max(self._x[k] - start[k], least), greatest)
                if way != self._x[k] - start[k]:
                    self._x[k], self._v[k] = start[k] + way, way / self._tick_s
            after = tuple([c + x for c, x in zip(self.centre, self._x, strict=True)])
        self._joints = self._bounds.within(after)
        return self._joints

    def _torques(self) -> list[float]:
        """Of the pushes (Nm), on each joint."""
        wrench, torques = self._pushes.wrench, list(self._pushes.joint_push)
        if any(wrench):
            fx, fy, fz, tx, ty, tz = wrench
            rotation = self._tcp.rotation
            force, torque = rotate(rotation, (fx, fy, fz)), rotate(rotation, (tx, ty, tz))
            made = self._jacobian[:6].T @ np.array([*force, *torque])
            torques = [a + b for a, b in zip(torques, made.tolist(), strict=True)]
        return [min(max(t, -LARGEST_TORQUE_NM), LARGEST_TORQUE_NM) for t in torques]

    def _alone(self, torques: list[float]) -> tuple[list[float], list[float]] | None:
        """Deflection and its velocity after a tick; None where the TCP touches something before or then."""
        if self._touches():
            return None
        steps = [self._spring.step(*each) for each in zip(self._x, self._v, torques, strict=True)]
        x, v = [x for x, _ in steps], [v for _, v in steps]
        if self._feel is not None:
            pose = self._kinematics.tcp([c + d for c, d in zip(self.centre, x, strict=True)])
            force, torque = self._feel(pose.translation, NOTHING[0], 0.0)
            if any(force) or any(torque):
                self._tcp, self._jacobian = self._kinematics.tcp_and_jacobian(self._joints)
                return None
        return x, v

    def _touches(self) -> bool:
        return any(self._touch[0]) or any(self._touch[1])

    def _in_contact(self, torques: list[float]) -> tuple[list[float], list[float]]:
        """Deflection and its velocity after a tick."""
        feel = self._feel
        assert feel is not None
        # Within a tick the TCP goes straight on: joints turn by a hundredth of a radian at most.
        to_place = self._jacobian[:3]
        part_s = self._tick_s / self._substeps
        kick = 0.5 * part_s / INERTIA_KGM2 * self._jacobian[:6].T
        step, pushed = self._spring_in_contact.step, np.array(torques)
        x, v = np.array(self._x), np.array(self._v)
        start, (px, py, pz), touch = x, self._tcp.translation, self._touch
        kicked = kick @ np.array([*touch[0], *touch[1]])
        for _ in range(self._substeps):
            x, v = step(x, v + kicked, pushed)
            dx, dy, dz = (to_place @ (x - start)).tolist()
            vx, vy, vz = (to_place @ (v + kicked)).tolist()
            touch = feel((px + dx, py + dy, pz + dz), (vx, vy, vz), part_s)
            kicked = kick @ np.array([*touch[0], *touch[1]])
            v = v + kicked
        self._touch = touch
        return x.tolist(), v.tolist()

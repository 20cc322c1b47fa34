"""Moves the TCP at a velocity, as long as it is told again and again: what MoveIt Servo does for other arms.

Each twist becomes a target of the robot's servo a little ahead of it, with speeds in the same proportion. So
the robot's own limits hold, and when nothing more is told it comes to rest at the last target.
"""

from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.controller.targets import DIRECT_REACH_RAD
from iiwa_sim.robot.model import Model
from iiwa_sim.ros.arm.arm import Arm
from iiwa_sim.ros.arm.messages import ns_of

RATE_HZ = 50
"""Targets in a second of simulated time."""
STALE_NS = 100_000_000
"""A twist that is older moves nothing. MoveIt Servo's default."""
AHEAD_S = 0.16
"""How far ahead targets are: more than a target's time and the braking, so that the robot does not brake."""
FASTEST_RAD_S = 0.98 * DIRECT_REACH_RAD / AHEAD_S
"""A joint that had to be faster would have its target out of reach."""
SLOWEST_REL = 1e-3
"""The least part of a joint's speed: a joint that stays has to have one, too."""
LEAST_RAD_S = 1e-6


class TwistServo:
    """Follows the newest twist of one robot."""

    def __init__(self, arm: Arm, base: str, tool: str) -> None:
        """`base` and `tool` are the names of the frames in which a twist may be told."""
        self._arm = arm
        self._frames = {"": False, base: False, tool: True}
        self._base, self._tool = base, tool
        self._model = Model(arm.description)
        self._velocity = np.array(arm.description.velocity)
        self._lowest = np.array(arm.description.position_min)
        self._highest = np.array(arm.description.position_max)
        self._told: Any = None  # geometry_msgs/TwistStamped
        self._told_ns = 0

    @property
    def active(self) -> bool:
        """Whether a twist is followed."""
        return self._told is not None

    def take(self, told: Any, now_ns: int) -> None:
        """Follow a TwistStamped (m/s, rad/s), told at the time of its stamp, or now. Raises `Refused`."""
        if told.header.frame_id not in self._frames:
            there = f"{self._base} or {self._tool}"
            raise Refused(EXECUTION, f"frame_id {told.header.frame_id!r:.100}: expected {there}")
        if not all(map(isfinite, _numbers(told))):
            raise Refused(EXECUTION, "a twist that is not finite")
        stamp_ns = ns_of(told.header.stamp) or now_ns
        old_ns = now_ns - stamp_ns
        if abs(old_ns) > STALE_NS:
            place = f"{1e-9 * old_ns:g} s old" if old_ns > 0 else f"{-1e-9 * old_ns:g} s in the future"
            raise Refused(EXECUTION, f"the stamp is {place}: expected up to 0.1 s")
        self._told, self._told_ns = told, stamp_ns

    def step(self, now_ns: int) -> None:
        """Head for the next target, if a twist is followed. Raises `Refused`, and follows it no more."""
        told, joints = self._told, self._arm.joints
        if told is None or joints is None:
            return
        if not 0 <= now_ns - self._told_ns <= STALE_NS:
            self._told = None
            return
        velocity = self._joint_velocity(told, joints)
        if np.abs(velocity).max() < LEAST_RAD_S:
            return  # the robot rests at the last target
        try:
            target = np.clip(np.array(joints) + AHEAD_S * velocity, self._lowest, self._highest)
            speeds = np.maximum(np.abs(velocity) / self._velocity, SLOWEST_REL)
            self._arm.head_for(target.tolist(), speeds.tolist())
        except Refused:
            self._told = None
            raise

    def _joint_velocity(self, told: Any, joints: tuple[float, ...]) -> NDArray[np.float64]:
        """Joint velocities (rad/s) for the twist, all slower by one factor where one has to be slower.

        So the TCP keeps its direction; where it would go through a singular pose, or a joint to its limit, it
        comes to rest.
        """
        tcp = self._model.tcp(self._arm.tool_in_flange or self._arm.description.tool_in_flange)
        twist = np.array(_numbers(told))
        if self._frames[told.header.frame_id]:
            turn = np.array(tcp.pose(joints).rotation).reshape(3, 3)
            twist = np.concatenate([turn @ twist[:3], turn @ twist[3:]])
        velocity: NDArray[np.float64] = np.linalg.pinv(tcp.jacobian(joints)) @ twist
        room = np.where(velocity > 0.0, self._highest - joints, np.subtract(joints, self._lowest))
        bound = np.minimum(np.minimum(self._velocity, FASTEST_RAD_S), np.maximum(room, 0.0) / AHEAD_S)
        with np.errstate(divide="ignore", invalid="ignore"):
            parts = np.where(np.abs(velocity) > LEAST_RAD_S, bound / np.abs(velocity), 1.0)
        return velocity * min(1.0, float(parts.min()))


def _numbers(told: Any) -> tuple[float, ...]:
    linear, angular = told.twist.linear, told.twist.angular
    return (linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)

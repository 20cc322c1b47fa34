"""The planner turns a request into a path and its limits, or rejects it with a reason."""

from collections.abc import Sequence
from math import degrees, isfinite
from typing import NamedTuple

import numpy as np

from iiwa_sim.controller.acceleration import AccelerationCap, AccelerationUnit, capped_joints, capped_line
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.controller.lin_planner import ROUNDING_RAD, LinPlanner
from iiwa_sim.controller.requests import Kind, MoveRequest, RelativeTarget
from iiwa_sim.frames import Frame, Transform
from iiwa_sim.motion.blend import Zone, joint_ball, sphere
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import STANDSTILL_RAD, JointLimits
from iiwa_sim.motion.path import least_time_per_s, least_time_s, ptp, travel
from iiwa_sim.motion.plan_kernel import Polynomial
from iiwa_sim.robot.arm_kernel import Tcp
from iiwa_sim.robot.inverse import Inverse
from iiwa_sim.robot.model import Model
from iiwa_sim.robot.nearest import JOINT_LIMIT, OUT_OF_REACH, Nearest, Unreachable, how_far
from iiwa_sim.wording import distinct

LEAST_SPEED_REL = 1e-6
"""Speeds below that are refused: a joint at less than a revolution in a week stands still for any client."""
NEAR_RAD = 1e-3
"""A joint this close to its target accepts any speed: drivers send 0 for a joint that stays."""
LONGEST_MOVE_S = 86400.0
"""A move that would take longer is refused: its speed is a mistake."""
SAME_M = 1e-7
"""A line that is shorter only turns."""
SAME_TURN_RAD = 1e-5
"""A line without a way whose joints go less than this is there: 32 bits round a pose by as much."""
FARTHEST_MM = 1e6
"""A target farther away is refused unseen: its squares and products might be too large for floats."""


class Plan(NamedTuple):
    """How a move goes: all of a `Move` but its number."""

    path: Polynomial
    limits: JointLimits
    length_s: float
    zone: Zone | None


class Planner:
    """Plans moves of one robot. Each method raises `Refused` where the move cannot be done as asked for."""

    def __init__(self, model: Model) -> None:
        description = model.description
        self._description = description
        self._model = model
        self._inverse = Inverse(model)
        self._nearest = Nearest(self._inverse, description)
        self.limits = JointLimits(
            np.array(description.velocity), np.array(description.acceleration), np.array(description.jerk)
        )
        """Limits of the joints in planned motion at full speed."""
        self._lin = LinPlanner(model, self._inverse, self._nearest)

    def plan(self, request: MoveRequest, start: Joints, tcp: Tcp) -> Plan:
        """PTP or LIN as it is asked for, from joint positions (rad), with this TCP."""
        try:
            plan = self._uncapped(request, start, tcp)
        except Refused as refused:
            if request.shift is None or refused.code != OUT_OF_REACH:
                raise
            raise Refused(OUT_OF_REACH, f"{refused.reason}; asked for {_in_words(request.shift)}") from None
        return _capped(plan, request.acceleration)

    def _uncapped(self, request: MoveRequest, start: Joints, tcp: Tcp) -> Plan:
        target = request.target
        if not isinstance(target, Frame):
            if request.kind is Kind.LIN:
                return self._lin_to_joints(request, start, target, tcp)
            return self._ptp_to_joints(request, start, target)
        tcp_speed_m_s = request.tcp_speed_m_s
        if tcp_speed_m_s is not None and not (isfinite(tcp_speed_m_s) and tcp_speed_m_s > 0.0):
            raise Refused(EXECUTION, f"speed {tcp_speed_m_s:g} m/s: expected above 0")
        flange = tcp.flange_at(_checked_pose(target, request.speed, request.redundancy))
        try:
            if request.kind is Kind.PTP:
                path = ptp(start, self._nearest.find(flange, start, request.redundancy).joints)
            else:
                path = self._lin.to_pose(start, flange, request.redundancy, tcp.tool_in_flange)
        except Unreachable as unreachable:
            raise self._refusal(unreachable, "TCP", target, flange) from None
        speed_rel = request.speed if tcp_speed_m_s is None else self._speed_rel(path, tcp_speed_m_s)
        return self._plan(path, speed_rel, _sphere(path.end, request.blending, tcp))

    def _ptp_to_joints(self, request: MoveRequest, start: Joints, target: Sequence[float]) -> Plan:
        """Plan PTP to joint positions (rad), at a relative speed of each joint."""
        end, speeds = self.joint_target(start, target, request.speeds)
        if not 0.0 <= request.blending <= 1.0:
            raise Refused(EXECUTION, f"blending over {request.blending:g} of the way: expected 0 to 1")
        zone = joint_ball(request.blending, start, end) if request.blending else None
        return self._plan(ptp(start, end), speeds, zone)

    def _lin_to_joints(self, request: MoveRequest, start: Joints, target: Sequence[float], tcp: Tcp) -> Plan:
        """Plan LIN to where the TCP is at joint positions (rad), ending in these."""
        self.checked_joints(target)
        _check_speed(request.speed)
        line = self._lin.to_joints(start, tuple(target), tcp.tool_in_flange)
        return self._plan(line, request.speed, _sphere(line.end, request.blending, tcp))

    def _speed_rel(self, line: Polynomial, tcp_speed_m_s: float) -> float:
        """The relative speed at which the TCP is nowhere faster on a line than a speed (m/s)."""
        length_m = line.tcp_length_m or 0.0
        if length_m < SAME_M:
            if float(travel(line).max()) > SAME_TURN_RAD:
                raise Refused(EXECUTION, "a line on which the TCP only turns has no speed in m/s")
            return 1.0
        fastest_m_s = length_m / least_time_per_s(line, self.limits.velocity)
        speed_rel = min(1.0, tcp_speed_m_s / fastest_m_s)
        if speed_rel < LEAST_SPEED_REL:
            slowest = LEAST_SPEED_REL * fastest_m_s
            raise Refused(EXECUTION, f"speed {tcp_speed_m_s:g} m/s: expected {slowest:g} m/s or more")
        return speed_rel

    def joint_target(
        self, start: Joints, joints: Sequence[float], speeds_rel: Sequence[float]
    ) -> tuple[Joints, list[float]]:
        """Return the checked target (rad) of a move from `start` (rad), and the relative speed of each joint.

        A joint within `NEAR_RAD` of its target gets full speed in place of one below `LEAST_SPEED_REL`: the
        other joints do not wait for it.
        """
        target = self.checked_joints(joints)
        if len(speeds_rel) != len(target):
            raise Refused(EXECUTION, f"{len(target)} speeds are needed")
        speeds: list[float] = []
        for name, q, goal, speed in zip(self._description.joints, start, target, speeds_rel, strict=True):
            if not 0.0 <= speed <= 1.0:
                raise Refused(EXECUTION, f"speed {speed:g} of {name}: expected 0 to 1")
            distance = abs(goal - q)
            if speed >= LEAST_SPEED_REL:
                speeds.append(speed)
            elif distance <= NEAR_RAD + ROUNDING_RAD:
                speeds.append(1.0)
            else:
                raise Refused(
                    EXECUTION,
                    f"{name} is {distance:.7g} rad from its target, at speed {speed:g}: expected "
                    f"{LEAST_SPEED_REL:g} to 1, or a target within {NEAR_RAD:g} rad",
                )
        return target, speeds

    def flange_target(self, present: Joints, flange: Frame, speed_rel: float) -> Joints:
        """The joint positions (rad) nearest to the present ones that bring the flange to a frame."""
        pose = _checked_pose(flange, speed_rel, None)
        try:
            return self._nearest.find(pose, present).joints
        except Unreachable as unreachable:
            raise self._refusal(unreachable, "flange", flange, pose) from None

    def _plan(self, path: Polynomial, speed_rel: float | Sequence[float], zone: Zone | None) -> Plan:
        limits = self.limits._replace(velocity=np.multiply(self.limits.velocity, speed_rel))
        length_s, farthest = least_time_s(path, limits.velocity)
        if not length_s <= LONGEST_MOVE_S:
            raise Refused(
                EXECUTION,
                f"at this speed the move would take more than {LONGEST_MOVE_S:g} s: expected a faster one",
            )
        return Plan(path, limits, 0.0 if farthest < STANDSTILL_RAD else length_s, zone)

    def _refusal(self, unreachable: Unreachable, what: str, asked: Frame, flange: Transform) -> Refused:
        """The refusal in the words of who asked for a frame of `what`, which brings the flange to a pose."""
        reason = unreachable.reason
        if unreachable.code == OUT_OF_REACH:
            x_mm, y_mm, z_mm = asked[:3]
            place = f"{x_mm:.1f} {y_mm:.1f} {z_mm:.1f} mm"
            reason = f"the {what} at {place} is out of reach in this orientation"
            reason += how_far(self._inverse.beyond_reach(flange))
        return Refused(unreachable.code, reason)

    def checked_joints(self, joints: Sequence[float]) -> Joints:
        """Return joint positions (rad) that are within their limits."""
        d = self._description
        if len(joints) != len(d.joints):
            raise Refused(EXECUTION, f"{len(d.joints)} joint positions are needed")
        _check_finite("joint position", joints)
        for name, q, lower, upper in zip(d.joints, joints, d.position_min, d.position_max, strict=True):
            if not lower <= q <= upper:
                raise outside(name, q, lower, upper)
        return tuple(map(float, joints))


def outside(joint: str, q: float, lowest: float, highest: float) -> Refused:
    """Why a joint, told as `joint`, cannot be at q, outside of its limits (rad)."""
    at, low, high = distinct(q, lowest, highest)
    limits = f"{low} to {high} rad ({degrees(lowest):g} to {degrees(highest):g} deg)"
    return Refused(JOINT_LIMIT, f"{joint} at {at} rad is outside {limits}")


def _in_words(shift: RelativeTarget) -> str:
    way = " ".join(f"{mm:.1f}" for mm in shift.way[:3])
    return f"as a way of {way} mm in the axes of the {'tool' if shift.in_tool else 'base'}"


def _sphere(target: Joints, blending_mm: float, tcp: Tcp) -> Zone | None:
    if blending_mm == 0.0:
        return None
    if not (isfinite(blending_mm) and blending_mm > 0.0):
        raise Refused(EXECUTION, f"blending {blending_mm:g} mm: expected 0 or more")
    return sphere(blending_mm / 1000.0, target, tcp)


def _checked_pose(target: Frame, speed_rel: float, redundancy: float | None) -> Transform:
    """The checked target as a pose."""
    _check_finite("frame", target)
    if max(map(abs, target[:3])) > FARTHEST_MM:
        raise Refused(OUT_OF_REACH, f"no arm reaches farther than {FARTHEST_MM:g} mm")
    _check_speed(speed_rel)
    if redundancy is not None:
        _check_finite("redundancy", [redundancy])
    return target.to_transform()


def _check_finite(what: str, values: Sequence[float]) -> None:
    if not all(map(isfinite, values)):
        raise Refused(EXECUTION, f"a {what} that is not finite")


def _check_speed(speed_rel: float) -> None:
    if not LEAST_SPEED_REL <= speed_rel <= 1.0:
        raise Refused(EXECUTION, f"speed {speed_rel:g}: expected {LEAST_SPEED_REL:g} to 1")


def _capped(plan: Plan, cap: AccelerationCap | None) -> Plan:
    """The plan within a lower acceleration; without a cap, or with one above the limits, as it is."""
    if cap is None:
        return plan
    if cap.unit is AccelerationUnit.TCP_M_S2:
        limits = capped_line(plan.limits, plan.path, cap.values[0])
        slower = float(plan.limits.velocity[0] / limits.velocity[0])
        return plan._replace(limits=limits, length_s=slower * plan.length_s)
    return plan._replace(limits=capped_joints(plan.limits, cap))

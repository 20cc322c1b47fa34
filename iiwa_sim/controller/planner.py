"""The planner turns a request into a move or a servo's target, or rejects it with a reason."""

from collections.abc import Callable, Sequence
from math import degrees

import numpy as np

from iiwa_sim.controller.errors import CROSSING_SINGULARITY, EXECUTION, TARGET_NOT_REACHABLE, Refused
from iiwa_sim.controller.modes import Mode
from iiwa_sim.controller.requests import Kind, MoveRequest
from iiwa_sim.frames import Frame, Transform, compose, inverse
from iiwa_sim.motion.blend import Move, joint_ball, sphere
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import STANDSTILL_RAD, Array, JointLimits
from iiwa_sim.motion.lin import LineOutOfReach, SingularLine, TcpLine, lin
from iiwa_sim.motion.path import first_outside, least_time_per_s, least_time_s, ptp
from iiwa_sim.motion.plan_kernel import Polynomial
from iiwa_sim.robot.arm_kernel import Tcp
from iiwa_sim.robot.inverse import Inverse
from iiwa_sim.robot.model import Model
from iiwa_sim.robot.nearest import (
    JOINT_LIMIT,
    OUT_OF_REACH,
    ROBOT_CONFIGURATION,
    Nearest,
    Unreachable,
    how_far,
)
from iiwa_sim.wording import distinct

LEAST_SPEED_REL = 1e-6
"""Speeds below that are refused: a joint at less than a revolution in a week stands still for any client."""
NEAR_RAD = 1e-3
"""A joint this close to its target accepts any speed: drivers send 0 for a joint that stays."""
LONGEST_MOVE_S = 86400.0
LONGEST_APPROACH_S = 3600.0
"""A servo's target that would take longer to reach is refused."""
DIRECT_REACH_RAD = 0.087
"""A direct target is no farther from the present position on any axis. Published: the original's."""
SAME_M = 1e-7
"""A line that is shorter only turns."""
ROUNDING_RAD = 1e-9
"""How far (rad) beyond its limit a joint may seem to be by rounding that stands on it."""
SAME_RAD = 1e-6
"""Joint positions that differ by less are the same."""
LOWEST_SHARE = 1e-6
"""The least part of the robot's acceleration limits that a command may ask for."""
PLACES = 129
"""Number of places of a line that are looked at for its acceleration."""
_REMEDY = "PTP gets there"
"""Advice for a rejected line whose end can be reached."""


class Planner:
    """Planner of the moves of one robot. Methods raise `Refused` for moves that are not possible."""

    def __init__(self, model: Model) -> None:
        d = self._description = model.description
        self._arm = model.tcp_of_flange
        self._inverse = Inverse(model)
        self._nearest = Nearest(self._inverse, d)
        low, high = np.array(d.position_min), np.array(d.position_max)
        self._lowest, self._highest = low - ROUNDING_RAD, high + ROUNDING_RAD
        self.limits = JointLimits(np.array(d.velocity), np.array(d.acceleration), np.array(d.jerk))
        """Limits of the joints in planned motion at full speed."""
        self.servo_limits = {
            Mode.SMART: self.limits,
            Mode.DIRECT: self.limits._replace(
                acceleration=np.array(d.direct_acceleration), jerk=np.array(d.direct_jerk)
            ),
        }
        """The limits of each servo mode at full speed."""

    def plan(
        self,
        request: MoveRequest,
        start: Joints,
        tcp: Tcp,
        number: int = 0,
        again: Callable[[Joints], Move | None] = lambda _: None,
    ) -> Move:
        """Return a PTP or LIN from joint positions (rad) with this TCP; `number` and `again` are its own."""
        path, speed_rel = self._path(request, start, tcp)
        if request.blending == 0.0:
            zone = None
        elif request.kind is Kind.PTP and not isinstance(request.target, Frame):
            zone = joint_ball(request.blending, start, path.end)
        else:
            zone = sphere(request.blending / 1000.0, path.end, tcp)
        limits = _capped(self.limits, request)
        limits = limits._replace(velocity=np.multiply(limits.velocity, speed_rel))
        length_s, farthest = least_time_s(path, limits.velocity)
        if not length_s <= LONGEST_MOVE_S:
            longest = f"more than {LONGEST_MOVE_S:g} s"
            raise Refused(EXECUTION, f"at this speed the move would take {longest}: expected a faster one")
        if farthest < STANDSTILL_RAD:
            length_s = 0.0
        if request.tcp_acceleration_m_s2 is not None:
            full = float(limits.velocity[0])
            limits = _capped_line(limits, path, request.tcp_acceleration_m_s2)
            length_s *= full / float(limits.velocity[0])
        return Move(number, path, limits, length_s, zone, again)

    def _path(
        self, request: MoveRequest, start: Joints, tcp: Tcp
    ) -> tuple[Polynomial, float | Sequence[float]]:
        """Return the path of a PTP or LIN, and its speed relative to the limits of all joints, or of each."""
        target, tool = request.target, tcp.tool_in_flange
        if not isinstance(target, Frame):
            if request.kind is Kind.PTP:
                end, speeds = self._joint_target(start, target, request.speeds)
                return ptp(start, end), speeds
            return self._line_to_joints(start, self.checked_joints(target), tool), request.speed
        speed_m_s, flange = request.tcp_speed_m_s, compose(target.to_transform(), inverse(tool))
        try:
            if request.kind is Kind.PTP:
                path = ptp(start, self._nearest.find(flange, start, request.redundancy).joints)
            else:
                path = self._line_to_pose(start, flange, request.redundancy, tool)
        except Unreachable as unreachable:
            raise self._refusal(unreachable, "TCP", target, flange) from None
        if speed_m_s is None:
            return path, request.speed
        slowest_s = least_time_per_s(path, self.limits.velocity)
        return path, min(1.0, speed_m_s * slowest_s / max(path.tcp_length_m or 0.0, SAME_M))

    # Servos

    def servo_target(
        self, request: MoveRequest, mode: Mode, present: Joints, moving: bool
    ) -> tuple[Joints, JointLimits]:
        """Return the joint positions (rad) that a servo heads for from the present ones, and its limits.

        For a frame in the base they are the nearest ones that bring the flange there.
        """
        target, limits = request.target, self.servo_limits[mode]
        if isinstance(target, Frame):
            flange = target.to_transform()
            try:
                joints = self._nearest.find(flange, present).joints
            except Unreachable as unreachable:
                raise self._refusal(unreachable, "flange", target, flange) from None
            limits = limits.at_speed(request.speed)
        else:
            joints, speeds = self._joint_target(present, target, request.speeds)
            limits = limits.at_speed(speeds)
        distances: Array = np.abs(np.subtract(joints, present))
        farthest = int(distances.argmax())
        if mode is Mode.DIRECT and distances[farthest] > DIRECT_REACH_RAD + ROUNDING_RAD:
            off = f"{self._description.joints[farthest]} is {distances[farthest]:.9g} rad from the target"
            most = f"a direct move goes {DIRECT_REACH_RAD:g} rad at most, a smart move anywhere"
            raise Refused(TARGET_NOT_REACHABLE, f"{off}: {most}")
        self.check_approach(limits, distances, moving)
        return joints, _capped(limits, request)

    def check_approach(self, limits: JointLimits, distances: Array | float, moving: bool) -> None:
        """Raise `Refused` if joints may take too long for distances (rad); those that move brake first."""
        velocity, acceleration, jerk = self.limits
        braking = velocity * (velocity / acceleration + 2.0 * acceleration / jerk)
        if (distances + moving * braking > limits.velocity * LONGEST_APPROACH_S).any():
            longest = f"more than {LONGEST_APPROACH_S:g} s"
            raise Refused(EXECUTION, f"at this speed the target might take {longest}: expected a faster one")

    # Targets

    def checked_joints(self, joints: Sequence[float]) -> Joints:
        """Return joint positions (rad) that are within their limits."""
        d = self._description
        if len(joints) != len(d.joints):
            raise Refused(EXECUTION, f"{len(d.joints)} joint positions are needed")
        for name, q, lower, upper in zip(d.joints, joints, d.position_min, d.position_max, strict=True):
            if not lower - ROUNDING_RAD <= q <= upper + ROUNDING_RAD:
                raise outside(name, q, lower, upper)
        return tuple(np.clip(joints, d.position_min, d.position_max).tolist())

    def _joint_target(
        self, start: Joints, joints: Sequence[float], speeds_rel: Sequence[float]
    ) -> tuple[Joints, list[float]]:
        """Return the checked target (rad) of a move, and the relative speed of each joint.

        A joint within `NEAR_RAD` of its target gets full speed in place of one below `LEAST_SPEED_REL`.
        """
        target = self.checked_joints(joints)
        speeds: list[float] = []
        for name, q, goal, speed in zip(self._description.joints, start, target, speeds_rel, strict=True):
            distance = abs(goal - q)
            if speed < LEAST_SPEED_REL and distance > NEAR_RAD + ROUNDING_RAD:
                off = f"{name} is {distance:.7g} rad from its target, at speed {speed:g}"
                wanted = f"{LEAST_SPEED_REL:g} to 1, or a target within {NEAR_RAD:g} rad"
                raise Refused(EXECUTION, f"{off}: expected {wanted}")
            speeds.append(speed if speed >= LEAST_SPEED_REL else 1.0)
        return target, speeds

    def _refusal(self, unreachable: Unreachable, what: str, asked: Frame, flange: Transform) -> Refused:
        """Build the refusal for a frame of `what`, which brings the flange to a pose."""
        reason = unreachable.reason
        if unreachable.code == OUT_OF_REACH:
            x_mm, y_mm, z_mm = asked[:3]
            place = f"{x_mm:.1f} {y_mm:.1f} {z_mm:.1f} mm"
            reason = f"the {what} at {place} is out of reach in this orientation"
            reason += how_far(self._inverse.beyond_reach(flange))
        return Refused(unreachable.code, reason)

    # Lines

    def _line_to_pose(
        self, start: Joints, flange: Transform, redundancy: float | None, tool: Transform
    ) -> Polynomial:
        """Return the line from joint positions (rad) to a pose of the flange in the base.

        The redundancy (rad) is kept, or is the one given, where that reaches the target; else it goes to the
        nearest that does. The line is tried on the branch on which the target is found, and on the one the
        robot is on: they may differ at a singular start, and on a line that passes a singular pose.
        """
        self._check_end(start, "start")
        tcp_line, inverse = TcpLine(self._arm.pose(start), flange, tool), self._inverse
        present = inverse.redundancy(start)
        own = (present if redundancy is None else redundancy, inverse.status(start))
        faults: list[Unreachable | Refused] = []
        try:
            end = self._nearest.find(flange, start, redundancy, keep_status=True)
        except Unreachable as unreachable:
            faults.append(unreachable)
            tries = [own]
        else:
            found = (inverse.redundancy(end.joints), end.status)
            tries = [own, found] if end.changed else [found, own]
        for branch in dict.fromkeys(tries):
            try:
                return self._line(start, tcp_line, *branch)
            except Refused as refused:
                faults.append(refused)
        raise faults[0]

    def _line_to_joints(self, start: Joints, joints: Joints, tool: Transform) -> Polynomial:
        """Return the line from joint positions (rad) to the TCP at others (rad), ending in these."""
        self._check_end(start, "start")
        inverse, wanted = self._inverse, self._inverse.status(joints)
        tcp_line = TcpLine(self._arm.pose(start), self._arm.pose(joints), tool)
        status = wanted if wanted in inverse.merging_statuses(start) else inverse.status(start)
        line = self._line(start, tcp_line, inverse.redundancy(joints), status)
        if float(np.abs(np.subtract(line.end, joints)).max()) > SAME_RAD:
            ends = "a line to that pose ends in other joint positions"
            if inverse.status(line.end) != wanted:
                reason = f"{ends}, with the arm bent another way: a singular pose lies between, {_REMEDY}"
                raise Refused(CROSSING_SINGULARITY, reason)
            raise Refused(ROBOT_CONFIGURATION, f"{ends}, a joint a turn away: {_REMEDY}")
        return line

    def _line(self, start: Joints, tcp_line: TcpLine, redundancy: float, status: int) -> Polynomial:
        """Return a line on one branch as a path of the joints, checked against their limits."""
        d = self._description
        try:
            line = lin(self._inverse, start, tcp_line, redundancy, status)
        except LineOutOfReach as out:
            reason = f"the line is out of reach after {out.s:.1%} of its length: {_REMEDY}"
            raise Refused(OUT_OF_REACH, reason) from None
        except SingularLine as singular:
            where = f"after {singular.s:.1%} of the line, close to a singular pose: {_REMEDY}"
            reason = f"{d.joints[singular.joint]} would have to jump {where}"
            raise Refused(CROSSING_SINGULARITY, reason) from None
        self._check_end(line.end, "end")
        found = first_outside(line, self._lowest, self._highest)
        if found is not None:
            limit = (d.position_max if found.upwards else d.position_min)[found.joint]
            passed = (
                f"{d.joints[found.joint]} would pass its limit of {limit:.7g} rad ({degrees(limit):g} deg)"
            )
            raise Refused(JOINT_LIMIT, f"{passed} after {found.s:.1%} of the line: {_REMEDY}")
        return line

    def _check_end(self, joints: Joints, which: str) -> None:
        """Refuse a line with an end, `start` or `end`, in a singular pose."""
        singular = self._inverse.turning_point(joints)
        if singular is not None:
            reason = f"a line cannot {which} in a singular pose ({singular}): go there, or leave, by PTP"
            raise Refused(CROSSING_SINGULARITY, reason)


def outside(joint: str, q: float, lowest: float, highest: float) -> Refused:
    """Build the refusal of a position q of a joint outside of its limits (rad)."""
    at, low, high = distinct(q, lowest, highest)
    limits = f"{low} to {high} rad ({degrees(lowest):g} to {degrees(highest):g} deg)"
    return Refused(JOINT_LIMIT, f"{joint} at {at} rad is outside {limits}")


def _capped(limits: JointLimits, request: MoveRequest) -> JointLimits:
    """Return limits (n,) with the accelerations of joints that a request allows; jerk limits stay."""
    if not request.accelerations:
        return limits
    if min(request.accelerations) < LOWEST_SHARE:
        raise Refused(EXECUTION, f"acceleration: expected at least {LOWEST_SHARE:g} of the robot's limits")
    return limits._replace(acceleration=limits.acceleration * np.array(request.accelerations))


def _capped_line(limits: JointLimits, path: Polynomial, tcp_m_s2: float) -> JointLimits:
    """Return limits (n,) within which the TCP nowhere accelerates along its line by more than `tcp_m_s2`.

    Accelerations of all joints are lowered by one share. A line that bends in joint space makes the TCP
    accelerate by its speed alone: speeds are lowered by one share, too, where that takes more than half.
    """
    length_m = path.tcp_length_m
    if not length_m:
        return limits
    _, first, second, _ = path.derivatives(np.linspace(0.0, 1.0, PLACES))
    dq = np.abs(first).clip(min=1e-12)
    most = tcp_m_s2 / length_m
    # The greatest (ds/dt)^2 at each place: by the speed limits, and by what half of the line allows.
    fastest = np.minimum((limits.velocity / dq).min(axis=1) ** 2, most)[:, None]
    from_limits, from_speed = limits.acceleration / dq, np.abs(second) * fastest / dq
    slower = min(1.0, 0.5 * most / max(float(from_speed.min(axis=1).max()), 1e-300))
    # At each place one joint bounds the line: all but what the speed takes is left to that joint's share.
    shares = (most - slower * from_speed) / from_limits
    share = min(1.0, float(shares.max(axis=1).min()))
    if min(share, slower**0.5) < LOWEST_SHARE:
        raise Refused(EXECUTION, f"acceleration {tcp_m_s2:g} m/s^2: lower than the robot can go")
    return limits._replace(velocity=slower**0.5 * limits.velocity, acceleration=share * limits.acceleration)

"""From what a command asks for to a path and a timing, or to the reason why there are none."""

from collections.abc import Sequence
from math import degrees, isfinite
from typing import NamedTuple

import numpy as np

from iiwa_sim.controller.acceleration import AccelerationCap, AccelerationUnit, capped_joints, capped_line
from iiwa_sim.controller.errors import CROSSING_SINGULARITY, EXECUTION, Refused
from iiwa_sim.controller.requests import Kind, MoveRequest, Shift
from iiwa_sim.frames import IDENTITY, Frame, Transform, compose, inverse
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import STANDSTILL_RAD, JointLimits
from iiwa_sim.motion.path.extremes import first_outside, least_time_per_s, travel
from iiwa_sim.motion.path.lin import lin
from iiwa_sim.motion.path.line_joints import LineOutOfReach, SingularLine
from iiwa_sim.motion.path.polynomial import Polynomial
from iiwa_sim.motion.path.ptp import ptp
from iiwa_sim.motion.path.zone import JointBall, Sphere, Zone
from iiwa_sim.motion.tcp_line import TcpLine
from iiwa_sim.robot.inverse import inverse_of
from iiwa_sim.robot.model import Model
from iiwa_sim.robot.nearest import (
    JOINT_LIMIT,
    OUT_OF_REACH,
    ROBOT_CONFIGURATION,
    Found,
    Nearest,
    Unreachable,
    how_far,
)

LEAST_SPEED_REL = 1e-6
"""Speeds below that are refused: a joint at less than a revolution in a week stands still for any client."""
LONGEST_MOVE_S = 86400.0
"""A move that would take longer is refused: its speed is a mistake."""
ROUNDING_RAD = 1e-9
"""So far beyond a limit a joint may seem to be that stands on it."""
SAME_RAD = 1e-6
"""Joint positions that differ by less are the same."""
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


class Asked(NamedTuple):
    """What was asked for, in the words of whoever asked."""

    what: str
    """TCP or flange."""
    frame: Frame
    """Where it is to come to, in the base."""


class Planner:
    """Plans moves of one robot. Each method raises `Refused` where the move cannot be done as asked for."""

    def __init__(self, model: Model) -> None:
        description = model.description
        self._description = description
        self._model = model
        self._inverse = inverse_of(model)
        self._nearest = Nearest(self._inverse, description)
        self._limits = JointLimits(
            np.array(description.velocity), np.array(description.acceleration), np.array(description.jerk)
        )
        self._lowest = np.array(description.position_min) - ROUNDING_RAD
        self._highest = np.array(description.position_max) + ROUNDING_RAD

    def plan(self, request: MoveRequest, start: Joints, tool_in_flange: Transform) -> Plan:
        """PTP or LIN as it is asked for, from joint positions (rad), with the TCP there in the flange."""
        try:
            plan = self._uncapped(request, start, tool_in_flange)
        except Refused as refused:
            if request.shift is None or refused.code != OUT_OF_REACH:
                raise
            raise Refused(OUT_OF_REACH, f"{refused.reason}; asked for {_in_words(request.shift)}") from None
        return self.with_acceleration(plan, request.acceleration)

    def _uncapped(self, request: MoveRequest, start: Joints, tool: Transform) -> Plan:
        target, speed, blending = request.target, request.speed, request.blending
        if not isinstance(target, Frame):
            if request.kind is Kind.LIN:
                return self.lin_to_joints(start, target, speed, blending, tool)
            return self.joint_line(start, target, request.speeds, blending)
        if request.kind is Kind.PTP:
            return self.ptp(start, target, speed, blending, request.redundancy, tool)
        if request.tcp_speed_m_s is None:
            return self.lin(start, target, speed, blending, request.redundancy, tool)
        return self.lin_at(start, target, request.tcp_speed_m_s, blending, tool)

    def joint_line(
        self, start: Joints, joints: Sequence[float], speeds_rel: Sequence[float], blending_rel: float
    ) -> Plan:
        """PTP to joint positions (rad), at a relative speed of each joint."""
        end = self.joint_target(joints, speeds_rel)
        if not 0.0 <= blending_rel <= 1.0:
            raise Refused(EXECUTION, f"blending over {blending_rel:g} of the way: expected 0 to 1")
        zone = JointBall(blending_rel, start, end) if blending_rel else None
        return self._plan(ptp(start, end), speeds_rel, zone)

    def ptp(
        self,
        start: Joints,
        tcp: Frame,
        speed_rel: float,
        blending_mm: float,
        redundancy: float | None,
        tool_in_flange: Transform,
    ) -> Plan:
        """PTP to a pose of the TCP in the base."""
        flange = _flange_of(tcp, speed_rel, redundancy, tool_in_flange)
        end = self._find(Asked("TCP", tcp), flange, start, redundancy).joints
        return self._plan(ptp(start, end), speed_rel, self._sphere(end, blending_mm, tool_in_flange))

    def lin(
        self,
        start: Joints,
        tcp: Frame,
        speed_rel: float,
        blending_mm: float,
        redundancy: float | None,
        tool_in_flange: Transform,
    ) -> Plan:
        """LIN to a pose of the TCP in the base."""
        flange = _flange_of(tcp, speed_rel, redundancy, tool_in_flange)
        line = self._line_from(start, Asked("TCP", tcp), flange, redundancy, tool_in_flange)
        return self._plan(line, speed_rel, self._sphere(line.end, blending_mm, tool_in_flange))

    def lin_at(
        self, start: Joints, tcp: Frame, tcp_speed_m_s: float, blending_mm: float, tool_in_flange: Transform
    ) -> Plan:
        """LIN to a pose of the TCP in the base, which is nowhere faster than a speed (m/s)."""
        if not (isfinite(tcp_speed_m_s) and tcp_speed_m_s > 0.0):
            raise Refused(EXECUTION, f"speed {tcp_speed_m_s:g} m/s: expected above 0")
        flange = _flange_of(tcp, 1.0, None, tool_in_flange)
        line = self._line_from(start, Asked("TCP", tcp), flange, None, tool_in_flange)
        length_m = line.tcp_length_m or 0.0
        if length_m < SAME_M:
            if float(travel(line).max()) > SAME_TURN_RAD:
                raise Refused(EXECUTION, "a line on which the TCP only turns has no speed in m/s")
            return self._plan(line, 1.0, self._sphere(line.end, blending_mm, tool_in_flange))
        fastest_m_s = length_m / least_time_per_s(line, self._limits.velocity)
        speed_rel = min(1.0, tcp_speed_m_s / fastest_m_s)
        if speed_rel < LEAST_SPEED_REL:
            slowest = LEAST_SPEED_REL * fastest_m_s
            raise Refused(EXECUTION, f"speed {tcp_speed_m_s:g} m/s: expected {slowest:g} m/s or more")
        return self._plan(line, speed_rel, self._sphere(line.end, blending_mm, tool_in_flange))

    def lin_to_joints(
        self,
        start: Joints,
        joints: Sequence[float],
        speed_rel: float,
        blending_mm: float,
        tool_in_flange: Transform,
    ) -> Plan:
        """LIN to where the TCP is at joint positions (rad), ending in these."""
        self._check_joints(joints)
        _check_speed(speed_rel)
        self._check_end(start, "start")
        tcp_line = TcpLine(self._model.flange(start), self._model.flange(joints), tool_in_flange)
        own, wanted = self._inverse.status(start), self._inverse.status(joints)
        status = wanted if wanted in self._inverse.merging_statuses(start) else own
        line = self._line(start, tcp_line, self._inverse.redundancy(joints), status)
        if float(np.abs(np.subtract(line.end, joints)).max()) > SAME_RAD:
            ends = "a line to that pose ends in other joint positions"
            if self._inverse.status(line.end) != wanted:
                reason = f"{ends}, with the arm bent another way: a singular pose lies between"
                raise Refused(CROSSING_SINGULARITY, reason)
            raise Refused(ROBOT_CONFIGURATION, f"{ends}, a joint a turn away")
        return self._plan(line, speed_rel, self._sphere(line.end, blending_mm, tool_in_flange))

    def with_acceleration(self, plan: Plan, cap: AccelerationCap | None) -> Plan:
        """The plan within a lower acceleration; without a cap, or with one above the limits, as it is."""
        if cap is None:
            return plan
        if cap.unit is AccelerationUnit.TCP_M_S2:
            limits = capped_line(plan.limits, plan.path, cap.values[0])
            slower = float(plan.limits.velocity[0] / limits.velocity[0])
            return plan._replace(limits=limits, length_s=slower * plan.length_s)
        return plan._replace(limits=capped_joints(plan.limits, cap))

    def joint_target(self, joints: Sequence[float], speeds_rel: Sequence[float]) -> Joints:
        """Checked joint positions (rad), to be reached at checked relative speeds."""
        self._check_joints(joints)
        if len(speeds_rel) != len(joints):
            raise Refused(EXECUTION, f"{len(joints)} speeds are needed")
        for speed_rel in speeds_rel:
            _check_speed(speed_rel)
        return tuple(map(float, joints))

    def flange_target(self, present: Joints, flange: Frame, speed_rel: float) -> Joints:
        """The joint positions (rad) nearest to the present ones that bring the flange to a frame."""
        pose = _flange_of(flange, speed_rel, None, IDENTITY)
        return self._find(Asked("flange", flange), pose, present, None).joints

    def _plan(self, path: Polynomial, speed_rel: float | Sequence[float], zone: Zone | None) -> Plan:
        limits = self._limits.at_speed(speed_rel)
        ways = travel(path)
        with np.errstate(over="ignore", invalid="ignore"):  # the least of all speeds take longer than a float
            length_s = float((ways / limits.velocity).max())
        if not length_s <= LONGEST_MOVE_S:
            raise Refused(EXECUTION, f"at this speed the move would take more than {LONGEST_MOVE_S:g} s")
        return Plan(path, limits, 0.0 if ways.max() < STANDSTILL_RAD else length_s, zone)

    def _sphere(self, target: Joints, blending_mm: float, tool_in_flange: Transform) -> Zone | None:
        if not (isfinite(blending_mm) and blending_mm >= 0.0):
            raise Refused(EXECUTION, f"blending {blending_mm:g} mm: expected 0 or more")
        if blending_mm == 0.0:
            return None
        return Sphere(blending_mm / 1000.0, target, self._model.tcp(tool_in_flange))

    def _find(
        self,
        asked: Asked,
        flange: Transform,
        start: Joints,
        redundancy: float | None,
        keep_status: bool = False,
    ) -> Found:
        try:
            return self._nearest.find(flange, start, redundancy, keep_status)
        except Unreachable as unreachable:
            reason = unreachable.reason
            if unreachable.code == OUT_OF_REACH:
                x_mm, y_mm, z_mm = asked.frame[:3]
                place = f"{x_mm:.1f} {y_mm:.1f} {z_mm:.1f} mm"
                reason = f"the {asked.what} at {place} is out of reach in this orientation"
                reason += how_far(self._inverse.beyond_reach(flange))
            raise Refused(unreachable.code, reason) from None

    def _line_from(
        self,
        start: Joints,
        asked: Asked,
        flange: Transform,
        redundancy: float | None,
        tool_in_flange: Transform,
    ) -> Polynomial:
        self._check_end(start, "start")
        tcp_line = TcpLine(self._model.flange(start), flange, tool_in_flange)
        return self._line_to(asked, flange, start, redundancy, tcp_line)

    def _line_to(
        self,
        asked: Asked,
        flange: Transform,
        start: Joints,
        redundancy: float | None,
        tcp_line: TcpLine,
    ) -> Polynomial:
        """The line with the redundancy kept or given where that reaches the target, else with the nearest.

        It is tried on the branch on which the target is found, and on the one the robot is on: at a singular
        start these may differ, and a line that passes a singular pose may reach what its first branch cannot.
        """
        own = self._inverse.status(start)
        kept = self._inverse.redundancy(start) if redundancy is None else redundancy
        try:
            end = self._find(asked, flange, start, redundancy, keep_status=True)
        except Refused as unreachable:
            d = self._description
            longest = max(b - a for a, b in zip(d.position_min, d.position_max, strict=True))
            if abs(kept - self._inverse.redundancy(start)) > longest:
                raise  # no joint goes so far
            try:
                return self._line(start, tcp_line, kept, own)
            except Refused:
                raise unreachable from None
        first, second = (kept, own), (self._inverse.redundancy(end.joints), end.status)
        if not end.changed:
            first, second = second, first
        try:
            return self._line(start, tcp_line, *first)
        except Refused as refused:
            if first == second:
                raise
            try:
                return self._line(start, tcp_line, *second)
            except Refused:
                raise refused from None

    def _line(self, start: Joints, tcp_line: TcpLine, redundancy: float, status: int) -> Polynomial:
        try:
            line = lin(self._inverse, start, tcp_line, redundancy, status)
        except LineOutOfReach as out:
            raise Refused(OUT_OF_REACH, f"the line is out of reach after {out.s:.1%} of its way") from None
        except SingularLine as singular:
            name = self._description.joints[singular.joint]
            where = f"after {singular.s:.1%} of the line, close to a singular pose"
            raise Refused(CROSSING_SINGULARITY, f"{name} would have to jump {where}") from None
        self._check_end(line.end, "end")
        self._check_line(line)
        return line

    def _check_end(self, joints: Joints, which: str) -> None:
        singular = self._inverse.turning_point(joints)
        if singular is not None:
            reason = f"a line cannot {which} in a singular pose ({singular}): go there, or leave, by PTP"
            raise Refused(CROSSING_SINGULARITY, reason)

    def _check_joints(self, joints: Sequence[float]) -> None:
        d = self._description
        if len(joints) != len(d.joints):
            raise Refused(EXECUTION, f"{len(d.joints)} joint positions are needed")
        _check_finite("joint position", joints)
        for name, q, lower, upper in zip(d.joints, joints, d.position_min, d.position_max, strict=True):
            if not lower <= q <= upper:
                raise Refused(
                    JOINT_LIMIT,
                    f"{name} at {q:.7g} rad is outside {lower:.7g} to {upper:.7g} rad ({degrees(lower):g} to "
                    f"{degrees(upper):g} deg)",
                )

    def _check_line(self, line: Polynomial) -> None:
        """Joint limits along a line."""
        found = first_outside(line, self._lowest, self._highest)
        if found is not None:
            d = self._description
            limit = (d.position_max if found.upwards else d.position_min)[found.joint]
            raise Refused(
                JOINT_LIMIT,
                f"{d.joints[found.joint]} would pass its limit of {limit:.7g} rad ({degrees(limit):g} deg) "
                f"after {found.s:.1%} of the line",
            )


def _in_words(shift: Shift) -> str:
    way = " ".join(f"{mm:.1f}" for mm in shift.way[:3])
    return f"as a way of {way} mm in the axes of the {'tool' if shift.in_tool else 'base'}"


def _flange_of(
    tcp: Frame, speed_rel: float, redundancy: float | None, tool_in_flange: Transform
) -> Transform:
    """The checked target as a pose of the flange."""
    _check_finite("frame", tcp)
    if max(map(abs, tcp[:3])) > FARTHEST_MM:
        raise Refused(OUT_OF_REACH, f"no arm reaches farther than {FARTHEST_MM:g} mm")
    _check_speed(speed_rel)
    if redundancy is not None:
        _check_finite("redundancy", [redundancy])
    return compose(tcp.to_transform(), inverse(tool_in_flange))


def _check_finite(what: str, values: Sequence[float]) -> None:
    if not all(map(isfinite, values)):
        raise Refused(EXECUTION, f"a {what} that is not finite")


def _check_speed(speed_rel: float) -> None:
    if not LEAST_SPEED_REL <= speed_rel <= 1.0:
        raise Refused(EXECUTION, f"speed {speed_rel:g}: expected {LEAST_SPEED_REL:g} to 1")

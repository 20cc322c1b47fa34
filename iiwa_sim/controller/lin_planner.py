"""LIN: the joints along a straight line of the TCP, or the reason why they cannot follow it."""

from math import degrees

import numpy as np

from iiwa_sim.controller.errors import CROSSING_SINGULARITY, Refused
from iiwa_sim.frames import Transform
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.lin import LineOutOfReach, SingularLine, TcpLine, lin
from iiwa_sim.motion.path import first_outside
from iiwa_sim.motion.plan_kernel import Polynomial
from iiwa_sim.robot.inverse import Inverse
from iiwa_sim.robot.model import Model
from iiwa_sim.robot.nearest import JOINT_LIMIT, OUT_OF_REACH, ROBOT_CONFIGURATION, Nearest, Unreachable

_REMEDY = "PTP gets there"
"""Advice for a rejected line whose end can be reached."""
ROUNDING_RAD = 1e-9
"""How far (rad) beyond its limit a joint may seem to be by rounding that stands on it."""
SAME_RAD = 1e-6
"""Joint positions that differ by less are the same."""


class LinPlanner:
    """Lines of one robot. Each method raises `Refused` where there is none."""

    def __init__(self, model: Model, inverse: Inverse, nearest: Nearest) -> None:
        self._arm = model.tcp_of_flange
        self._description = d = model.description
        self._inverse = inverse
        self._nearest = nearest
        self._lowest = np.array(d.position_min) - ROUNDING_RAD
        self._highest = np.array(d.position_max) + ROUNDING_RAD

    def to_pose(
        self,
        start: Joints,
        flange: Transform,
        redundancy: float | None,
        tool_in_flange: Transform,
    ) -> Polynomial:
        """The line from joint positions (rad) to a pose of the flange in the base.

        The redundancy (rad) is kept, or is the one given, where that reaches the target; else it goes to the
        nearest that does. The line is tried on the branch on which the target is found, and on the one the
        robot is on: at a singular start these may differ, and a line that passes a singular pose may reach
        what its first branch cannot. Raises `Unreachable`, too, where nothing reaches the target.
        """
        self._check_end(start, "start")
        tcp_line = TcpLine(self._arm.pose(start), flange, tool_in_flange)
        own = self._inverse.status(start)
        kept = self._inverse.redundancy(start) if redundancy is None else redundancy
        try:
            end = self._nearest.find(flange, start, redundancy, keep_status=True)
        except Unreachable as unreachable:
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

    def to_joints(self, start: Joints, joints: Joints, tool_in_flange: Transform) -> Polynomial:
        """The line from joint positions (rad) to where the TCP is at others (rad), ending in these."""
        self._check_end(start, "start")
        tcp_line = TcpLine(self._arm.pose(start), self._arm.pose(joints), tool_in_flange)
        own, wanted = self._inverse.status(start), self._inverse.status(joints)
        status = wanted if wanted in self._inverse.merging_statuses(start) else own
        line = self._line(start, tcp_line, self._inverse.redundancy(joints), status)
        if float(np.abs(np.subtract(line.end, joints)).max()) > SAME_RAD:
            ends = "a line to that pose ends in other joint positions"
            if self._inverse.status(line.end) != wanted:
                reason = f"{ends}, with the arm bent another way: a singular pose lies between, {_REMEDY}"
                raise Refused(CROSSING_SINGULARITY, reason)
            raise Refused(ROBOT_CONFIGURATION, f"{ends}, a joint a turn away: {_REMEDY}")
        return line

    def _line(self, start: Joints, tcp_line: TcpLine, redundancy: float, status: int) -> Polynomial:
        try:
            line = lin(self._inverse, start, tcp_line, redundancy, status)
        except LineOutOfReach as out:
            reason = f"the line is out of reach after {out.s:.1%} of its way: {_REMEDY}"
            raise Refused(OUT_OF_REACH, reason) from None
        except SingularLine as singular:
            name = self._description.joints[singular.joint]
            where = f"after {singular.s:.1%} of the line, close to a singular pose: {_REMEDY}"
            raise Refused(CROSSING_SINGULARITY, f"{name} would have to jump {where}") from None
        self._check_end(line.end, "end")
        self._check_limits(line)
        return line

    def _check_end(self, joints: Joints, which: str) -> None:
        singular = self._inverse.turning_point(joints)
        if singular is not None:
            reason = f"a line cannot {which} in a singular pose ({singular}): go there, or leave, by PTP"
            raise Refused(CROSSING_SINGULARITY, reason)

    def _check_limits(self, line: Polynomial) -> None:
        found = first_outside(line, self._lowest, self._highest)
        if found is not None:
            d = self._description
            limit = (d.position_max if found.upwards else d.position_min)[found.joint]
            raise Refused(
                JOINT_LIMIT,
                f"{d.joints[found.joint]} would pass its limit of {limit:.7g} rad ({degrees(limit):g} deg) "
                f"after {found.s:.1%} of the line: {_REMEDY}",
            )

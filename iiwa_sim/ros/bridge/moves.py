"""Translates a move into a command of the line protocol, and tells whether the robot has reached its end.

What the protocol cannot express is refused.
"""

from collections.abc import Awaitable, Callable
from math import cos, dist, radians
from typing import NamedTuple

from iiwa_sim.client import AsyncIiwa
from iiwa_sim.client.replies import Frame as ClientFrame
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.controller.requests import Kind
from iiwa_sim.frames import Frame, quaternion_from_rotation
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.ros.rmi.robot import BlendingUnit, Joints, Move, SpeedUnit

JOINT_BLENDING = 0.1
"""The part of its path over which a `joint move` may blend; the protocol has no parameter for it."""
THERE_MM = 1.0
THERE_RAD = radians(0.5)


class Sending(NamedTuple):
    """How a move is sent to the robot."""

    send: Callable[[AsyncIiwa], Awaitable[None]]
    """Sends the command; raises what the client raises."""
    rests: bool
    """Whether the next move must not be sent before the robot rests, because it would blend into this one."""


def sending(move: Move, robot: RobotDescription) -> Sending:
    """How to send a move to a server of that robot. Raises `Refused` where the protocol cannot say it."""
    if move.speed_unit is SpeedUnit.M_S:
        raise Refused(EXECUTION, "velocity_type M/S: this robot takes %, PERCENT and, for joints, RAD/S")
    target = move.target
    if isinstance(target, Frame):
        return Sending(_to_frame(move, target), rests=False)
    if move.kind is Kind.PTP:
        speeds = move.joint_speeds_rel(robot)
        return Sending(lambda client: client.joint_move(target, speeds), _stops_at_joints(move))
    if move.kind is Kind.LIN:
        speed, blending = move.speeds[0], _blending_mm(move)
        return Sending(lambda client: client.lin_joint_move(target, speed, blending), rests=False)
    speeds = move.joint_speeds_rel(robot)
    if move.kind is Kind.SMART:
        return Sending(lambda client: client.smart_joint_move(target, speeds), rests=False)
    return Sending(lambda client: client.direct_joint_move(target, speeds), rests=False)


async def is_there(client: AsyncIiwa, move: Move, joints: Joints, tool_frame: Frame) -> bool:
    """Whether the robot, now at `joints` and `tool_frame`, has reached the end of a move. A force move may
    end anywhere."""
    target = move.target
    if move.thresholds_n is not None:
        return True
    if not isinstance(target, Frame):
        return max(abs(b - a) for a, b in zip(joints, target, strict=True)) < THERE_RAD
    here = as_frame(await client.get_flange_frame()) if move.kind.is_servo else tool_frame
    if dist(here[:3], target[:3]) > THERE_MM:
        return False
    a, b = (quaternion_from_rotation(frame.to_transform().rotation) for frame in (here, target))
    return abs(sum(p * q for p, q in zip(a, b, strict=True))) > cos(THERE_RAD / 2.0)


def as_frame(frame: ClientFrame) -> Frame:
    """The client's frame as a frame of the simulator; both are in mm and rad."""
    return Frame(*frame)


def _to_frame(move: Move, target: Frame) -> Callable[[AsyncIiwa], Awaitable[None]]:
    speed = move.speeds[0]
    if move.kind is Kind.SMART:
        return lambda client: client.smart_cartesian_move(target, speed)
    if move.kind is Kind.DIRECT:
        return lambda client: client.direct_cartesian_move(target, speed)
    blending, thresholds = _blending_mm(move), move.thresholds_n
    if move.kind is Kind.LIN:
        if thresholds is None:
            return lambda client: client.lin_move(target, speed, blending)
        return lambda client: client.linforce_move(target, speed, blending, *thresholds)
    if thresholds is None:
        return lambda client: client.ptp_move(target, speed, blending)
    return lambda client: client.ptpforce_move(target, speed, blending, *thresholds)


def _blending_mm(move: Move) -> float:
    if move.blending_unit is not BlendingUnit.MM:
        raise Refused(EXECUTION, "blending_type: this robot takes M for moves of the TCP")
    return move.blending


def _stops_at_joints(move: Move) -> bool:
    if move.blending == 0.0:
        return True
    if move.blending_unit is BlendingUnit.RELATIVE and move.blending == JOINT_BLENDING:
        return False
    reason = (
        f"blending of PTP to JOINTS: this robot takes 0, or {JOINT_BLENDING:g} in %, the tenth it always has"
    )
    raise Refused(EXECUTION, reason)

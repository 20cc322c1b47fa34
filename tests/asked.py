"""Requests for moves in few words, as tests ask for them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from iiwa_sim.controller.requests import JOINT_BLENDING, Compliance, Kind, MoveRequest, Shift
from iiwa_sim.frames import Frame


def joint_move(
    joints: Sequence[float], speeds: Sequence[float], blending: float = JOINT_BLENDING, **more: Any
) -> MoveRequest:
    return MoveRequest(Kind.PTP, joints, speeds=speeds, blending=blending, **more)


def lin_joint_move(joints: Sequence[float], speed: float, blending: float, **more: Any) -> MoveRequest:
    return MoveRequest(Kind.LIN, joints, speed, blending, **more)


def ptp_move(
    target: Frame, speed: float, blending: float, redundancy: float | None = None, **more: Any
) -> MoveRequest:
    return MoveRequest(Kind.PTP, target, speed, blending, redundancy=redundancy, **more)


def lin_move(
    target: Frame, speed: float, blending: float, redundancy: float | None = None, **more: Any
) -> MoveRequest:
    return MoveRequest(Kind.LIN, target, speed, blending, redundancy=redundancy, **more)


def lin_move_at(target: Frame, speed_m_s: float, blending: float, **more: Any) -> MoveRequest:
    return MoveRequest(Kind.LIN, target, blending=blending, tcp_speed_m_s=speed_m_s, **more)


def ptp_relative_move(way: Frame, speed: float, blending: float, *, in_tool: bool) -> MoveRequest:
    return MoveRequest(Kind.PTP, speed=speed, blending=blending, shift=Shift(way, in_tool))


def lin_relative_move(way: Frame, speed: float, blending: float, *, in_tool: bool) -> MoveRequest:
    return MoveRequest(Kind.LIN, speed=speed, blending=blending, shift=Shift(way, in_tool))


def ptp_force_move(
    target: Frame, speed: float, blending: float, thresholds: tuple[float | None, ...], **more: Any
) -> MoveRequest:
    return ptp_move(target, speed, blending, thresholds=thresholds, **more)


def lin_force_move(
    target: Frame, speed: float, blending: float, thresholds: tuple[float | None, ...], **more: Any
) -> MoveRequest:
    return lin_move(target, speed, blending, thresholds=thresholds, **more)


def ptp_stiff_move(target: Frame, speed: float, n_per_m: float, balanced: Sequence[float]) -> MoveRequest:
    return MoveRequest(Kind.PTP, target, speed, compliance=Compliance(n_per_m, balanced))


def lin_stiff_move(target: Frame, speed: float, n_per_m: float, balanced: Sequence[float]) -> MoveRequest:
    return MoveRequest(Kind.LIN, target, speed, compliance=Compliance(n_per_m, balanced))


def gravity_hold(nm_per_rad: float) -> MoveRequest:
    return MoveRequest(Kind.HOLD, hold_nm_per_rad=nm_per_rad)


def smart_joint_move(joints: Sequence[float], speeds: Sequence[float], **more: Any) -> MoveRequest:
    return MoveRequest(Kind.SMART, joints, speeds=speeds, **more)


def smart_cartesian_move(flange: Frame, speed: float, **more: Any) -> MoveRequest:
    return MoveRequest(Kind.SMART, flange, speed, **more)


def direct_joint_move(joints: Sequence[float], speeds: Sequence[float], **more: Any) -> MoveRequest:
    return MoveRequest(Kind.DIRECT, joints, speeds=speeds, **more)


def direct_cartesian_move(flange: Frame, speed: float, **more: Any) -> MoveRequest:
    return MoveRequest(Kind.DIRECT, flange, speed, **more)


def reach(target: Frame, redundancy: float | None = None) -> MoveRequest:
    return MoveRequest(Kind.PTP, target, redundancy=redundancy)


def lin_reach(target: Frame, redundancy: float | None = None) -> MoveRequest:
    return MoveRequest(Kind.LIN, target, redundancy=redundancy)

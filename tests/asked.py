"""Requests for moves in few words, as tests ask for them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

from iiwa_sim.controller.requests import JOINT_BLENDING, Compliance, Kind, MoveRequest, Shift
from iiwa_sim.frames import Frame


def _per_joint(kind: Kind, joints: Sequence[float], speeds: Sequence[float], **more: Any) -> MoveRequest:
    return MoveRequest(kind, joints, speeds=speeds, **more)


def joint_move(
    joints: Sequence[float], speeds: Sequence[float], blending: float = JOINT_BLENDING, **more: Any
) -> MoveRequest:
    return _per_joint(Kind.PTP, joints, speeds, blending=blending, **more)


def _to_frame(
    kind: Kind, target: Frame, speed: float, blending: float, redundancy: float | None = None, **more: Any
) -> MoveRequest:
    return MoveRequest(kind, target, speed, blending, redundancy=redundancy, **more)


def _until_force(
    kind: Kind,
    target: Frame,
    speed: float,
    blending: float,
    thresholds: tuple[float | None, ...],
    **more: Any,
) -> MoveRequest:
    return MoveRequest(kind, target, speed, blending, thresholds=thresholds, **more)


def _relative(kind: Kind, way: Frame, speed: float, blending: float, *, in_tool: bool) -> MoveRequest:
    return MoveRequest(kind, speed=speed, blending=blending, shift=Shift(way, in_tool))


def _stiff(kind: Kind, target: Frame, speed: float, n_per_m: float, balanced: Sequence[float]) -> MoveRequest:
    return MoveRequest(kind, target, speed, compliance=Compliance(n_per_m, balanced))


def lin_move_at(target: Frame, speed_m_s: float, blending: float, **more: Any) -> MoveRequest:
    return MoveRequest(Kind.LIN, target, blending=blending, tcp_speed_m_s=speed_m_s, **more)


def gravity_hold(nm_per_rad: float) -> MoveRequest:
    return MoveRequest(Kind.HOLD, hold_nm_per_rad=nm_per_rad)


def _check(kind: Kind, target: Frame, redundancy: float | None = None) -> MoveRequest:
    return MoveRequest(kind, target, redundancy=redundancy)


smart_joint_move, direct_joint_move = (partial(_per_joint, kind) for kind in (Kind.SMART, Kind.DIRECT))
lin_joint_move, smart_cartesian_move, direct_cartesian_move = (
    partial(MoveRequest, kind) for kind in (Kind.LIN, Kind.SMART, Kind.DIRECT)
)
ptp_move, lin_move = (partial(_to_frame, kind) for kind in (Kind.PTP, Kind.LIN))
ptp_relative_move, lin_relative_move = (partial(_relative, kind) for kind in (Kind.PTP, Kind.LIN))
ptp_force_move, lin_force_move = (partial(_until_force, kind) for kind in (Kind.PTP, Kind.LIN))
ptp_stiff_move, lin_stiff_move = (partial(_stiff, kind) for kind in (Kind.PTP, Kind.LIN))
reach, lin_reach = (partial(_check, kind) for kind in (Kind.PTP, Kind.LIN))

"""Requests for moves in few words, for tests."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from iiwa_sim.controller.requests import JOINT_BLENDING, Kind, MoveRequest
from iiwa_sim.frames import Frame
from iiwa_sim.motion.springs import CartesianImpedance

RequestOf = Callable[..., MoveRequest]
BOTH = (Kind.PTP, Kind.LIN)


def _of(kind: Kind, *names: str, **usual: Any) -> RequestOf:
    """Make a request of the values of these names, of which the last may be left out, and of named ones."""

    def request(*values: Any, **named: Any) -> MoveRequest:
        assert len(values) <= len(names)
        return MoveRequest(kind, **usual | dict(zip(names, values, strict=False)) | named)

    return request


def _relative(kind: Kind, by: Frame, speed: float, blending: float, *, in_tool: bool) -> MoveRequest:
    return MoveRequest(kind, speed=speed, blending=blending, shift=by, in_tool=in_tool)


def _stiff(kind: Kind, target: Frame, speed: float, n_per_m: float, balanced: Sequence[float]) -> MoveRequest:
    fx, fy, fz, tx, ty, tz = (0.0 - value for value in balanced)
    return MoveRequest(kind, target, speed, compliance=CartesianImpedance(n_per_m, (fx, fy, fz, tx, ty, tz)))


joint_move = _of(Kind.PTP, "target", "speeds", "blending", blending=JOINT_BLENDING)
smart_joint_move, direct_joint_move = (_of(kind, "target", "speeds") for kind in (Kind.SMART, Kind.DIRECT))
lin_joint_move, smart_cartesian_move, direct_cartesian_move = (
    partial(MoveRequest, kind) for kind in (Kind.LIN, Kind.SMART, Kind.DIRECT)
)
ptp_move, lin_move = (_of(kind, "target", "speed", "blending", "redundancy") for kind in BOTH)
lin_move_at = _of(Kind.LIN, "target", "tcp_speed_m_s", "blending")
ptp_relative_move, lin_relative_move = (partial(_relative, kind) for kind in BOTH)
ptp_force_move, lin_force_move = (_of(kind, "target", "speed", "blending", "thresholds") for kind in BOTH)
ptp_stiff_move, lin_stiff_move = (partial(_stiff, kind) for kind in BOTH)
gravity_hold = _of(Kind.HOLD, "hold_nm_per_rad")
reach, lin_reach = (_of(kind, "target", "redundancy") for kind in BOTH)

"""What the robot says of itself, beside the picture: mode, status, error, joints, TCP and wrench."""

from __future__ import annotations

import html
import time
from collections.abc import Mapping, Sequence
from itertools import zip_longest
from math import degrees
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import viser

    from iiwa_sim.view.scene import State

WHOLE_NM = 10.0
"""Torque from which on torques are told in whole Nm."""
EVERY_S = 0.1
"""Time between two changes of the figures (s)."""

_RED = "color:#c92a2a;font-weight:bold"
_TABLE = "width:100%;border-spacing:0;line-height:1.2"
_NUMBER = "text-align:right;font-family:monospace;white-space:nowrap"
_TCP = ("x", "y", "z", "alpha", "beta", "gamma")
_WRENCH = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
_HEADS = ("joints (deg)", "TCP (mm, deg)", "force (N, Nm)")

Robot = Mapping[str, Any]
"""What is known of the arm: `name` and `joints`, the names of its joints; see `get robot` of the backdoor."""


class Readout:
    """Live figures, as HTML; what does not change is not sent."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._html: Any = gui.add_html("")
        self._next_s = 0.0
        self._before = ""

    def show(self, state: State | None, robot: Robot, fault: str = "") -> None:
        """The figures of a state, if there is one, below what is wrong, if anything is."""
        now_s = time.monotonic()
        if now_s < self._next_s:
            return
        self._next_s = now_s + EVERY_S
        body = "" if state is None else figures(state, robot)
        said = (f'<p style="{_RED}">{html.escape(fault)}</p>' if fault else "") + body
        if said != self._before:
            self._before = said
            self._html.content = said


def figures(state: State, robot: Robot) -> str:
    """A state as HTML."""
    code, reason = state["error"]["code"], state["error"]["reason"]
    _, pressed, powered, _, _, in_error, _ = state["robot_status"]
    error = html.escape(f"{code} {reason}") if code else "none"
    drives = "on" if powered == 1 else _coloured("off", True)
    rows = [
        (html.escape(str(robot.get("name", ""))), html.escape(f"{state['mode']}, {state['status']}")),
        ("emergency stop", f"{_coloured('pressed', True) if pressed == 1 else 'released'}, drives {drives}"),
        ("error", _coloured(error, in_error == 1)),
    ]
    gripper, (load_kg, *_) = state.get("gripper"), state["tool_load"]
    if gripper is not None:
        rows.append(("gripper", f"{html.escape(gripper['state'])}, {gripper['opening_mm']:.1f} mm"))
    if load_kg:
        rows.append(("tool load", f"{load_kg:g} kg"))
    largest_nm = max(map(abs, state["joint_torque"]))
    if largest_nm > 0.0:
        digits = 0 if largest_nm >= WHOLE_NM else 1  # so they have room in one line
        torques = [round(torque, digits) + 0.0 for torque in state["joint_torque"]]  # no -0.0
        rows.append(("torques (Nm)", " ".join(f"{torque:.{digits}f}" for torque in torques)))
    frame = state["tool_frame"]
    columns = [
        zip(robot["joints"], map(degrees, state["joint_position"]), strict=True),
        zip(_TCP, [*frame[:3], *map(degrees, frame[3:])], strict=True),
        zip(_WRENCH, state["cartesian_force"], strict=True),
    ]
    heads = "".join(f"<td colspan=2>{head}</td>" for head in _HEADS)
    return (
        '<div style="font-size:0.78em;padding:0 0.9em 0.6em">'
        f'<table style="{_TABLE}">{_rows(rows)}</table><table style="{_TABLE}">'
        f"<tr>{heads}</tr>{_figures(columns)}</table></div>"
    )


def _figures(columns: Sequence[Any]) -> str:
    return "".join(
        f"<tr>{''.join(_pair(*each) if each else '<td></td><td></td>' for each in row)}</tr>"
        for row in zip_longest(*columns)
    )


def _pair(name: str, value: float) -> str:
    label = f'<td style="padding-left:0.6em">{html.escape(name)}</td>'
    return f'{label}<td style="{_NUMBER}">{round(value, 2) + 0.0:.2f}</td>'


def _rows(rows: Sequence[tuple[str, str]]) -> str:
    return "".join(
        f'<tr><td style="white-space:nowrap;padding-right:0.8em;vertical-align:top">{name}</td>'
        f'<td style="width:99%">{value}</td></tr>'
        for name, value in rows
    )


def _coloured(text: str, red: bool) -> str:
    return f'<span style="{_RED}">{text}</span>' if red else text

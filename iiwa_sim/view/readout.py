"""What the robot says of itself, beside the picture: mode, status, error, joints and TCP."""

from __future__ import annotations

import html
import time
from collections.abc import Sequence
from math import degrees
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import viser

    from iiwa_sim.view.scene import State
    from iiwa_sim.view.station import Station

EVERY_S = 0.1
"""Between two changes of the numbers."""
AT_REST_S = 1.0
"""The same where nothing but time has changed."""

_RED = "color:#c92a2a;font-weight:bold"


class Readout:
    """Live figures, as HTML: what does not change is not sent."""

    def __init__(self, gui: viser.GuiApi, station: Station) -> None:
        self._station = station
        self._html: Any = gui.add_html("")
        self._next_s = 0.0
        self._before = ""

    def show(self) -> None:
        """What the newest state says."""
        now_s = time.monotonic()
        if now_s < self._next_s:
            return
        self._next_s = now_s + EVERY_S
        station = self._station
        fault = station.follower.fault or station.fault
        body = "" if station.state is None else _told(station.state, station.told)
        said = f"{_warning(fault)}{body}"
        if said != self._before:
            self._before = said
            self._html.content = said


def _warning(fault: str) -> str:
    return f'<p style="{_RED}">{html.escape(fault)}</p>' if fault else ""


def _told(state: State, robot: dict[str, Any]) -> str:
    code, reason = state["error"]["code"], state["error"]["reason"]
    status = state["robot_status"]
    stopped = "pressed" if status[1] == 1 else "released"
    error = f"{code} {html.escape(reason)}" if code else "none"
    in_error = status[5] == 1
    rows = [
        ("robot", html.escape(str(robot.get("name", "")))),
        ("mode", html.escape(state["mode"])),
        ("status", html.escape(state["status"])),
        ("emergency stop", _coloured(stopped, stopped == "pressed")),
        ("drives", _coloured(*(("on", False) if status[2] == 1 else ("off", True)))),
        ("error", _coloured(error, in_error)),
    ]
    joints = [
        f"<tr><td>{html.escape(name)}</td>{_cell(degrees(position), 2)}<td>°</td></tr>"
        for name, position in zip(robot["joints"], state["joint_position"], strict=True)
    ]
    frame = state["tool_frame"]
    names = ("x", "y", "z", "alpha", "beta", "gamma")
    values = [*frame[:3], *map(degrees, frame[3:])]
    force = state["cartesian_force"]
    tcp = [
        f"<tr><td>{name}</td>{_cell(value, 2)}<td>{unit}</td></tr>"
        for name, value, unit in zip(names, values, ("mm",) * 3 + ("°",) * 3, strict=True)
    ]
    wrench = [
        f"<tr><td>{name}</td>{_cell(value, 2)}<td>{unit}</td></tr>"
        for name, value, unit in zip(
            ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz"), force, ("N",) * 3 + ("Nm",) * 3, strict=True
        )
    ]
    return (
        '<div style="font-size:0.8em;padding:0 0.9em">'
        f'<table style="width:100%">{_rows(rows)}</table>'
        '<div style="display:flex;flex-wrap:wrap;gap:1em;font-family:monospace">'
        + "".join(f"<table>{''.join(each)}</table>" for each in (joints, tcp, wrench))
        + "</div></div>"
    )


def _rows(rows: Sequence[tuple[str, str]]) -> str:
    return "".join(f"<tr><td>{name}</td><td>{value}</td></tr>" for name, value in rows)


def _cell(value: float, digits: int) -> str:
    return f'<td style="text-align:right;min-width:5em">{value + 0.0:.{digits}f}</td>'


def _coloured(text: str, red: bool) -> str:
    return f'<span style="{_RED}">{text}</span>' if red else text

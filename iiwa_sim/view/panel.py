"""The panel beside the picture: a pendant for one robot, and its dialogue."""

from __future__ import annotations

import html
import time
from collections.abc import Callable, Iterable
from functools import partial
from math import degrees, dist
from typing import TYPE_CHECKING, Any

from iiwa_sim.controller.state import Snapshot
from iiwa_sim.dialogue import DialogueLine
from iiwa_sim.recordings.schemas import Line
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.view.connection import NOTE_S, Station, notify
from iiwa_sim.view.jog import Jog
from iiwa_sim.view.push import Push
from iiwa_sim.view.scene import LEAST_N, Scene

if TYPE_CHECKING:
    import viser

PERIOD_S = 0.1
"""Time between two updates of figures."""
MOST_INPUTS = 64
HOLD_S = 0.7
"""Time for which an element keeps the value that a viewer has set, though the state does not show it yet."""
NEAR_DEG = 5.0
"""Distance from a limit at which the bar of a joint is yellow."""
STOP, STOPPED = "Emergency stop", "Emergency stop is PRESSED"
GROUPS: dict[str, dict[str, tuple[Any, ...]]] = {
    "Safety": {
        "Release": ("emergency_stop", False),
        "Reset error": ("reset_error",),
        "Protective stop": ("fail", 3060, "protective stop"),
    },
    "Drives": {"On": ("switch_drives", True), "Off": ("switch_drives", False)},
    "Clock": {name: ("set_clock", name) for name in ("real", "10x", "fast", "stepped")}
    | {"pause": ("pause",), "resume": ("pause", False)},
    "Advance (s)": {text: ("advance", float(text)) for text in ("0.002", "0.1", "1", "10")},
}
"""Groups of buttons: method of the backdoor and its values, by the word on the button."""

_RED, _GREEN, _GREY = "#c92a2a", "#2f9e44", "#8888"
_COLOURS = {">": "#1971c2", "#": "#868e96", "~": "#e8590c"}
_PAD = "padding:0 0.9em 0.4em;font-size:0.78em;line-height:1.3"
_LIST = "max-height:40vh;overflow:auto;display:flex;flex-direction:column-reverse;font-family:monospace"
_LAMP = "display:inline-block;margin:0.1em;padding:0 0.5em;border-radius:0.6em"


def acting(action: Callable[[Any], object]) -> Callable[[Any], None]:
    """Return a callback for viser that ignores values of the page, and shows a failure to the client."""

    def call(event: Any) -> None:
        if event.client is None:
            return
        try:
            action(event)
        except Exception as fault:  # noqa: BLE001 - of the robot, the backdoor, or at a browser's message
            notify(event.client, str(fault) or type(fault).__name__)

    return call


class Readout:
    """Lamps, joints within their limits, and the TCP with its speed."""

    def __init__(self, gui: viser.GuiApi, robot: RobotDescription) -> None:
        self._robot = robot
        self._html: Any = gui.add_html("")
        self._before: Snapshot | None = None
        self._speed_mm_s = 0.0

    def show(self, state: Snapshot, fault: str = "", before: Snapshot | None = None) -> None:
        """Show a state below the reason for which there is no newer one.

        The speed counts from the state `before`, by default the one that was shown last.
        """
        robot, status, gripper, load_kg = self._robot, state.robot_status, state.gripper, state.tool_load[0]
        force_n = dist(state.cartesian_force[:3], (0, 0, 0))
        lit = [
            ("AUTO", status.mode == 2),
            ("DRIVES", status.drives_powered == 1),
            ("MOVING", status.in_motion == 1),
            (f"FORCE {force_n:.0f} N", force_n >= LEAST_N),
        ]
        if gripper is not None:
            lit += [(f"GRIPPER {gripper.state} {gripper.opening_mm:.0f} mm", gripper.state == "holds")]
        words = [robot.name, f"mode {state.mode}", state.status] + [f"load {load_kg:g} kg"] * bool(load_kg)
        error = f"{state.error.code} {state.error.reason}" if state.error.code else ""
        limits = zip(robot.joints, state.joint_position, robot.position_min, robot.position_max, strict=True)
        bars = "".join(_bar(name, *map(degrees, values)) for name, *values in limits)
        place = _rounded((*state.tool_frame[:3], *map(degrees, state.tool_frame[3:])))
        if before is state:  # the first of a recording
            self._speed_mm_s = 0.0
        before, self._before = before or self._before or state, state
        if state.time_s > before.time_s:
            distance_mm = dist(state.tool_frame[:3], before.tool_frame[:3])
            self._speed_mm_s = distance_mm / (state.time_s - before.time_s)
        self._html.content = (
            f"<div style='{_PAD}'><div>{html.escape(', '.join(words))}</div>{lamps(lit)}"
            f"<div style='color:{_RED}'>{html.escape(fault)}</div>"
            f"<div style='color:{_RED}'>{html.escape(error)}</div>"
            f"<table style='width:100%;border-spacing:0'>{bars}</table>"
            f"<div>TCP {place} mm, deg<br>Speed of the TCP {self._speed_mm_s:.0f} mm/s</div></div>"
        )


class Panel:
    """A robot in the scene, and the elements of it, which can act until `stop`."""

    def __init__(self, server: viser.ViserServer, station: Station, scene: Scene, box: Any) -> None:
        """`box` is the folder that these elements are in."""
        self._gui = gui = server.gui
        self._station, self.scene, self.box = station, scene, box
        self._held_until_s = self._next_s = 0.0
        self._stop: Any = gui.add_button(STOP, color="red")
        self._stop.on_click(acting(lambda _: station.backdoor.emergency_stop()))
        self._group("Safety")
        self._readout = Readout(gui, station.robot)
        tabs: Any = gui.add_tab_group()
        with tabs.add_tab("Jog"):
            self._jog = Jog(gui, station)
        with tabs.add_tab("Program"):
            self._override: Any = gui.add_slider("Override (%)", 0, 100, 1, initial_value=100)
            self._sets(self._override, lambda value: station.backdoor.set_override(value / 100.0))
            gui.add_button("Stop the moves").on_click(acting(lambda _: station.command("stop")))
            self._moves: Any = gui.add_html("")
            for label in ("Drives", "Clock", "Advance (s)"):
                self._group(label)
        with tabs.add_tab("I/O"):
            self._outputs: Any = gui.add_html("")
            self._inputs: list[Any] = [
                gui.add_checkbox(name, False) for name in station.cell["inputs"][:MOST_INPUTS]
            ]
            for number, switch in enumerate(self._inputs, 1):
                self._sets(switch, partial(station.backdoor.set_input, number))
        with tabs.add_tab("Force"):
            self._force: Any = gui.add_html("")
            self._push = Push(server, station, scene)
        with tabs.add_tab("Dialogue"):
            with gui.add_form(None) as form:
                self._command: Any = gui.add_text("Command", "", hint="such as get status; Enter sends it")
            form.on_submit(acting(self._send))
            self._dialogue: Any = gui.add_html("")

    def leave(self, client: Any) -> None:
        """End jogging and pushing of a client that is gone."""
        self._jog.leave(client)
        self._push.leave(client)

    def stop(self) -> None:
        """End jogging and pushing for good, and connections."""
        self._jog.stop()
        self._push.leave()
        self._station.stop()

    def draw(self, is_open: bool) -> None:
        """Draw the newest state, if a browser has the page open."""
        (self._station.wanted.set if is_open else self._station.wanted.clear)()
        if is_open:
            self.scene.show(self._station.state, self._station.cell)

    def show(self) -> None:
        """Show the newest state on the panel, with faults of the backdoor."""
        station, state, now_s = self._station, self._station.state, time.monotonic()
        if now_s < self._next_s:
            return
        self._next_s = now_s + PERIOD_S
        self._readout.show(state, station.fault)
        pressed = state.robot_status.e_stopped == 1
        self._stop.label, self._stop.color = (STOPPED, "orange") if pressed else (STOP, "red")
        if now_s >= self._held_until_s:
            self._override.value = round(100.0 * state.override)
            for switch, on in zip(self._inputs, state.inputs, strict=False):
                switch.value = on
        self._moves.content = listed([f"Clock: {station.clock}", f"Moves that run or wait: {station.moves}"])
        outputs = lamps(zip(station.cell["outputs"], state.outputs, strict=False))
        self._outputs.content = f"<div style='{_PAD}'>{outputs}</div>"
        force, torque = _rounded(state.cartesian_force[:3]), _rounded(state.cartesian_force[3:])
        rows = [f"Fx Fy Fz {force} N", f"Tx Ty Tz {torque} Nm", f"Joints {_rounded(state.joint_torque)} Nm"]
        self._force.content = listed(rows)
        self._dialogue.content = dialogue(list(station.dialogue))

    def _send(self, event: Any) -> None:
        command, self._command.value = " ".join(self._command.value.split()), ""
        if command:
            reply = self._station.command(command)
            event.client.add_notification("Reply", reply, auto_close_seconds=NOTE_S)

    def _sets(self, element: Any, act: Callable[[Any], object]) -> None:
        """Have an element call a function with the value that a viewer sets."""

        def changed(_: Any) -> None:
            self._held_until_s = time.monotonic() + HOLD_S
            act(element.value)

        element.on_update(acting(changed))

    def _group(self, label: str) -> None:
        def act(event: Any) -> None:
            method, *values = GROUPS[label][event.target.value]
            getattr(self._station.backdoor, method)(*values)

        self._gui.add_button_group(label, tuple(GROUPS[label])).on_click(acting(act))


def lamps(states: Iterable[tuple[str, bool]]) -> str:
    """Return names as HTML, each lit or not."""
    return "".join(
        f"<span style='{_LAMP};background:{_GREEN if on else _GREY};color:#fff'>{html.escape(name)}</span>"
        for name, on in states
    )


def dialogue(lines: Iterable[DialogueLine | Line]) -> str:
    """Return lines, the newest one first, as HTML with the newest one at the bottom."""
    rows = []
    for line in lines:
        client = line.session.rpartition(":")[2]  # the port
        reason = f" ({line.reason})" if line.reason else ""
        colour = _RED if reason else _COLOURS.get(line.mark, "inherit")
        text = html.escape(f"{line.time_s:.3f} {client} {line.mark} {line.text}{reason}")
        rows.append(f"<div style='color:{colour}'>{text}</div>")
    return f"<div style='{_PAD};{_LIST}'>{''.join(rows)}</div>"


def _bar(name: str, value: float, low: float, high: float) -> str:
    """Return a row with a joint within its limits (deg)."""
    meter = (
        f"<meter style='width:9em' min={low:.1f} max={high:.1f} low={low + NEAR_DEG:.1f}"
        f" high={high - NEAR_DEG:.1f} optimum=0 value={value:.2f}></meter>"
    )
    cells = (html.escape(name), f"{low:.0f}", meter, f"{high:.0f}", f"{round(value, 2) + 0.0:.2f}")
    return f"<tr>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"


def listed(rows: Iterable[str]) -> str:
    """Return rows of text as HTML."""
    return f"<div style='{_PAD}'>{'<br>'.join(map(html.escape, rows))}</div>"


def _rounded(values: Iterable[float]) -> str:
    return " ".join(f"{round(value, 1) + 0.0:.1f}" for value in values)

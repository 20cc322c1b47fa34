"""The panel beside the picture: a pendant for one robot, and its dialogue."""

from __future__ import annotations

import html
import time
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from math import degrees, dist
from typing import TYPE_CHECKING, Any

from iiwa_sim.controller.state import Snapshot
from iiwa_sim.dialogue import DialogueLine
from iiwa_sim.recordings.schemas import Spoken
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.view.connection import NOTE_S, Station, tell
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
LONGEST_STEP_S = 10.0
NEAR_DEG = 5.0
"""Distance from a limit at which the bar of a joint is yellow."""
STOP, STOPPED = "Emergency stop", "Emergency stop is PRESSED"
Calls = dict[str, tuple[Any, ...]]
"""Method of the backdoor and its values, by the word on a button."""

SAFETY: Calls = {
    "Release": ("emergency_stop", False),
    "Reset error": ("reset_error",),
    "Protective stop": ("fail", 3060, "protective stop"),
}
DRIVES: Calls = {"On": ("switch_drives", True), "Off": ("switch_drives", False)}
CLOCKS: Calls = {name: ("set_clock", name) for name in ("real", "10x", "fast", "stepped")}
CLOCKS |= {"pause": ("pause",), "resume": ("pause", False)}

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
            tell(event.client, str(fault) or type(fault).__name__)

    return call


class Readout:
    """Lamps, joints within their limits, and the TCP with its speed."""

    def __init__(self, gui: viser.GuiApi, robot: RobotDescription) -> None:
        self._robot = robot
        self._html: Any = gui.add_html("")
        self._before: Snapshot | None = None
        self._speed_mm_s = 0.0

    def show(self, state: Snapshot, fault: str = "") -> None:
        """Show a state below the reason for which there is no newer one."""
        robot, status, gripper, load_kg = self._robot, state.robot_status, state.gripper, state.tool_load[0]
        lit = [
            ("AUTO", status.mode == 2),
            ("DRIVES", status.drives_powered == 1),
            ("MOVING", status.in_motion == 1),
            ("FORCE", dist(state.cartesian_force[:3], (0, 0, 0)) >= LEAST_N),
        ]
        if gripper is not None:
            lit += [(f"GRIPPER {gripper.state} {gripper.opening_mm:.0f} mm", gripper.state == "holds")]
        words = [robot.name, state.mode, state.status] + ([f"load {load_kg:g} kg"] if load_kg else [])
        red = [fault, "E-STOP pressed" if status.e_stopped == 1 else ""]
        red += [f"{state.error.code} {state.error.reason}" if state.error.code else ""]
        limits = zip(robot.joints, state.joint_position, robot.position_min, robot.position_max, strict=True)
        bars = "".join(_bar(name, *map(degrees, values)) for name, *values in limits)
        place = _rounded((*state.tool_frame[:3], *map(degrees, state.tool_frame[3:])))
        self._html.content = (
            f"<div style='{_PAD}'><div>{html.escape(', '.join(words))}</div>{lamps(lit)}"
            f"<div style='color:{_RED}'>{'<br>'.join(html.escape(each) for each in red if each)}</div>"
            f"<table style='width:100%;border-spacing:0'>{bars}</table>"
            f"<div>TCP {place} mm, deg<br>Speed of the TCP {self._speed(state):.0f} mm/s</div></div>"
        )

    def _speed(self, state: Snapshot) -> float:
        """Return the mean speed of the TCP (mm/s) since the state that was shown before."""
        before, self._before = self._before, state
        if before is not None and state.time_s != before.time_s:
            distance_mm = dist(state.tool_frame[:3], before.tool_frame[:3])
            self._speed_mm_s = max(distance_mm / (state.time_s - before.time_s), 0.0)
        return self._speed_mm_s


class Panel:
    """Elements of one robot, which can act until `leave`."""

    def __init__(self, server: viser.ViserServer, station: Station, scene: Scene) -> None:
        self._gui = gui = server.gui
        self._station = station
        self._held_until_s = self._next_s = 0.0
        self._stop: Any = gui.add_button(STOP, color="red")
        self._stop.on_click(self._does("emergency_stop"))
        self._group("Safety", SAFETY)
        self._readout = Readout(gui, station.robot)
        has_driver = station.place.driver is not None
        tabs: Any = gui.add_tab_group()
        self._jog = None
        if has_driver:
            with tabs.add_tab("Jog"):
                self._jog = Jog(gui, station)
        with tabs.add_tab("Program"):
            self._add_program(has_driver)
        with tabs.add_tab("I/O"):
            self._outputs: Any = gui.add_html("")
            names = station.cell["inputs"][:MOST_INPUTS]
            self._inputs = [self._add_input(number, name) for number, name in enumerate(names, 1)]
        with tabs.add_tab("Force"):
            self._force: Any = gui.add_html("")
            self._push = Push(server, station, scene)
        with tabs.add_tab("Dialogue"):
            if has_driver:
                self._add_command()
            self._dialogue: Any = gui.add_html("")

    def leave(self, client: Any = None) -> None:
        """End jogging and pushing of a client that is gone; without a client, of all for good."""
        if self._jog is not None and client is not None:
            self._jog.leave(client)
        elif self._jog is not None:
            self._jog.stop()
        self._push.leave(client)

    def show(self) -> None:
        """Show the newest state, and what the backdoor tells."""
        station, state, now_s = self._station, self._station.state, time.monotonic()
        self._push.show()
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
        self._outputs.content = lamps(zip(station.cell["outputs"], state.outputs, strict=False))
        force, torque = _rounded(state.cartesian_force[:3]), _rounded(state.cartesian_force[3:])
        rows = [f"Fx Fy Fz {force} N", f"Tx Ty Tz {torque} Nm", f"Joints {_rounded(state.joint_torque)} Nm"]
        self._force.content = listed(rows)
        self._dialogue.content = dialogue(list(station.said))

    def _add_program(self, has_driver: bool) -> None:
        gui, station = self._gui, self._station
        self._override: Any = gui.add_slider("Override (%)", min=0, max=100, step=1, initial_value=100)
        self._override.on_update(self._does("set_override", lambda: float(self._override.value) / 100.0))
        if has_driver:
            gui.add_button("Stop the moves").on_click(acting(lambda _: station.command("stop")))
        self._group("Drives", DRIVES)
        self._moves: Any = gui.add_html("")
        self._group("Clock", CLOCKS)
        step_s: Any = gui.add_number("Advance (s)", 0.1, min=0.001, max=LONGEST_STEP_S, step=0.001)
        step = self._does("advance", lambda: float(step_s.value))
        gui.add_button("Advance", hint="lets this time pass at once, with any clock").on_click(step)

    def _add_input(self, number: int, name: str) -> Any:
        switch: Any = self._gui.add_checkbox(name, False)
        switch.on_update(self._does("set_input", partial(int, number), lambda: switch.value))
        return switch

    def _add_command(self) -> None:
        with self._gui.add_form(None) as form:
            command: Any = self._gui.add_text("Command", "", hint="such as get status; Enter sends it")

        def send(event: Any) -> None:
            line, command.value = " ".join(command.value.split()), ""
            if line:
                reply = self._station.command(line)
                event.client.add_notification("Reply", reply, auto_close_seconds=NOTE_S)

        form.on_submit(acting(send))

    def _does(self, method: str, *values: Callable[[], Any]) -> Callable[[Any], None]:
        """Return a callback that calls a method of the backdoor with values."""

        def act(_: Any) -> None:
            self._held_until_s = time.monotonic() + HOLD_S
            self._station.act(method, *(value() for value in values))

        return acting(act)

    def _group(self, label: str, calls: Calls) -> None:
        group = self._gui.add_button_group(label, tuple(calls))
        group.on_click(acting(lambda event: self._station.act(*calls[event.target.value])))


def lamps(states: Iterable[tuple[str, bool]]) -> str:
    """Return names as HTML, each lit or not."""
    return "".join(
        f"<span style='{_LAMP};background:{_GREEN if on else _GREY};color:#fff'>{html.escape(name)}</span>"
        for name, on in states
    )


def dialogue(lines: Iterable[DialogueLine | Spoken]) -> str:
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


def listed(rows: Sequence[str]) -> str:
    """Return rows of text as HTML."""
    return f"<div style='{_PAD}'>{'<br>'.join(map(html.escape, rows))}</div>"


def _rounded(values: Iterable[float]) -> str:
    return " ".join(f"{round(value, 1) + 0.0:.1f}" for value in values)

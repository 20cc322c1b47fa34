"""The pendant: what the panel at a real robot has, and what a test bench adds. It asks the backdoor."""

from __future__ import annotations

import html
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from iiwa_sim.view.acting import acting
from iiwa_sim.view.readout import Readout

if TYPE_CHECKING:
    import viser

    from iiwa_sim.view.station import Station

MOST_INPUTS = 64
"""The largest number of inputs that are shown, as switches."""
HOLDS_S = 0.7
"""Time for which what a viewer has set stays, though the newest state does not show it yet."""
LONGEST_STEP_S = 60.0
STEP_ANSWER_S = 30.0
"""Real time in which the ticks of a step are made."""

SAFETY = {
    "Release": "release emergency stop",
    "Reset error": "reset error",
    "Protective stop": "protective stop",
}
DRIVES = {"On": "drives on", "Off": "drives off"}
CLOCKS = {name: f"set clock : {name}" for name in ("real", "10x", "fast", "stepped")}
TIME = {"Pause": "pause", "Resume": "resume"}


_LAMP = "display:inline-block;margin:0.15em;padding:0 0.5em;border-radius:0.6em;font-size:0.8em"
_LIT, _DARK = "background:#2f9e44;color:#fff", "background:#8884"


class Pendant:
    """Buttons and switches of one robot, in the panel."""

    def __init__(self, gui: viser.GuiApi, station: Station) -> None:
        self._gui = gui
        self._station = station
        self._held_until_s = 0.0
        self._inputs: list[Any] = []
        self._lamps = ""
        self.tabs: Any = None
        """Where there is room for more."""
        self.stop: Callable[[Any], None] = acting(lambda _: station.stop_moves())
        """Stops the robot, at an event: as an emergency stop where there is a backdoor."""
        if station.bench is None:
            gui.add_button(
                "Stop", color="red", hint="the robot stops, and forgets the moves that wait"
            ).on_click(self.stop)
            self._readout = Readout(gui)
            return
        self.stop = self._does(lambda _: "emergency stop")
        gui.add_button("Emergency stop", color="red", hint="Ctrl-E, too").on_click(self.stop)
        self._group("Safety", SAFETY)
        self._readout = Readout(gui)
        self.tabs = gui.add_tab_group()
        with self.tabs.add_tab("Pendant"):
            self._switches()

    def _switches(self) -> None:
        gui = self._gui
        self._override: Any = gui.add_slider("Override", min=0.0, max=1.0, step=0.01, initial_value=1.0)
        self._override.on_update(self._does(lambda _: f"set override : {float(self._override.value):g}"))
        self._group("Drives", DRIVES)
        with gui.add_folder("Clock", expand_by_default=False):
            self._clock = gui.add_html("")
            self._clock_told = ""
            self._group("Pace", CLOCKS)
            self._group("Time", TIME)
            self._step_s = gui.add_number("Step (s)", 0.1, min=0.001, max=LONGEST_STEP_S, step=0.001)
            step = self._does(lambda _: f"advance : {float(self._step_s.value):g}", STEP_ANSWER_S)
            gui.add_button("Step", hint="makes the ticks of so much time, at any pace").on_click(step)
        with gui.add_folder("States", expand_by_default=False):
            self._known = gui.add_dropdown("State", ("start",))
            restore = self._does(lambda _: f"restore state : {self._known.value}")
            gui.add_button("Restore", hint="the robot is there at once; at rest only").on_click(restore)
            with gui.add_form(None) as form:
                self._new_name = gui.add_text("Keep as", "")
            form.on_submit(self._does(lambda _: f"save state : {_word(self._new_name.value)}"))
        self._ios = gui.add_folder("Inputs and outputs", expand_by_default=False)
        with self._ios:
            self._outputs = gui.add_html("")

    def show(self) -> None:
        """What the newest state says."""
        station, state = self._station, self._station.state
        self._readout.show(state, station.told, station.status.fault or station.fault)
        if state is None or station.bench is None:
            return
        if station.cell and len(self._inputs) != min(len(station.cell["inputs"]), MOST_INPUTS):
            self._add_inputs(station.cell["inputs"])
        if time.monotonic() >= self._held_until_s:
            self._override.value = round(state["override"], 3)
            for switch, on in zip(self._inputs, state["inputs"], strict=False):
                switch.value = on
        if station.states and tuple(station.states) != tuple(self._known.options):
            self._known.options = tuple(station.states)
        self._clock_told = _changed(self._clock, self._clock_told, _said(f"Clock: {station.clock}"))
        lamps = _lamps(station.cell.get("outputs", ()), state["outputs"])
        self._lamps = _changed(self._outputs, self._lamps, lamps)

    def _does(self, line: Callable[[Any], str], timeout_s: float | None = None) -> Callable[[Any], None]:
        """A callback that has the line of an event carried out by the backdoor."""

        def act(event: Any) -> None:
            self._held_until_s = time.monotonic() + HOLDS_S
            self._station.act(line(event), timeout_s)

        return acting(act)

    def _group(self, label: str, lines: dict[str, str]) -> None:
        group = self._gui.add_button_group(label, tuple(lines))
        group.on_click(self._does(lambda event: lines[event.target.value]))

    def _add_inputs(self, names: Sequence[str]) -> None:
        for switch in self._inputs:
            switch.remove()
        self._inputs = []
        with self._ios:
            for number, name in enumerate(names[:MOST_INPUTS], 1):
                switch = self._gui.add_checkbox(name, False)
                switch.on_update(self._does(partial(_switched, number)))
                self._inputs.append(switch)


def _switched(number: int, event: Any) -> str:
    return f"set input : {number} {int(event.target.value)}"


def _changed(handle: Any, before: str, now: str) -> str:
    """What is shown now: it is sent only if that is something else."""
    if now != before:
        handle.content = now
    return now


def _said(text: str) -> str:
    return f'<p style="margin:0.3em 0.9em;font-size:0.85em">{html.escape(text)}</p>'


def _lamps(names: Sequence[str], states: Sequence[bool]) -> str:
    """Outputs: lit, or not."""
    lamps = "".join(
        f'<span style="{_LAMP};{_LIT if on else _DARK}">{html.escape(name)}</span>'
        for name, on in zip(names, states, strict=False)
    )
    return f'<div style="padding:0.3em 0.9em">{lamps}</div>'


def _word(text: str) -> str:
    """A name as a line can have it: what a line cannot have is refused by the backdoor, not guessed here."""
    return " ".join(text.split())

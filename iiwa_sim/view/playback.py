"""A recording on the page, with a time slider, the dialogue and the events."""

from __future__ import annotations

import socket
import threading
import time
from math import ceil
from typing import TYPE_CHECKING, Any

from iiwa_sim.recordings.read import Timeline
from iiwa_sim.recordings.schemas import CELL, DIALOGUE, EVENTS, STATE
from iiwa_sim.view.access import open_page
from iiwa_sim.view.app import add_surroundings, run_frames
from iiwa_sim.view.connection import MOST_LINES
from iiwa_sim.view.panel import Readout, acting, dialogue, listed
from iiwa_sim.view.scene import Scene

if TYPE_CHECKING:
    import viser

PERIOD_S = 0.2
"""Period of updates of dialogue and events."""
MOST_EVENTS = 30
SLIDER_STEP_S = 0.01
LONGEST_S = 0.5
"""Longest time of the viewer between two pictures that playing makes up for."""
SPEEDS = ("0.1x", "0.25x", "0.5x", "1x", "2x", "5x", "10x")
"""Times of the robot in a second of the viewer."""


def run_playback(listening: socket.socket, timeline: Timeline, over: threading.Event) -> None:
    """Show a recording on a page, as `iiwa_sim.view.app.run_page` shows robots. Raises RobotFault."""
    with open_page(listening) as (server, ready):
        playback = Playback(server, timeline)
        ready.set()
        run_frames(server, over, playback.show)


class Playback:
    """A recording in the scene, and its panel."""

    def __init__(self, server: viser.ViserServer, timeline: Timeline) -> None:
        gui, robot = server.gui, timeline.recorded.description()
        self._timeline, self._time_s = timeline, timeline.start_s  # that is shown
        steps = max(ceil((timeline.end_s - timeline.start_s) / SLIDER_STEP_S), 1)
        self._end_s = round(timeline.start_s + steps * SLIDER_STEP_S, 9)
        self._is_playing, self._shown_at_s, self._next_s = False, 0.0, 0.0
        self._slider: Any = gui.add_slider(
            "Time (s)", timeline.start_s, self._end_s, SLIDER_STEP_S, initial_value=timeline.start_s
        )
        self._slider.on_update(acting(self._seek))
        self._button: Any = gui.add_button("Play")
        self._button.on_click(acting(self._turn))
        self._speed: Any = gui.add_dropdown("Speed", SPEEDS, initial_value="1x")
        self._readout = Readout(gui, robot)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Dialogue"):
            self._dialogue: Any = gui.add_html("")
        with tabs.add_tab("Events"):
            self._events: Any = gui.add_html("")
        self._scene = Scene(server.scene, robot)
        self.show(is_open=True)
        add_surroundings(server, [self._scene], lambda: self._scene)

    def show(self, is_open: bool) -> None:
        """Show the recording at the time that the player has reached, if a browser has the page open."""
        if not is_open:
            return
        now_s, timeline = time.monotonic(), self._timeline
        if self._is_playing:
            passed_s = float(self._speed.value.rstrip("x")) * min(now_s - self._shown_at_s, LONGEST_S)
            self._time_s = min(self._time_s + passed_s, self._end_s)
            self._is_playing = self._time_s < self._end_s
            self._slider.value = round(self._time_s, 2)
        self._shown_at_s = now_s
        self._button.label = "Pause" if self._is_playing else "Play"
        states = timeline.last(STATE, self._time_s, 2)
        (cell,) = timeline.last(CELL, self._time_s)
        self._scene.show(states[-1], cell)
        self._readout.show(states[-1], before=states[0])
        if now_s >= self._next_s:
            self._next_s = now_s + PERIOD_S
            self._dialogue.content = dialogue(reversed(timeline.last(DIALOGUE, self._time_s, MOST_LINES)))
            events = timeline.last(EVENTS, self._time_s, MOST_EVENTS)
            self._events.content = listed(f"{each.time_s:.3f} {each}" for each in reversed(events))

    def _seek(self, _: Any) -> None:
        self._time_s = float(self._slider.value)

    def _turn(self, _: Any) -> None:
        """Play or pause; at the end, play from the beginning."""
        self._is_playing = not self._is_playing
        if self._is_playing and self._time_s >= self._end_s:
            self._time_s = self._timeline.start_s

"""A recording on the page, with a time slider, the dialogue and the events."""

from __future__ import annotations

import html
import socket
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from iiwa_sim.controller.state import Snapshot
from iiwa_sim.dialogue import RecentLine
from iiwa_sim.recordings.read import Timeline
from iiwa_sim.recordings.schemas import CELL, DIALOGUE, EVENTS, Event
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.server.token import Token
from iiwa_sim.view.access import open_page
from iiwa_sim.view.app import Shown, add_surroundings, run_frames
from iiwa_sim.view.connection import MOST_SAID
from iiwa_sim.view.panel import Readout, acting, dialogue
from iiwa_sim.view.scene import Scene

if TYPE_CHECKING:
    import viser

LINES_S = 0.4
"""Period of updates of dialogue and events."""
MOST_EVENTS = 30
SLIDER_STEP_S = 0.01
LONGEST_S = 0.5
"""Longest time of the viewer between two pictures that playing makes up for."""
SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0)
"""Times of the robot in a second of the viewer."""


def run_playback(
    listening: socket.socket,
    timeline: Timeline,
    over: threading.Event,
    token: Token | None = None,
    opened: Callable[[], None] = lambda: None,
) -> None:
    """Show a recording on a page, as `iiwa_sim.view.app.run_page` shows robots. Raises RobotFault."""
    robot = timeline.recorded.description()
    with open_page(listening, token) as server:
        playback = Playback(server, timeline, robot)
        opened()
        run_frames(server, over, lambda is_open: playback.show() if is_open else None)


class Playback:
    """A recording in the scene, and its panel."""

    def __init__(self, server: viser.ViserServer, timeline: Timeline, robot: RobotDescription) -> None:
        self._timeline = timeline
        self.time_s = timeline.start_s
        """The time that is shown."""
        self._is_playing, self._speed = False, 1.0
        self.scene = Scene(server.scene, robot)
        self._shown_at_s = time.monotonic()
        self._listed_s, self._next_list_s = -1.0, 0.0
        gui = server.gui
        self._slider: Any = gui.add_slider(
            "Time (s)",
            min=timeline.start_s,
            max=max(timeline.end_s, timeline.start_s + SLIDER_STEP_S),
            step=SLIDER_STEP_S,
            initial_value=timeline.start_s,
        )
        self._button: Any = gui.add_button("Play")
        speeds = tuple(f"{speed:g}x" for speed in SPEEDS)
        speed: Any = gui.add_dropdown("Speed", speeds, initial_value="1x")
        self._readout = Readout(gui, robot)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Dialogue"):
            self._dialogue: Any = gui.add_html("")
        with tabs.add_tab("Events"):
            self._events: Any = gui.add_html("")
        shown: Shown = lambda: [(self.scene, self._state())]  # noqa: E731
        add_surroundings(server, shown, shown)
        self._slider.on_update(acting(lambda _: self.go_to(float(self._slider.value))))
        self._button.on_click(acting(lambda _: self._turn()))
        speed.on_update(acting(lambda _: setattr(self, "_speed", float(speed.value.rstrip("x")))))

    def show(self) -> None:
        """Show the recording at the time that the player has reached."""
        was_playing, now_s = self._is_playing, time.monotonic()
        if was_playing:
            self.go_to(self.time_s + self._speed * min(now_s - self._shown_at_s, LONGEST_S))
            self._is_playing = self.time_s < self._timeline.end_s
        self._shown_at_s = now_s
        time_s = self.time_s
        self.scene.show_cell(self._timeline.last(CELL, time_s)[0])
        self.scene.show(self._state())
        self._readout.show(self._state())
        self._button.label = "Pause" if self._is_playing else "Play"
        if was_playing:
            self._slider.value = round(time_s, 2)
        if time_s != self._listed_s and now_s >= self._next_list_s:
            self._listed_s, self._next_list_s = time_s, now_s + LINES_S
            lines = self._timeline.last(DIALOGUE, time_s, MOST_SAID)
            recent = [
                RecentLine(each.time_s, each.session, each.direction, each.text, each.reason)
                for each in lines
            ]
            self._dialogue.content = dialogue(reversed(recent))
            self._events.content = _listed(self._timeline.last(EVENTS, time_s, MOST_EVENTS))

    def _state(self) -> Snapshot:
        return self._timeline.state_at(self.time_s)

    def go_to(self, time_s: float) -> None:
        """Be at a time, or at the nearest there is."""
        self.time_s = min(max(time_s, self._timeline.start_s), self._timeline.end_s)

    def _turn(self) -> None:
        self._is_playing = not self._is_playing
        if self._is_playing and self.time_s >= self._timeline.end_s:
            self.time_s = self._timeline.start_s


def _listed(events: list[Event]) -> str:
    """Return events as HTML, the newest one first."""
    rows = []
    for event in reversed(events):
        move, code = event.move or "", f"({event.code})" if event.code else ""
        words = " ".join(f"{event.time_s:.3f} {event.kind} {move} {code}".split())
        rows.append(html.escape(f"{words}: {event.text}"))
    return f"<div style='font-size:0.75em;padding:0 0.9em'>{'<br>'.join(rows)}</div>"

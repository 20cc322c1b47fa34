"""A recording on the page: the robot as it was, with a time line, the dialogue and what happened."""

from __future__ import annotations

import html
import logging
import socket
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from iiwa_sim.recordings.player import SPEEDS, Player
from iiwa_sim.recordings.read import Timeline
from iiwa_sim.server.token import Token
from iiwa_sim.throttle import Throttle
from iiwa_sim.view import trail
from iiwa_sim.view.acting import acting
from iiwa_sim.view.dialogue import MOST, DialogueList
from iiwa_sim.view.drawing import Drawing
from iiwa_sim.view.page import open_page
from iiwa_sim.view.readout import Readout
from iiwa_sim.view.scene import Scene

if TYPE_CHECKING:
    import viser

FRAME_S = 1.0 / 30.0
IDLE_S = 0.1
"""Time between two looks whether somebody has opened the page."""
LINES_EVERY_S = 0.4
MOST_EVENTS = 30
SLIDER_STEP_S = 0.01
JUMP_S = 0.5
"""More simulated time than that between two frames is no playing, but a jump."""
PATH_STATES = 60
"""How many states before a jump's end the path is drawn through."""
PLAY, PAUSE = "Play", "Pause"
STEPS = {"Tick back": -1, "Tick forward": 1}

logger = logging.getLogger(__name__)


def run_playback(
    listening: socket.socket,
    timeline: Timeline,
    over: threading.Event,
    token: Token | None = None,
    opened: Callable[[], None] = lambda: None,
) -> None:
    """Show a recording on a page at a socket that listens, until `over` is set.

    Browsers have to tell the `token`, if there is one. `opened` is called when it serves. Raises
    RobotFault, before that, for a robot that cannot be drawn.
    """
    drawing = drawing_of(timeline)
    told = Throttle[str](1)
    with open_page(listening, token) as server:
        server.initial_camera.position, server.initial_camera.look_at = (1.4, -1.3, 1.0), (0.35, 0.1, 0.4)
        server.scene.add_grid(
            "/ground", width=4.0, height=4.0, cell_size=0.1, section_size=1.0, position=(0.0, 0.0, -0.002)
        )
        playback = Playback(server, timeline, drawing)
        opened()
        before_s = time.monotonic()
        while not over.is_set():
            began_s = time.monotonic()
            if server.get_clients():
                try:
                    with server.atomic():
                        playback.frame(began_s - before_s)
                except Exception as fault:
                    if told.count("frame", time.monotonic_ns()) is not None:
                        logger.exception("the page cannot show a state: %s", fault)
                over.wait(max(FRAME_S - (time.monotonic() - began_s), 0.0))
            else:
                over.wait(IDLE_S)
            before_s = began_s


def drawing_of(timeline: Timeline) -> Drawing:
    """What the arm of a recording looks like. Raises RobotFault."""
    urdf = timeline.head.attachments.get("robot.urdf", b"").decode("utf-8", "replace")
    return Drawing.of_urdf(urdf, timeline.head.joints, timeline.head.metadata.get("flange", ""))


class Playback:
    """A recording in the scene, and what steers it."""

    def __init__(self, server: viser.ViserServer, timeline: Timeline, drawing: Drawing) -> None:
        self._timeline = timeline
        self._player = Player(timeline.start_s, timeline.end_s)
        self._scene = Scene(server.scene, drawing)
        self._robot = {"name": timeline.head.metadata.get("robot", ""), "joints": timeline.head.joints}
        self._tick_s = 1.0 / timeline.head.tick_rate_hz
        self._cell: dict[str, Any] = {}
        self._steps = threading.Lock()
        self._shown_s = timeline.start_s
        self._lines_at_s: float | None = None  # of the recording: the lines that are shown
        self._next_lines_s = 0.0
        gui = server.gui
        self._slider: Any = gui.add_slider(
            "Time (s)",
            min=timeline.start_s,
            max=max(timeline.end_s, timeline.start_s + SLIDER_STEP_S),
            step=SLIDER_STEP_S,
            initial_value=timeline.start_s,
        )
        self._button: Any = gui.add_button(PLAY)
        step = gui.add_button_group("Step", tuple(STEPS))
        self._speed: Any = gui.add_dropdown(
            "Speed", tuple(f"{speed:g}x" for speed in SPEEDS), initial_value="1x"
        )
        self._readout = Readout(gui)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Dialogue"):
            self._dialogue = DialogueList(gui)
        with tabs.add_tab("Events"):
            self._events: Any = gui.add_html("")
        self._slider.on_update(acting(lambda _: self._player.go_to(float(self._slider.value))))
        self._button.on_click(acting(lambda _: self._turn()))
        step.on_click(acting(lambda event: self._step(STEPS[event.target.value])))
        self._speed.on_update(acting(lambda _: self._set_speed()))

    def frame(self, real_s: float) -> None:
        """Show where the recording is after so much time of the viewer."""
        player = self._player
        was_playing = player.playing
        player.passes(real_s)
        time_s = player.time_s
        state = self._timeline.state_at(time_s)
        cell = self._timeline.cell_at(time_s)
        if cell != self._cell:
            self._cell = cell
            self._scene.show_cell(cell)
        self._show_path(time_s)
        self._scene.show(state)
        self._readout.show(state, self._robot)
        self._show_lines(time_s)
        label = PAUSE if player.playing else PLAY
        if self._button.label != label:
            self._button.label = label
        if was_playing and abs(self._slider.value - time_s) > SLIDER_STEP_S:
            self._slider.value = round(time_s, 2)

    def _show_path(self, time_s: float) -> None:
        """Show, after a jump, the path of the last seconds."""
        before_s, self._shown_s = self._shown_s, time_s
        if not before_s <= time_s <= before_s + JUMP_S:
            for state in self._timeline.states(time_s - trail.SECONDS, time_s, PATH_STATES):
                self._scene.show(state)

    def _show_lines(self, time_s: float) -> None:
        now_s = time.monotonic()
        if time_s != self._lines_at_s and now_s >= self._next_lines_s:
            self._next_lines_s = now_s + LINES_EVERY_S
            self._lines_at_s = time_s
            self._dialogue.clear()
            said = self._timeline.said(time_s, MOST)
            self._dialogue.add([{**line, "mark": line["direction"]} for line in said])
            self._events.content = _listed(self._timeline.happened(time_s, MOST_EVENTS))
        self._dialogue.show()

    def _turn(self) -> None:
        if self._player.playing:
            self._player.pause()
        else:
            self._player.play()

    def _step(self, ticks: int) -> None:
        with self._steps:  # clicks come in threads of their own
            self._player.pause()
            self._player.go_to(self._timeline.state_at(self._player.time_s)["time_s"] + ticks * self._tick_s)
            self._slider.value = round(self._player.time_s, 2)

    def _set_speed(self) -> None:
        self._player.speed = float(self._speed.value.rstrip("x"))


def _listed(events: list[dict[str, Any]]) -> str:
    """Events as HTML, the newest first."""
    rows = []
    for event in reversed(events):
        move = f" {event['move']}" if event["move"] else ""
        code = f" ({event['code']})" if event["code"] else ""
        told = html.escape(f"{event['kind']}{move}{code}: {event['text']}")
        rows.append(f"<tr><td>{event['time_s']:.3f}</td><td>{told}</td></tr>")
    rows = rows or ["<tr><td>none until this instant</td></tr>"]
    return f'<div style="font-size:0.75em;padding:0 0.9em"><table>{"".join(rows)}</table></div>'

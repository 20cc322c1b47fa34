"""The live page: robots in a scene with a panel, drawn 30 times a second while a browser has it open."""

from __future__ import annotations

import logging
import socket
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial
from math import ceil, sin, sqrt, tan
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.controller.state import Snapshot
from iiwa_sim.frames import IDENTITY, Frame, Transform, Vector, compose
from iiwa_sim.server.token import Token
from iiwa_sim.throttle import Throttle
from iiwa_sim.view.access import open_page
from iiwa_sim.view.connection import Place, Station
from iiwa_sim.view.panel import Panel, acting
from iiwa_sim.view.scene import Scene

if TYPE_CHECKING:
    import viser

FRAME_S, IDLE_S = 1.0 / 30.0, 0.1
"""Period of pictures, and of the check whether a browser has the page open."""
MOST_ROBOTS = 24
MOST_STATES_HZ = 120.0
"""States per second that the page asks for, of all robots together."""
APART_M, NAME_M = 2.5, 1.4
"""Distance between robots, and height of their names."""
PANEL_PX = 320.0
MARGIN, LEAST_RADIUS_M, TCP_RADIUS_M = 1.15, 0.55, 0.25
BESIDE_M = 0.12
"""Thickness of links beside the points that a picture is fitted to."""
NARROW = 0.8
"""Width over height of a window in which the panel lies over the lower part of the picture."""
VIEWS = {
    "Fit": (1.05, -1.4, 0.6),
    "Front": (1.0, 0.0, 0.15),
    "Side": (0.0, -1.0, 0.15),
    "Top": (0.001, 0.0, 1.0),
    "TCP": (1.0, -1.0, 0.5),
}
"""Directions from the robot to the camera."""

logger = logging.getLogger(__name__)


def run_page(
    listening: socket.socket,
    places: Sequence[Place],
    over: threading.Event,
    token: Token | None = None,
    opened: Callable[[], None] = lambda: None,
) -> None:
    """Show robots on a page at a socket that listens, until `over` is set.

    Browsers have to send the token, if there is one. `opened` is called when the page serves. Raises
    StationFault if nobody answers at an address, and RobotFault for a robot that cannot be drawn.
    """
    if len(places) > MOST_ROBOTS:
        logger.warning("the page shows the first %d of %d robots", MOST_ROBOTS, len(places))
    shown = places[:MOST_ROBOTS]
    stations = [Station(place, max(FRAME_S, len(shown) / MOST_STATES_HZ)) for place in shown]
    with ExitStack() as running:
        server = running.enter_context(open_page(listening, token))
        page = _Page(server, stations)
        for station in stations:
            station.start()
            running.callback(station.stop)
        for panel in page.panels:
            running.enter_context(panel)
        opened()
        run_frames(server, over, page.show)


def run_frames(server: viser.ViserServer, over: threading.Event, draw: Callable[[bool], None]) -> None:
    """Call `draw` for each picture until `over` is set, with True if a browser has the page open."""
    throttle = Throttle[str](1)
    while not over.is_set():
        began_s, is_open = time.monotonic(), bool(server.get_clients())
        try:
            with server.atomic():
                draw(is_open)
        except Exception as fault:
            if throttle.count("frame", time.monotonic_ns()) is not None:
                logger.exception("the page cannot show a state: %s", fault)
        over.wait(max((FRAME_S if is_open else IDLE_S) - (time.monotonic() - began_s), 0.0))


def add_ground(scene: viser.SceneApi, size_m: float = 4.0) -> None:
    """Add a grid of 0.5 m that fades."""
    colours: dict[str, Any] = {"cell_color": (225, 225, 228), "section_color": (205, 205, 210)}
    scene.add_grid(
        "/ground", size_m, size_m, cell_size=0.5, section_size=1.0, position=(0, 0, -0.002),
        fade_distance=3.0 * size_m, fade_from="origin", **colours,
    )  # fmt: skip


def add_views(gui: viser.GuiApi, shown: Callable[[], tuple[Scene, Snapshot]]) -> None:
    """Add buttons that put the camera of a client in front of a scene."""
    group: Any = gui.add_button_group("Camera", tuple(VIEWS))

    def turn(event: Any) -> None:
        (scene, state), name = shown(), event.target.value
        if name == "TCP":
            look_at(event.client, scene.tcp()[None], VIEWS[name], TCP_RADIUS_M)
        else:
            look_at(event.client, scene.points(state.joint_position), VIEWS[name])

    group.on_click(acting(turn))


def look_at(
    client: Any, points: NDArray[np.float64], towards: Vector, least_m: float = LEAST_RADIUS_M
) -> None:
    """Put the camera of a client so that points (n, 3; m) fill the picture beside the panel.

    `towards` is the direction from the points to the camera, `least_m` the least radius around the points.
    """
    camera = client.camera
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    radius = max(float(np.linalg.norm(points - middle, axis=1).max()) + BESIDE_M, least_m)
    width_px = max(float(camera.image_width), 1.0)
    free = 1.0 if camera.aspect < NARROW else max(1.0 - PANEL_PX / width_px, 0.3)
    half = 0.5 * min(camera.fov, camera.fov * camera.aspect * free)
    distance = MARGIN * radius / sin(half)
    back = np.array(towards) / np.linalg.norm(towards)
    right = np.cross((0.0, 0.0, 1.0), back)
    right /= np.linalg.norm(right)
    height_m = 2.0 * distance * tan(0.5 * camera.fov)  # of the picture, at the points
    if camera.aspect < NARROW:
        target = middle - 0.2 * height_m * np.cross(back, right)
    else:
        target = middle + 0.5 * (1.0 - free) * height_m * camera.aspect * right
    with client.atomic():
        camera.position = target + distance * back  # which moves the point it looks at
        camera.look_at = target


class _Page:
    """Robots in rows, and the panel of the one that is chosen."""

    def __init__(self, server: viser.ViserServer, stations: Sequence[Station]) -> None:
        self._stations = stations
        self._chosen = 0
        cells = list(dict.fromkeys(station.place.status for station in stations))
        row, several = ceil(sqrt(len(cells))), len(stations) > 1
        add_ground(server.scene, 4.0 + 2.0 * APART_M * (row - 1))
        self._scenes: list[Scene] = []
        self._boxes: list[Any] = []
        self.panels: list[Panel] = []
        self._choice: Any = None
        if several:
            self._choice = server.gui.add_dropdown("Robot", tuple(station.name for station in stations))
            self._choice.on_update(acting(self._choose))
        for number, station in enumerate(stations):
            spot = cells.index(station.place.status)
            apart = Transform(IDENTITY.rotation, (APART_M * (spot // row), APART_M * (spot % row), 0.0))
            place = compose(apart, Frame(*station.place.base).to_transform())
            scene = Scene(server.scene, station.robot, f"/robots/{number}", place)
            self._scenes.append(scene)
            if several:
                server.scene.add_label(f"{scene.root}/name", station.name, position=(0.0, 0.0, NAME_M))
                for _, handle in scene.handles:
                    handle.on_click(acting(partial(self._enter, number)))
            self._boxes.append(server.gui.add_folder(None, visible=number == 0) if several else ExitStack())
            with self._boxes[-1]:
                self.panels.append(Panel(server, station, scene))
        add_views(server.gui, self._shown)
        command = server.gui.add_command("Emergency stop", hotkey="E", modifier="cmd/ctrl")
        command.on_trigger(self._stop)
        server.on_client_connect(self._welcome)
        server.on_client_disconnect(self._leave)

    def show(self, is_open: bool) -> None:
        """Draw the newest states, if a browser has the page open."""
        for station, scene in zip(self._stations, self._scenes, strict=True):
            station.want(is_open)
            if is_open:
                first = next(each for each in self._stations if each.place.status == station.place.status)
                scene.show_cell(station.cell, station is first)
                scene.show(station.state)
        if is_open:
            self.panels[self._chosen].show()

    def _stop(self, event: Any) -> None:
        self.panels[self._chosen].stop(event)

    def _leave(self, client: Any) -> None:
        for panel in self.panels:
            panel.leave(client)

    def _shown(self) -> tuple[Scene, Snapshot]:
        return self._scenes[self._chosen], self._stations[self._chosen].state

    def _welcome(self, client: Any) -> None:
        """Show a new client all robots."""
        shown = zip(self._scenes, self._stations, strict=True)
        points = [scene.points(station.state.joint_position) for scene, station in shown]
        look_at(client, np.concatenate(points), VIEWS["Fit"])

    def _choose(self, event: Any) -> None:
        self._enter([station.name for station in self._stations].index(self._choice.value), event)

    def _enter(self, number: int, event: Any) -> None:
        """Show the panel of a robot, and the robot."""
        self._chosen = number
        self._choice.value = self._stations[number].name
        for place, box in enumerate(self._boxes):
            box.visible = place == number
        scene, state = self._shown()
        look_at(event.client, scene.points(state.joint_position), VIEWS["Fit"])

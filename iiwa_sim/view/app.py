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

from iiwa_sim.frames import IDENTITY, Frame, Transform, compose
from iiwa_sim.log import Throttle
from iiwa_sim.server.token import Token
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
"""Distance between cells, and height of names of robots."""
PANEL_PX = 320.0
MARGIN, LEAST_RADIUS_M = 1.15, 0.55
BESIDE_M = 0.12
"""Thickness of links beside the points that a picture is fitted to."""
VIEWS = {
    "Fit": (1.05, -1.4, 0.6),
    "Front": (1.0, 0.0, 0.15),
    "Side": (0.0, -1.0, 0.15),
    "Top": (0.001, 0.0, 1.0),
}
"""Directions from the robot to the camera."""

logger = logging.getLogger(__name__)


def run_page(
    listening: socket.socket, places: Sequence[Place], over: threading.Event, token: Token | None = None
) -> None:
    """Show robots on a page at a socket that listens, until `over` is set.

    Browsers have to send the token, if there is one. Raises OSError if nobody answers at an address, and
    RobotFault for a robot that cannot be drawn.
    """
    if len(places) > MOST_ROBOTS:
        logger.warning("the page shows the first %d of %d robots", MOST_ROBOTS, len(places))
    shown = places[:MOST_ROBOTS]
    stations = [Station(place, max(FRAME_S, len(shown) / MOST_STATES_HZ)) for place in shown]
    with ExitStack() as running:
        server, ready = running.enter_context(open_page(listening, token))
        page = _Page(server, stations)
        for station, panel in zip(stations, page.panels, strict=True):
            running.callback(station.stop)
            running.callback(panel.leave)
        ready.set()
        run_frames(server, over, page.show)


def run_frames(server: viser.ViserServer, over: threading.Event, draw: Callable[[bool], None]) -> None:
    """Call `draw` for each picture until `over` is set, with True if a browser has the page open."""
    throttle = Throttle(1)
    while not over.is_set():
        began_s, is_open = time.monotonic(), bool(server.get_clients())
        try:
            with server.atomic():
                draw(is_open)
        except Exception as fault:
            if throttle.count("frame", time.monotonic_ns()) is not None:
                logger.exception("the page cannot show a state: %s", fault)
        over.wait(max((FRAME_S if is_open else IDLE_S) - (time.monotonic() - began_s), 0.0))


def add_surroundings(
    server: viser.ViserServer, scenes: Sequence[Scene], chosen: Callable[[], Scene], size_m: float = 4.0
) -> None:
    """Add a calm grid, and buttons that put the camera of a client in front of a robot.

    A new client sees all `scenes`.
    """
    colours: dict[str, Any] = {"cell_color": (225, 225, 228), "section_color": (205, 205, 210)}
    server.scene.add_grid(
        "/ground", size_m, size_m, cell_size=0.5, section_size=1.0, position=(0, 0, -0.002),
        fade_distance=3.0 * size_m, fade_from="origin", **colours,
    )  # fmt: skip
    group: Any = server.gui.add_button_group("Camera", tuple(VIEWS))
    group.on_click(acting(lambda event: look_at(event.client, chosen().points(), group.value)))
    server.on_client_connect(
        lambda client: look_at(client, np.concatenate([each.points() for each in scenes]))
    )


def look_at(client: Any, points: NDArray[np.float64], view: str = "Fit") -> None:
    """Put the camera of a client so that points (n, 3; m) fill the picture beside the panel."""
    camera = client.camera
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    radius = max(float(np.linalg.norm(points - middle, axis=1).max()) + BESIDE_M, LEAST_RADIUS_M)
    free = max(1.0 - PANEL_PX / max(float(camera.image_width), 1.0), 0.3)
    distance = MARGIN * radius / sin(0.5 * min(camera.fov, camera.fov * camera.aspect * free))
    back = np.array(VIEWS[view]) / np.linalg.norm(VIEWS[view])
    right = np.cross((0.0, 0.0, 1.0), back)
    right /= np.linalg.norm(right)
    width_m = 2.0 * distance * tan(0.5 * camera.fov) * camera.aspect  # of the picture, at the points
    target = middle + 0.5 * (1.0 - free) * width_m * right
    with client.atomic():
        camera.position = target + distance * back  # which moves the point it looks at
        camera.look_at = target


class _Page:
    """Robots in rows, and the panel of the one that is chosen."""

    def __init__(self, server: viser.ViserServer, stations: Sequence[Station]) -> None:
        self._stations = stations
        self._chosen = 0
        cells = list(dict.fromkeys(station.place.backdoor for station in stations))
        row, several = ceil(sqrt(len(cells))), len(stations) > 1
        self._scenes: list[Scene] = []
        self._boxes: list[Any] = []
        self.panels: list[Panel] = []
        if several:
            self._choice: Any = server.gui.add_dropdown("Robot", tuple(each.name for each in stations))
            self._choice.on_update(
                acting(lambda event: self._enter(self._choice.options.index(self._choice.value), event))
            )
        for number, station in enumerate(stations):
            cell = cells.index(station.place.backdoor)
            apart = Transform(IDENTITY.rotation, (APART_M * (cell // row), APART_M * (cell % row), 0.0))
            place = compose(apart, Frame(*station.place.base).to_transform())
            is_first = all(each.place.backdoor != station.place.backdoor for each in stations[:number])
            scene = Scene(server.scene, station.robot, f"/robots/{number}", place, is_first)
            self._scenes.append(scene)
            if several:
                server.scene.add_label(f"{scene.root}/name", station.name, position=(0.0, 0.0, NAME_M))
                for _, handle in scene.handles:
                    handle.on_click(acting(partial(self._enter, number)))
            self._boxes.append(server.gui.add_folder(None, visible=number == 0))
            with self._boxes[-1]:
                self.panels.append(Panel(server, station, scene))
        size_m = 4.0 + 2.0 * APART_M * (row - 1)
        self._draw()
        add_surroundings(server, self._scenes, lambda: self._scenes[self._chosen], size_m)
        server.on_client_disconnect(self._leave)

    def show(self, is_open: bool) -> None:
        """Draw the newest states, if a browser has the page open."""
        for station in self._stations:
            station.want(is_open)
        if is_open:
            self._draw()
            self.panels[self._chosen].show()

    def _draw(self) -> None:
        for station, scene in zip(self._stations, self._scenes, strict=True):
            scene.show(station.state, station.cell)

    def _leave(self, client: Any) -> None:
        for panel in self.panels:
            panel.leave(client)

    def _enter(self, number: int, event: Any) -> None:
        """Show the panel of a robot, and the robot."""
        self._chosen = number
        self._choice.value = self._stations[number].name
        for place, box in enumerate(self._boxes):
            box.visible = place == number
        look_at(event.client, self._scenes[number].points())

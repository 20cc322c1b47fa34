"""The live page: robots in a scene with a panel, drawn 30 times a second while a browser has it open.

`iiwa_sim.cli.serve` starts it as a process, writes its settings as JSON to stdin, and closes that at the end.
"""

from __future__ import annotations

import os
import socket
import sys
import threading
import time
from collections.abc import Callable, Sequence
from functools import partial
from math import ceil, sin, sqrt, tan
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from iiwa_sim import log
from iiwa_sim.frames import IDENTITY, Frame, Transform, compose
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
VIEWS = {"Fit": (1.05, -1.4, 0.6), "Front": (1, 0, 0.15), "Side": (0, -1, 0.15), "Top": (0.001, 0, 1)}
"""Directions from the robot to the camera."""


def main() -> None:
    """Serve until stdin ends."""
    task = msgspec.json.decode(sys.stdin.buffer.readline())
    log.configure(task["log_level"], task["log_json"])
    over = threading.Event()

    def wait() -> None:
        os.read(0, 1)  # nothing comes but the end
        over.set()

    threading.Thread(target=wait, daemon=True).start()
    token, places = task["token"], msgspec.convert(task["places"], list[Place])
    run_page(socket.socket(fileno=task["listening"]), places, over, token and Token(token))


def run_page(
    listening: socket.socket, places: Sequence[Place], over: threading.Event, token: Token | None = None
) -> None:
    """Show robots on a page at a socket that listens, until `over` is set.

    Browsers have to send the token, if there is one. Raises OSError if nobody answers at an address, and
    RobotFault for a robot that cannot be drawn.
    """
    places = places[:MOST_ROBOTS]
    period_s = max(FRAME_S, len(places) / MOST_STATES_HZ)
    with open_page(listening, token) as (server, ready):
        page = _Page(server, [Station(place, period_s) for place in places])
        ready.set()
        try:
            run_frames(server, over, page.show)
        finally:
            page.stop()


def run_frames(server: viser.ViserServer, over: threading.Event, draw: Callable[[bool], None]) -> None:
    """Call `draw` for each picture until `over` is set, with True if a browser has the page open."""
    while not over.is_set():
        began_s, is_open = time.monotonic(), bool(server.get_clients())
        with server.atomic():
            draw(is_open)
        over.wait(max((FRAME_S if is_open else IDLE_S) - (time.monotonic() - began_s), 0.0))


def add_surroundings(server: viser.ViserServer, scenes: Sequence[Scene], chosen: Callable[[], Scene]) -> None:
    """Add a calm grid, and buttons that put the camera of a client in front of a robot.

    A new client sees all `scenes`.
    """
    colours: dict[str, Any] = {"cell_color": (225, 225, 228), "section_color": (205, 205, 210)}
    server.scene.add_grid(
        "/ground", infinite_grid=True, fade_distance=12.0, position=(0, 0, -0.002), **colours
    )
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
        self._names = [each.place.name for each in stations]
        cells = list(dict.fromkeys(each.place.backdoor for each in stations))
        row, several = ceil(sqrt(len(cells))), len(stations) > 1
        self._choice: Any = server.gui.add_dropdown("Robot", self._names, visible=several)
        self._choice.on_update(acting(lambda event: self._enter(self._choice.value, event)))
        self._scenes: list[Scene] = []
        self._boxes: list[Any] = []
        self._panels: list[Panel] = []
        shown = set()
        for number, station in enumerate(stations):
            name, backdoor = station.place.name, station.place.backdoor
            cell = cells.index(backdoor)
            apart = Transform(IDENTITY.rotation, (APART_M * (cell // row), APART_M * (cell % row), 0.0))
            place = compose(apart, Frame(*station.place.base).to_transform())
            scene = Scene(server.scene, station.robot, f"/robots/{number}", place, backdoor not in shown)
            shown.add(backdoor)
            scene.show(station.state, station.cell)
            self._scenes.append(scene)
            if several:
                server.scene.add_label(f"{scene.root}/name", name, position=(0.0, 0.0, NAME_M))
                for handle in scene.handles:
                    handle.on_click(acting(partial(self._enter, name)))
            self._boxes.append(server.gui.add_folder(None, visible=number == 0))
            with self._boxes[-1]:
                self._panels.append(Panel(server, station, scene))
        add_surroundings(server, self._scenes, lambda: self._scenes[self._chosen])
        for panel in self._panels:
            server.on_client_disconnect(panel.leave)

    def show(self, is_open: bool) -> None:
        """Draw the newest states, if a browser has the page open."""
        for station, scene in zip(self._stations, self._scenes, strict=True):
            (station.wanted.set if is_open else station.wanted.clear)()
            if is_open:
                scene.show(station.state, station.cell)
        if is_open:
            self._panels[self._chosen].show()

    def stop(self) -> None:
        """End what viewers do, and connections."""
        for panel, station in zip(self._panels, self._stations, strict=True):
            panel.stop()
            station.stop()

    @property
    def _chosen(self) -> int:
        return self._names.index(self._choice.value)

    def _enter(self, name: str, event: Any) -> None:
        """Show the panel of a robot, and the robot."""
        self._choice.value = name
        for place, box in enumerate(self._boxes):
            box.visible = place == self._chosen
        look_at(event.client, self._scenes[self._chosen].points())


if __name__ == "__main__":
    main()

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
from math import ceil, sin, sqrt, tan
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from iiwa_sim import log
from iiwa_sim.frames import IDENTITY, Frame, Transform, compose
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
"""States per second that the page requests, of all robots together."""
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
        os.read(0, 1)  # returns at the end of stdin
        over.set()

    threading.Thread(target=wait, daemon=True).start()
    token, places = task["token"], msgspec.convert(task["places"], list[Place])
    run_page(socket.socket(fileno=task["listening"]), places, over, token)


def run_page(
    listening: socket.socket, places: Sequence[Place], over: threading.Event, token: str | None = None
) -> None:
    """Show robots on a page at a socket that listens, until `over` is set.

    Browsers have to send the token, if there is one. Raises OSError if no server answers at an address, and
    RobotFault for a robot that cannot be drawn.
    """
    places = places[:MOST_ROBOTS]
    panels: list[Panel] = []
    names = [each.name for each in places]
    cells = list(dict.fromkeys(each.backdoor for each in places))
    row = ceil(sqrt(len(cells)))
    period_s = max(FRAME_S, len(places) / MOST_STATES_HZ)
    with open_page(listening, token) as (server, ready):
        choice: Any = server.gui.add_dropdown("Robot", names, visible=len(places) > 1)

        def chosen() -> Panel:
            return panels[names.index(choice.value)]

        def enter(event: Any) -> None:
            for panel in panels:
                panel.box.visible = panel is chosen()
            look_at(event.client, chosen().scene.points())

        def draw(is_open: bool) -> None:
            for panel in panels:
                panel.draw(is_open)
            if is_open:
                chosen().show()

        choice.on_update(acting(enter))
        for number, place in enumerate(places):
            x, y = divmod(cells.index(place.backdoor), row)
            apart = Transform(IDENTITY.rotation, (APART_M * x, APART_M * y, 0.0))
            pose = compose(apart, Frame(*place.base).to_transform())
            shows_cell = all(each.backdoor != place.backdoor for each in places[:number])
            station = Station(place, period_s)
            scene = Scene(server.scene, station.robot, f"/robots/{number}", pose, shows_cell)
            with (box := server.gui.add_folder(None, visible=number == 0)):
                panels.append(Panel(server, station, scene, box))
            if len(places) > 1:
                server.scene.add_label(f"{scene.root}/name", place.name, position=(0.0, 0.0, NAME_M))
            server.on_client_disconnect(panels[-1].leave)
        add_surroundings(server, [each.scene for each in panels], lambda: chosen().scene)
        draw(is_open=True)
        ready.set()
        try:
            run_frames(server, over, draw)
        finally:
            for panel in panels:
                panel.stop()


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


if __name__ == "__main__":
    main()

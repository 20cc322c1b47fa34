"""The robots of a page: their places in the scene, and the panel of the one that is chosen."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from functools import partial
from math import ceil, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from iiwa_sim.frames import Vector
from iiwa_sim.view.acting import acting
from iiwa_sim.view.panel import Panel

if TYPE_CHECKING:
    import viser

    from iiwa_sim.view.drawing import Drawing
    from iiwa_sim.view.station import Station

MOST = 24
"""Robots on one page; of a larger fleet the first ones."""
APART_M = 2.5
NAME_M = 1.4
"""Height at which the name of one of several stands."""
_CAMERA, _LOOK_AT = (1.4, -1.3, 1.0), (0.35, 0.1, 0.4)
_NARROW = 0.8
"""A window whose width is less of its height, as on a telephone: there the panel lies over its lower part."""
_NARROW_CAMERA, _NARROW_LOOK_AT = (2.1, -1.95, 0.9), (0.3, 0.15, -0.45)


def places_of(count: int) -> list[Vector]:
    """Where so many robots stand (m): in rows, the first at the origin."""
    in_a_row = ceil(sqrt(count))
    return [(APART_M * (number // in_a_row), APART_M * (number % in_a_row), 0.0) for number in range(count)]


class Hall:
    """Robots in a scene. Use it as a context, in which they can be pushed."""

    def __init__(
        self, server: viser.ViserServer, stations: Sequence[Station], drawings: Sequence[Drawing]
    ) -> None:
        self._stations = stations
        self._chosen = 0
        self._boxes: list[Any] = []
        self._choice: Any = None
        self._places = places_of(len(stations))
        self._pushing = ExitStack()
        several = len(stations) > 1
        size = 4.0 + max(self._places[-1][0], self._places[-1][1])
        server.scene.add_grid(
            "/ground",
            width=2.0 * size,
            height=2.0 * size,
            cell_size=0.1,
            section_size=1.0,
            position=(0.0, 0.0, -0.002),
        )
        farther = 1.0 + 0.8 * (size - 4.0)
        server.initial_camera.position = farther * np.array(_CAMERA)
        server.initial_camera.look_at = 0.5 * np.array(self._places[-1]) + _LOOK_AT
        for number, (station, drawing) in enumerate(zip(stations, drawings, strict=True)):
            root = f"/robots/{number}" if several else "/robot"
            station.draw(server.scene, drawing, root, self._places[number])
            if several:
                server.scene.add_label(f"{root}/name", station.name, position=(0.0, 0.0, NAME_M))
        if several:
            self._choice = server.gui.add_dropdown("Robot", tuple(station.name for station in stations))
            self._choice.on_update(acting(self._choose))
        self._panels = [self._panel(server, number) for number in range(len(stations))]
        server.on_client_connect(self._stand)
        command = server.gui.add_command("Emergency stop", hotkey="E", modifier="cmd/ctrl")
        command.on_trigger(self._stop)

    def __enter__(self) -> Hall:
        for panel in self._panels:
            self._pushing.enter_context(panel)
        return self

    def __exit__(self, *_: object) -> None:
        self._pushing.close()

    def frame(self) -> None:
        """Draw the newest states, and what the panel of the chosen robot says of its own."""
        for station in self._stations:
            station.frame()
        self._panels[self._chosen].show()

    def _panel(self, server: viser.ViserServer, number: int) -> Panel:
        station = self._stations[number]
        if self._choice is None:
            return Panel(server, station)
        box = server.gui.add_folder(None, visible=number == 0)
        self._boxes.append(box)
        assert station.scene is not None
        for link in station.scene.arm.links.values():
            link.on_click(acting(partial(self._clicked, number)))
        with box:
            return Panel(server, station)

    def _stand(self, client: viser.ClientHandle) -> None:
        """Have a viewer with a narrow window see the arm above the panel."""
        if len(self._stations) == 1 and client.camera.aspect < _NARROW:
            client.camera.position, client.camera.look_at = _NARROW_CAMERA, _NARROW_LOOK_AT

    def _stop(self, event: Any) -> None:
        self._panels[self._chosen].stop(event)

    def _choose(self, event: Any) -> None:
        names = [station.name for station in self._stations]
        self._enter(names.index(self._choice.value), event.client)

    def _clicked(self, number: int, event: Any) -> None:
        self._enter(number, event.client)

    def _enter(self, number: int, client: Any) -> None:
        """Have the panel of this robot, and look at it."""
        self._chosen = number
        self._choice.value = self._stations[number].name
        for place, box in enumerate(self._boxes):
            box.visible = place == number
        x, y, z = self._places[number]
        with client.atomic():
            client.camera.look_at = (x + _LOOK_AT[0], y + _LOOK_AT[1], z + _LOOK_AT[2])
            client.camera.position = (x + _CAMERA[0], y + _CAMERA[1], z + _CAMERA[2])

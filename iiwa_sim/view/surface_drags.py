"""Drag the surfaces of the cell elsewhere with the mouse, the Shift key held."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from iiwa_sim.view.acting import acting

if TYPE_CHECKING:
    from iiwa_sim.view.station import Station

EVERY_S = 0.1
"""Time between two moves of a surface that is dragged (s)."""
_PLACE, _TURN = ("x_mm", "y_mm", "z_mm"), ("alpha", "beta", "gamma")


class _Begun(NamedTuple):
    """Where a drag began."""

    mouse: Sequence[float]
    """Where the mouse took hold, in the scene (m)."""
    surface: dict[str, Any]
    """The surface, as the backdoor told it then."""


class SurfaceDrags:
    """Drags of all surfaces of a station, also those that come later."""

    def __init__(self, station: Station) -> None:
        self._station = station
        self._bound: dict[str, Any] = {}
        self._begun: dict[str, _Begun] = {}
        self._next_s = 0.0
        self._lock = threading.Lock()

    def show(self) -> None:
        """Have surfaces that are new in the scene take drags."""
        assert self._station.scene is not None
        for name, handle in self._station.scene.surfaces.handles.items():
            if self._bound.get(name) is not handle:
                self._bound[name] = handle
                handle.on_drag("left", modifier="shift")(acting(self._dragging(name)))

    def _dragging(self, name: str) -> Any:
        def dragged(event: Any) -> None:
            with self._lock:
                line = self._line(name, event)
            if line:
                self._station.act(line)

        return dragged

    def _line(self, name: str, event: Any) -> str:
        """The line that puts the surface where the mouse has it; empty where it is not time for that."""
        if event.phase == "start":
            told = next(
                (each for each in self._station.cell.get("surfaces", ()) if each["name"] == name), None
            )
            if told is not None:
                self._begun[name] = _Begun(event.start_position, told)
        begun, now_s = self._begun.get(name), time.monotonic()
        if begun is None or (event.phase == "update" and now_s < self._next_s):
            return ""
        self._next_s = now_s + EVERY_S
        if event.phase == "end":
            del self._begun[name]
        way = [1e3 * (b - a) for a, b in zip(begun.mouse, event.end_position, strict=True)]
        numbers = [begun.surface[key] + each for key, each in zip(_PLACE, way, strict=True)]
        numbers += [begun.surface[key] for key in _TURN]
        return f"move surface : {name} {' '.join(f'{each:.6g}' for each in numbers)}"

"""The path that the TCP has come in the last seconds, coloured by its speed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from iiwa_sim.frames import Vector
from iiwa_sim.view.drawing import Colour

if TYPE_CHECKING:
    import viser

SECONDS = 10.0
"""Simulated time that is shown."""
PIECE_S = 1.0
"""What is older is sent no more, and goes as a whole."""
SHORTEST_M = 0.001
LONGEST_M = 0.5
"""Longest way between two states: beyond that the robot has been put elsewhere."""
FAST_M_S = 1.0
"""Drawn red, as is what is faster."""
_SCALE: tuple[Colour, ...] = ((60, 90, 220), (50, 180, 120), (240, 200, 40), (220, 40, 40))


def colour_of(speed_m_s: float) -> Colour:
    """Blue at rest, by green and yellow to red."""
    place = min(max(speed_m_s / FAST_M_S, 0.0), 1.0) * (len(_SCALE) - 1)
    low = min(int(place), len(_SCALE) - 2)
    share = place - low
    red, green, blue = (round(a + share * (b - a)) for a, b in zip(_SCALE[low], _SCALE[low + 1], strict=True))
    return (red, green, blue)


class Trail:
    """Pieces of a line, of a second each: only the newest is sent again when the robot moves on."""

    def __init__(self, scene: viser.SceneApi, path: str) -> None:
        nothing = np.zeros((1, 2, 3), np.float32)
        self._pieces: list[Any] = [
            scene.add_line_segments(
                f"{path}/{number}",
                nothing,
                nothing.astype(np.uint8),
                thickness=3.0,
                thickness_units="screen",
                visible=False,
            )
            for number in range(int(SECONDS / PIECE_S) + 1)
        ]
        self._ends_s: list[float | None] = [None] * len(self._pieces)  # when each was added to; None: empty
        self._newest = 0
        self._begun_s = 0.0
        self._points: list[tuple[Vector, Vector]] = []
        self._colours: list[tuple[Colour, Colour]] = []
        self._last: tuple[float, Vector, Colour] | None = None

    def add(self, time_s: float, point: Vector) -> None:
        """The TCP is here (m) at this simulated time. Time that goes back, or a jump, begins anew."""
        if self._last is None or time_s < self._last[0]:
            self.clear()
            self._last = (time_s, point, _SCALE[0])
            return
        since, before, colour = self._last
        way = float(np.linalg.norm(np.subtract(point, before)))
        if time_s > since and way >= SHORTEST_M:
            faster = colour_of(way / (time_s - since))
            if way <= LONGEST_M:
                self._append(time_s, before, point, colour, faster)
            self._last = (time_s, point, faster)
        self._forget(time_s)

    def rest(self, time_s: float) -> None:
        """The TCP is where it was."""
        if self._last is not None and time_s >= self._last[0]:
            self._last = (time_s, self._last[1], _SCALE[0])
        self._forget(time_s)

    def clear(self) -> None:
        """Show none."""
        for number, piece in enumerate(self._pieces):
            if self._ends_s[number] is not None:
                piece.visible = False
                self._ends_s[number] = None
        self._points.clear()
        self._colours.clear()
        self._last = None

    def _append(self, time_s: float, start: Vector, end: Vector, before: Colour, after: Colour) -> None:
        if self._points and time_s - self._begun_s > PIECE_S:
            self._newest = (self._newest + 1) % len(self._pieces)
            self._points.clear()
            self._colours.clear()
        if not self._points:
            self._begun_s = time_s
        self._points.append((start, end))
        self._colours.append((before, after))
        piece = self._pieces[self._newest]
        piece.points = np.array(self._points, np.float32)
        piece.colors = np.array(self._colours, np.uint8)
        piece.visible = True
        self._ends_s[self._newest] = time_s

    def _forget(self, time_s: float) -> None:
        for number, end_s in enumerate(self._ends_s):
            if end_s is not None and time_s - end_s > SECONDS:
                self._pieces[number].visible = False
                self._ends_s[number] = None
                if number == self._newest:
                    self._points.clear()
                    self._colours.clear()

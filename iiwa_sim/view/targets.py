"""Where moves end that run or wait, in the scene: axes at each target, and the sphere it may blend in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from iiwa_sim.frames import Frame
from iiwa_sim.view.drawing import Colour, wxyz

if TYPE_CHECKING:
    import viser

COLOUR: Colour = (70, 130, 230)
OPACITY = 0.2
AXES_M = 0.05

Move = Mapping[str, Any]
"""A move, with the keys of the backdoor's `get moves`."""


class Targets:
    """Targets of one robot, below a node of the scene. What was drawn once is used again."""

    def __init__(self, scene: viser.SceneApi, root: str) -> None:
        self._scene = scene
        self._root = root
        self._shown: list[tuple[Sequence[float], float]] = []
        self._axes: list[Any] = []
        self._spheres: list[Any] = []

    def show(self, moves: Sequence[Move]) -> None:
        """Draw the targets of these moves, and no others."""
        wanted = [(tuple(move["goal_frame"]), float(move["blending_mm"])) for move in moves]
        if wanted == self._shown:
            return
        self._shown = list(wanted)
        while len(self._axes) < len(wanted):
            self._add()
        for number, (axes, sphere) in enumerate(zip(self._axes, self._spheres, strict=True)):
            there = number < len(wanted)
            blends = False
            if there:
                frame, blending_mm = wanted[number]
                pose = Frame(*frame).to_transform()
                axes.position, axes.wxyz = pose.translation, wxyz(pose.rotation)
                blends = blending_mm > 0.0
                if blends:
                    sphere.position, sphere.radius = pose.translation, 1e-3 * blending_mm
            _set_visible(axes, there)
            _set_visible(sphere, blends)

    def _add(self) -> None:
        path = f"{self._root}/{len(self._axes)}"
        self._axes.append(
            self._scene.add_frame(
                f"{path}/axes", axes_length=AXES_M, axes_radius=0.0015, origin_color=COLOUR, visible=False
            )
        )
        self._spheres.append(
            self._scene.add_icosphere(
                f"{path}/blending",
                radius=1.0,
                color=COLOUR,
                opacity=OPACITY,
                cast_shadow=False,
                receive_shadow=False,
                visible=False,
            )
        )


def _set_visible(handle: Any, visible: bool) -> None:
    if handle.visible != visible:
        handle.visible = visible

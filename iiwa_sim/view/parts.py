"""Parts in the scene: bodies that a gripper carries, or that lie where it left them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from iiwa_sim.frames import Frame
from iiwa_sim.view.drawing import wxyz

if TYPE_CHECKING:
    import viser

_COLOUR, _HELD = (215, 150, 65), (47, 158, 68)


class Parts:
    """A body for each part, below a node; green while it is held."""

    def __init__(self, scene: viser.SceneApi, root: str) -> None:
        self._scene = scene
        self._root = root
        self._told: Sequence[Mapping[str, Any]] = ()
        self._bodies: dict[str, Any] = {}
        self._numbers = 0

    def are(self, told: Sequence[Mapping[str, Any]]) -> None:
        """Show these parts, and no others, as the backdoor's `get cell` tells them."""
        if told == self._told:
            return
        self._told = told
        for body in self._bodies.values():
            body.remove()
        self._bodies = {str(part["name"]): self._added(part) for part in told}

    def show(self, states: Sequence[Mapping[str, Any]]) -> None:
        """Draw them where a state has them."""
        for state in states:
            body = self._bodies.get(state["name"])
            if body is not None:
                pose = Frame(*state["frame"]).to_transform()
                body.position, body.wxyz = pose.translation, wxyz(pose.rotation)
                body.color = _HELD if state["state"] == "held" else _COLOUR

    def _added(self, part: Mapping[str, Any]) -> Any:
        self._numbers += 1
        path = f"{self._root}/{self._numbers}"  # names may have anything in them
        if part["shape"] == "box":
            x_mm, y_mm, z_mm = part["size_mm"]
            return self._scene.add_box(
                path, dimensions=(1e-3 * x_mm, 1e-3 * y_mm, 1e-3 * z_mm), color=_COLOUR
            )
        if part["shape"] == "mesh":
            corners = 1e-3 * np.array(part["corners_mm"])
            faces = np.arange(len(corners)).reshape(-1, 3)
            return self._scene.add_mesh_simple(path, corners, faces, color=_COLOUR, side="double")
        radius_m = 1e-3 * part["radius_mm"]
        if part["shape"] == "sphere":
            return self._scene.add_icosphere(path, radius=radius_m, color=_COLOUR)
        return self._scene.add_cylinder(path, radius=radius_m, height=1e-3 * part["length_mm"], color=_COLOUR)

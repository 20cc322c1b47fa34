"""What is fixed to the flange, in the scene: the capsules of a tool, as one body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from iiwa_sim.frames import IDENTITY, Transform
from iiwa_sim.robot.capsules import Capsule
from iiwa_sim.robot.model import GREY, Shape
from iiwa_sim.view.drawing import Colour
from iiwa_sim.view.meshes import joined

if TYPE_CHECKING:
    import viser

_COLOUR: Colour = (112, 115, 122)


class Tool:
    """A body below the node of the flange, if the shape of a tool is told."""

    def __init__(self, scene: viser.SceneApi, flange: str) -> None:
        self._scene = scene
        self._path = f"{flange}/tool_body"
        self._told: Sequence[Mapping[str, Any]] = ()
        self._body: Any = None

    def are(self, capsules: Sequence[Mapping[str, Any]]) -> None:
        """Show these capsules, and no others, as the backdoor's `get cell` tells them."""
        if capsules == self._told:
            return
        self._told = capsules
        if self._body is not None:
            self._body.remove()
            self._body = None
        if capsules:
            points, _, faces, _ = joined([shape for each in capsules for shape in _shapes(each)])
            self._body = self._scene.add_mesh_simple(
                self._path, points.astype(np.float32), faces.astype(np.uint32), color=_COLOUR
            )


def _shapes(told: Mapping[str, Any]) -> list[Shape]:
    """A capsule as a cylinder with a ball at each end."""
    capsule = Capsule.of_tool((*told["start_mm"], *told["end_mm"], told["radius_mm"]))
    balls = [
        Shape("sphere", (capsule.radius_m,), Transform(IDENTITY.rotation, end), GREY)
        for end in (capsule.start, capsule.end)
    ]
    return [Shape("cylinder", (capsule.radius_m, capsule.length_m), capsule.pose, GREY), *balls]

"""The jaws of a gripper, in the scene: they move along y of the TCP, and their pads end there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from iiwa_sim.handling.gripper import JAW_M

if TYPE_CHECKING:
    import viser

_COLOUR, _HOLDING = (70, 72, 78), (47, 158, 68)


class Jaws:
    """Two bodies below the node of the TCP, from the first state with a gripper on; green while they hold."""

    def __init__(self, scene: viser.SceneApi, tcp: str) -> None:
        self._scene = scene
        self._tcp = tcp
        self._bodies: list[Any] = []

    def show(self, gripper: Mapping[str, Any] | None) -> None:
        """Draw them as a state tells of them; None for a robot without."""
        if gripper is None:
            return
        _, y, z = JAW_M
        if not self._bodies:
            names = [f"{self._tcp}/jaw_{number}" for number in (1, 2)]
            self._bodies = [self._scene.add_box(name, dimensions=JAW_M) for name in names]
        away = 5e-4 * gripper["opening_mm"] + 0.5 * y
        for side, body in zip((1.0, -1.0), self._bodies, strict=True):
            body.position = (0.0, side * away, -0.5 * z)
            body.color = _HOLDING if gripper["state"] == "holds" else _COLOUR

"""The jaws of a gripper, in the scene: they move along y of the TCP, and their pads end there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from iiwa_sim.world.gripper import JAW_M

if TYPE_CHECKING:
    import viser

_COLOUR, _HOLDING = (70, 72, 78), (47, 158, 68)


class Jaws:
    """Two bodies below the node of the TCP, from the first state with a gripper on; green while they hold."""

    def __init__(self, scene: viser.SceneApi, tcp: str) -> None:
        self._scene = scene
        self._tcp = tcp
        self._jaw_m = JAW_M
        self._bodies: list[Any] = []

    def are(self, jaw_mm: Sequence[float]) -> None:
        """So large is each, along x y z of the TCP, as the backdoor's `get cell` tells it; empty without a
        gripper, and where nobody tells it."""
        x, y, z = (1e-3 * each for each in jaw_mm) if len(jaw_mm) == 3 else JAW_M
        if (x, y, z) != self._jaw_m:
            self._jaw_m = (x, y, z)
            for body in self._bodies:
                body.remove()
            self._bodies = []

    def show(self, gripper: Mapping[str, Any] | None) -> None:
        """Draw them as a state tells of them; None for a robot without."""
        if gripper is None:
            return
        _, y, z = self._jaw_m
        if not self._bodies:
            names = [f"{self._tcp}/jaw_{number}" for number in (1, 2)]
            self._bodies = [self._scene.add_box(name, dimensions=self._jaw_m) for name in names]
        away = 5e-4 * gripper["opening_mm"] + 0.5 * y
        for side, body in zip((1.0, -1.0), self._bodies, strict=True):
            body.position = (0.0, side * away, -0.5 * z)
            body.color = _HOLDING if gripper["state"] == "holds" else _COLOUR

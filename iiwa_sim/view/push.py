"""A spring from the TCP to the mouse, for a viewer that drags the arm."""

from __future__ import annotations

import threading
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from iiwa_sim.frames import rotate, transpose
from iiwa_sim.view.connection import Station
from iiwa_sim.view.scene import Scene

if TYPE_CHECKING:
    import viser

STIFFNESS_N_PER_M, MOST_N = 400.0, 150.0
HELP = """\
Drag the arm: a spring of 400 N/m pulls the TCP. It follows in a stiffness move and in a gravity hold, such as
`linstiff move : 450 200 520 0 -1.57079 0 0.002 300 0 0 0 0 0 0` or `start gravity : 200`. Any other motion
continues."""


class Push:
    """Forces on one robot, by the thread that follows it."""

    def __init__(self, server: viser.ViserServer, station: Station, scene: Scene) -> None:
        self._station, self._scene = station, scene
        server.gui.add_markdown(HELP)
        self._client: Any = None
        """The client that drags the arm."""
        self._target = np.zeros(3)  # the other end of the spring, m in the base
        self._lock = threading.Lock()
        for handle in scene.handles:
            handle.on_drag("left")(self._dragged)
        station.after_state = self._push

    def leave(self, client: Any = None) -> None:
        """End the push, if there is one, of this client or of any."""
        with self._lock, suppress(OSError):
            if self._client is not None and client in (None, self._client):
                self._client = None
                self._station.backdoor.release()

    async def _dragged(self, event: Any) -> None:  # in viser's loop, in order
        if event.phase == "end":
            self.leave(event.client)
            return
        shift = np.subtract(event.end_position, event.start_position)  # of the point that the viewer drags
        tcp = self._station.state.tool_frame.to_transform().translation
        self._target = np.add(tcp, rotate(transpose(self._scene.place.rotation), shift.tolist()))
        self._client = event.client

    def _push(self) -> None:
        """Have the backdoor push with the force of the spring."""
        with self._lock:
            if self._client is not None:
                tcp = self._station.state.tool_frame.to_transform()
                force = STIFFNESS_N_PER_M * (self._target - tcp.translation)
                force *= min(1.0, MOST_N / max(float(np.linalg.norm(force)), MOST_N))
                force_in_tcp = rotate(transpose(tcp.rotation), force.tolist())
                self._station.backdoor.push((*force_in_tcp, 0.0, 0.0, 0.0))

"""The tab Force: a spring from the point of the arm that a viewer grabs to the mouse."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.controller.errors import Refused
from iiwa_sim.frames import Transform, Vector, apply, inverse
from iiwa_sim.recordings.scene import Arm
from iiwa_sim.view.connection import Station, tell
from iiwa_sim.view.scene import FORCE, Scene, line

if TYPE_CHECKING:
    import viser

STIFFNESS, LEAST_STIFFNESS, MOST_STIFFNESS = 400.0, 50.0, 2000.0
"""N/m"""
MOST_N, LEAST_M, STEP_RAD = 150.0, 1e-6, 1e-6
HELP = """\
Drag the arm: a spring pulls at it. It yields in a stiffness move and in a gravity hold, such as
`linstiff move : 450 200 520 0 -1.57079 0 0.002 300 0 0 0 0 0 0` or `start gravity : 200`. Any other motion
goes on."""

Array = NDArray[np.float64]


class Grabbed(NamedTuple):
    """A point of the arm that a viewer pulls at."""

    link: int
    """Index of the link."""
    point: Vector
    """The point in the frame of the link (m)."""
    target: Vector
    """The mouse in the base (m)."""
    client: Any


class Push:
    """Forces on one robot, by the thread that follows it."""

    def __init__(self, server: viser.ViserServer, station: Station, scene: Scene) -> None:
        self._station, self._scene = station, scene
        self._stiffness: Any = server.gui.add_slider(
            "Spring (N/m)", min=LEAST_STIFFNESS, max=MOST_STIFFNESS, step=50.0, initial_value=STIFFNESS
        )
        server.gui.add_markdown(HELP)
        self._grabbed: Grabbed | None = None
        self._force_n, self._pushes = 0.0, False
        self._lock = threading.Lock()
        self._line = line(server.scene, f"{scene.root}/push/spring", FORCE, 3.0)
        self._line.visible = False
        self._label: Any = server.scene.add_label(f"{scene.root}/push/force", "", visible=False)
        for index, handle in scene.handles:
            if scene.arm.links[index].moved_by:
                handle.on_drag("left")(self._dragging(index))
        station.after_states.append(self._push)

    def leave(self, client: Any = None) -> None:
        """End the push, if it is of this client."""
        grabbed = self._grabbed
        if grabbed is None or client is None or grabbed.client.client_id == client.client_id:
            self._grabbed = None
            with suppress(OSError):
                self._push()  # the station follows no longer if this was the last client

    def show(self) -> None:
        """Draw the spring and its force."""
        grabbed = self._grabbed
        self._line.visible = self._label.visible = grabbed is not None
        if grabbed is not None:
            point = apply(self._scene.poses[grabbed.link], grabbed.point)
            self._line.points = np.array([[point, grabbed.target]], np.float32)
            self._label.position = grabbed.target
            stiff = "" if self._station.state.mode == "impedance" else ", stiff: see Force"
            self._label.text = f"{self._force_n:.0f} N{stiff}"

    def _dragging(self, link: int) -> Any:
        async def dragged(event: Any) -> None:  # in viser's loop, in order
            ends = event.start_position, event.end_position
            start, target = (apply(inverse(self._scene.place), tuple(each)) for each in ends)
            grabbed = self._grabbed
            if event.phase == "end":
                self._grabbed = None
                return
            if grabbed is None or grabbed.link != link:
                point = apply(inverse(self._scene.poses[link]), start)
                grabbed = Grabbed(link, point, target, event.client)
            self._grabbed = grabbed._replace(target=target)

        return dragged

    def _push(self) -> None:
        """Have the backdoor push with the force of the spring, or end the push."""
        with self._lock:
            station, grabbed = self._station, self._grabbed
            if grabbed is None:
                if self._pushes:
                    station.act("release")
                    self._pushes = False
                return
            state, arm, link = station.state, self._scene.arm, grabbed.link
            point = apply(arm.poses(state.joint_position)[link], grabbed.point)
            stretch = np.subtract(grabbed.target, point)
            most = MOST_N / max(float(np.linalg.norm(stretch)), LEAST_M)
            force = np.asarray(min(float(self._stiffness.value), most) * stretch)
            self._pushes, self._force_n = True, float(np.linalg.norm(force))
            try:
                if arm.links[link].moved_by == len(state.joint_position):
                    station.act("push", wrench_at_tcp(state.tool_frame.to_transform(), point, force))
                else:
                    torques = joint_torques(arm, state.joint_position, link, grabbed.point, force)
                    station.act("push_joints", torques)
            except Refused as fault:
                self._grabbed = None
                tell(grabbed.client, f"no push: {fault}")


def wrench_at_tcp(tcp: Transform, point: Vector, force: Array) -> list[float]:
    """Return a force (N) at a point (m), both in the base, as a wrench at the TCP along its axes."""
    back = np.array(tcp.rotation).reshape(3, 3).T
    torque = np.cross(np.subtract(point, tcp.translation), force)
    return [*(back @ force).tolist(), *(back @ torque).tolist()]


def joint_torques(arm: Arm, joints: Sequence[float], link: int, point: Vector, force: Array) -> list[float]:
    """Return the torques on the joints (Nm) of a force (N in the base) at a point (m) in a link's frame.

    A torque is the force times the way of the point per angle of the joint, found by a small step.
    """
    start, torques = apply(arm.poses(joints)[link], point), []
    for joint in range(len(joints)):
        moved = [*joints[:joint], joints[joint] + STEP_RAD, *joints[joint + 1 :]]
        distance = np.subtract(apply(arm.poses(moved)[link], point), start)
        torques.append(float(force @ distance) / STEP_RAD)
    return torques

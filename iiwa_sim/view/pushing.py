"""Push the robot with the mouse: a spring from the point that is grabbed to where the mouse is."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Sequence
from math import hypot, isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from iiwa_sim.frames import Frame, Transform, Vector, apply, inverse, rotate, transpose
from iiwa_sim.throttle import Throttle
from iiwa_sim.view.acting import tell
from iiwa_sim.view.bench import Bench
from iiwa_sim.view.drawing import Drawing
from iiwa_sim.view.line_client import Refusal, Unanswered
from iiwa_sim.view.scene import State

if TYPE_CHECKING:
    import viser

    from iiwa_sim.view.station import Station

EVERY_S = 0.02
"""Time between two forces (s); in between a force is constant."""
STIFFNESS_N_PER_M = 400.0
LEAST_N_PER_M, MOST_N_PER_M = 50.0, 2000.0
STRONGEST_N = 150.0
"""The force does not grow beyond this, however far the mouse is."""

YIELDS = "impedance"
"""The mode of stiffness moves and gravity holds; in all others the robot is where its motion is."""

logger = logging.getLogger(__name__)


class Grabbed(NamedTuple):
    """A point of the arm that somebody pulls at."""

    link: int
    """Place of the link among those of the drawing."""
    point: Vector
    """Place of the point in the link's frame (m)."""
    target: Vector
    """Where the mouse is, in the base (m)."""
    client: Any


def cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def spring_force(start: Vector, end: Vector, n_per_m: float) -> Vector:
    """The force (N) of a spring from `start` to `end` (m), at most STRONGEST_N."""
    way = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
    length = hypot(*way)
    if not isfinite(length) or length == 0.0:
        return (0.0, 0.0, 0.0)
    scale = min(n_per_m, STRONGEST_N / length)
    return (scale * way[0], scale * way[1], scale * way[2])


def wrench_at_tcp(tcp: Transform, point: Vector, force: Vector) -> tuple[float, ...]:
    """A force (N, in the base) at a point (m, in the base) as a wrench at the TCP, along its axes."""
    arm = tuple(a - b for a, b in zip(point, tcp.translation, strict=True))
    back = transpose(tcp.rotation)
    return (*rotate(back, force), *rotate(back, cross((arm[0], arm[1], arm[2]), force)))


def joint_torques(
    drawing: Drawing, joints: Sequence[float], link: int, point: Vector, force: Vector
) -> list[float]:
    """The torques on the joints (Nm) that a force (N) at a point (m) of a link makes; both in the base."""
    torques = [0.0] * drawing.joint_count
    poses = drawing.poses(joints)
    place: int | None = link
    while place is not None:
        each = drawing.links[place]
        if each.joint is not None:
            axis, origin = rotate(poses[place].rotation, each.axis), poses[place].translation
            lever = cross((point[0] - origin[0], point[1] - origin[1], point[2] - origin[2]), force)
            torques[each.joint] = sum(a * b for a, b in zip(axis, lever, strict=True))
        place = each.parent
    return torques


def told(force_n: float, mode: str) -> str:
    """What stands beside the spring: its force, and why the robot stays where it is, if it does."""
    return f"{force_n:.0f} N" if mode == YIELDS else f"{force_n:.0f} N, stiff: see Push"


class Pushing:
    """Forces for one robot, in a thread of its own from `start` to `stop`."""

    def __init__(self, server: viser.ViserServer, station: Station) -> None:
        assert station.place.backdoor is not None
        assert station.scene is not None
        self._station = station
        self._drawing = station.scene.drawing
        self._place_m = station.scene.place_m
        self._lines = Bench(station.place.backdoor, station.place.token)
        station.ours.append(self._lines)
        self._last_joint = self._drawing.joint_count - 1
        self._stiffness: Any = server.gui.add_slider(
            "Spring (N/m)", min=LEAST_N_PER_M, max=MOST_N_PER_M, step=50.0, initial_value=STIFFNESS_N_PER_M
        )
        self._grabbed: Grabbed | None = None
        self._pull = threading.Event()
        self._over = False
        self._told = Throttle[str](1)
        self._force_n = 0.0
        root = station.scene.root
        self._line: Any = server.scene.add_line_segments(
            f"{root}/push/spring",
            np.zeros((1, 2, 3), np.float32),
            np.full((1, 2, 3), (230, 90, 20), np.uint8),
            thickness=3.0,
            thickness_units="screen",
            visible=False,
        )
        self._label: Any = server.scene.add_label(f"{root}/push/force", "", visible=False)
        for place, link in enumerate(self._drawing.links):
            if link.name in station.scene.arm.links and self._is_moved(place):
                station.scene.arm.links[link.name].on_drag("left")(self._dragging(place))
        self._thread = threading.Thread(target=self._run, name="iiwa-sim-pushes", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        """Push no more."""
        self._over = True
        self._grabbed = None
        self._pull.set()
        self._thread.join()
        self._lines.close()

    def show(self) -> None:
        """Draw the spring, and tell its force."""
        grabbed, state = self._grabbed, self._station.state
        if grabbed is None or state is None:
            if self._line.visible:
                self._line.visible = self._label.visible = False
            return
        point = self._point(grabbed, state)
        self._line.points = np.array([[point, grabbed.target]], np.float32)
        self._label.position = grabbed.target
        self._label.text = told(self._force_n, state["mode"])
        if not self._line.visible:
            self._line.visible = self._label.visible = True

    def _dragging(self, link: int) -> Any:
        async def dragged(event: Any) -> None:  # in viser's loop, one after the other
            state = self._station.state
            if state is None or event.phase == "end":
                self._grabbed = None
                return
            target = self._in_base(event.end_position)
            grabbed = self._grabbed
            if grabbed is None or grabbed.link != link:
                pose = self._drawing.poses(state["joint_position"])[link]
                point = apply(inverse(pose), self._in_base(event.start_position))
                grabbed = Grabbed(link, point, target, event.client)
            self._grabbed = grabbed._replace(target=target)
            self._pull.set()

        return dragged

    def _in_base(self, position: Sequence[float]) -> Vector:
        x, y, z = (float(a) - b for a, b in zip(position, self._place_m, strict=True))
        return (x, y, z)

    def _point(self, grabbed: Grabbed, state: State) -> Vector:
        return apply(self._drawing.poses(state["joint_position"])[grabbed.link], grabbed.point)

    def _run(self) -> None:
        while True:
            self._pull.wait()
            self._pull.clear()
            kind = ""
            while (grabbed := self._grabbed) is not None:
                kind = self._pushed(grabbed) or kind
                time.sleep(EVERY_S)
            if kind:
                self._say(kind, [0.0] * (6 if kind == "push" else self._drawing.joint_count), None)
            if self._over:
                return

    def _pushed(self, grabbed: Grabbed) -> str:
        """Push as the spring does now; the command by which it did."""
        state = self._station.state
        if state is None:
            return ""
        point = self._point(grabbed, state)
        force = spring_force(point, grabbed.target, float(self._stiffness.value))
        self._force_n = hypot(*force)
        if self._moves_all(grabbed.link):
            tcp = Frame(*state["tool_frame"]).to_transform()
            return self._say("push", wrench_at_tcp(tcp, point, force), grabbed.client)
        torques = joint_torques(self._drawing, state["joint_position"], grabbed.link, point, force)
        return self._say("push joints", torques, grabbed.client)

    def _moves_all(self, link: int | None) -> bool:
        """Whether all joints move a link: what pushes it is a wrench at the TCP."""
        while link is not None:
            if self._drawing.links[link].joint == self._last_joint:
                return True
            link = self._drawing.links[link].parent
        return False

    def _is_moved(self, link: int | None) -> bool:
        """Whether a joint moves a link."""
        while link is not None:
            if self._drawing.links[link].joint is not None:
                return True
            link = self._drawing.links[link].parent
        return False

    def _say(self, kind: str, numbers: Sequence[float], client: Any) -> str:
        try:
            self._lines.do(f"{kind} : {' '.join(f'{number:.3f}' for number in numbers)}")
        except (Refusal, Unanswered) as fault:
            if self._told.count("push", time.monotonic_ns()) is not None:
                if client is None:
                    logger.warning("page: a push could not be ended: %s", fault)
                else:
                    tell(client, "No push", str(fault))
        return kind

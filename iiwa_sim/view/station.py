"""One robot as the page has it: its connections, its newest state, and its place in the scene."""

from __future__ import annotations

import json
import logging
import threading
from collections import deque
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import msgspec

from iiwa_sim.frames import Frame, Vector
from iiwa_sim.robot.description import built_in_robots, load_robot
from iiwa_sim.server.listening import host_and_port
from iiwa_sim.view.bench import Bench
from iiwa_sim.view.drawing import Drawing
from iiwa_sim.view.line_client import ANSWER_S, Lines, Refusal, Unanswered
from iiwa_sim.view.scene import Scene, State
from iiwa_sim.view.status_reader import StatusReader
from iiwa_sim.wording import Unusable

if TYPE_CHECKING:
    import viser

LOOKS_S = 0.5
"""Time between two questions for what the status lines do not tell: the cell, the clock, the states."""
FIRST_LINE_S = 5.0
MOST_SAID = 200
SAME_PLACE_M = 1e-3
PAGE = "page"
"""Who speaks in the dialogue where something was done on the page."""

logger = logging.getLogger(__name__)


class StationFault(Unusable):
    """A robot that cannot be shown. The message is one line."""


class Place(msgspec.Struct, frozen=True, kw_only=True):
    """Where a robot is reached."""

    name: str = ""
    """Name of the robot, where it is one of several."""
    status: tuple[str, int]
    backdoor: tuple[str, int] | None = None
    token: str = ""
    """Token of the backdoor."""
    driver: tuple[str, int] | None = None
    """The port on which it speaks the iiwa's text protocol."""
    robot: str | None = None
    """Name or folder of the robot, where there is no backdoor to tell it."""


class Station:
    """A robot that is followed, from `start` to `stop`. `frame` is to be called from one thread."""

    def __init__(self, place: Place) -> None:
        self.place = place
        self.name = place.name
        self.status = StatusReader(place.status)
        self.bench = None if place.backdoor is None else Bench(place.backdoor, place.token)
        self._looks = None if place.backdoor is None else Bench(place.backdoor, place.token)
        self._waits = None if place.backdoor is None else Bench(place.backdoor, place.token)
        self.driver = None if place.driver is None else Lines(place.driver)
        self.ours = [lines for lines in (self.bench, self._looks, self._waits) if lines is not None]
        """The page's connections to the backdoor."""
        self.state: State | None = None
        """The newest one that has been drawn."""
        self.told: dict[str, Any] = {"joints": []}
        """What `get robot` tells."""
        self.cell: Mapping[str, Any] = {}
        self.clock = ""
        """What `get clock` tells."""
        self.states: list[str] = []
        self.said: deque[dict[str, Any]] = deque(maxlen=MOST_SAID)
        """Lines of the dialogue that have not been shown yet; who shows them takes them out."""
        self._said_next = 0
        self._acted: deque[tuple[str, str]] = deque(maxlen=MOST_SAID)  # lines, and why they were refused
        self.fault = ""
        """Why the robot is not reached; empty while it is."""
        self.scene: Scene | None = None
        self._shown_cell: Mapping[str, Any] = {}
        self._asked: State | None = None  # a state that was asked for, since no line came
        self._wanted = threading.Event()
        self._look = threading.Event()
        self._over = False
        self._looker = threading.Thread(target=self._look_on, name="iiwa-sim-looks", daemon=True)

    def describe(self) -> Drawing:
        """What the arm looks like. Asks the backdoor, or finds the robot by where its flange is.

        Raises StationFault where nobody answers, and where it is none of the robots that come along.
        """
        if self.bench is not None:
            try:
                self.told = json.loads(self.bench.do("get robot"))
            except (Unanswered, Refusal, ValueError) as fault:
                raise StationFault(f"the backdoor at {fault}") from None
            return Drawing.of_urdf(self.told["urdf"], self.told["joints"], self.told["flange"])
        return self._recognised(self._first_state())

    def draw(
        self,
        scene: viser.SceneApi,
        drawing: Drawing,
        root: str = "/robot",
        place_m: Vector = (0.0, 0.0, 0.0),
    ) -> None:
        """Have it in a scene, as a drawing of `describe`."""
        self.scene = Scene(scene, drawing, root, place_m)

    def start(self) -> None:
        self.status.start()
        if self.bench is not None:
            self._looker.start()

    def stop(self) -> None:
        """Leave it alone."""
        self._over = True
        self._wanted.set()
        self._look.set()
        self.status.stop()
        if self.bench is not None:
            self._looker.join()
        for lines in (self.bench, self._looks, self._waits):
            if lines is not None:
                lines.close()
        if self.driver is not None:
            self.driver.close()

    def want(self, wanted: bool) -> None:
        """Whether anybody is there who sees it."""
        self.status.want(wanted)
        if wanted != self._wanted.is_set() and not self._over:
            (self._wanted.set if wanted else self._wanted.clear)()

    def act(self, line: str, timeout_s: float | None = None) -> str:
        """Have the backdoor carry out a line; gives the answer. Raises Refusal and Unanswered.

        One that takes its time, and has a `timeout_s`, keeps no other waiting, such as an emergency stop.
        """
        lines = self.bench if timeout_s is None else self._waits
        if lines is None:
            raise Unanswered("the page was started without a backdoor")
        reason = ""
        try:
            return lines.do(line, timeout_s or ANSWER_S)
        except Refusal as refusal:
            reason = str(refusal)
            raise
        finally:
            self._acted.append((line, reason))
            self.look_now()

    def look_now(self) -> None:
        """Ask at once for what the status lines do not tell, or not yet."""
        self._look.set()

    def stop_moves(self) -> None:
        """Stop the robot by its status port. Raises Unanswered."""
        lines = Lines(self.place.status)
        try:
            lines.ask("stop")  # answered by a state
        finally:
            lines.close()

    def frame(self) -> bool:
        """Draw the newest state, if there is one; whether there is."""
        asked, self._asked = self._asked, None
        state = self.status.newest() or asked
        if self.cell and self._shown_cell is not self.cell and self.scene is not None:
            self._shown_cell = self.cell
            self.scene.show_cell(self.cell)
        if state is None or self.scene is None:
            return False
        if len(state["joint_position"]) != self.scene.drawing.joint_count:
            self.fault = f"{host_and_port(*self.place.status)} is another robot than the one of the backdoor"
            return False
        self.scene.show(state)
        self.state = state
        return True

    def _first_state(self) -> State:
        try:
            lines = Lines(self.place.status)
            state = json.loads(lines.ask("", FIRST_LINE_S))
            lines.close()
        except (Unanswered, ValueError) as fault:
            reason = fault if isinstance(fault, Unanswered) else "what answers there is no status port"
            raise StationFault(f"the status port {reason}") from None
        return dict(state)

    def _recognised(self, state: State) -> Drawing:
        names = built_in_robots() if self.place.robot is None else [self.place.robot]
        flange = Frame(*state["flange_frame"]).to_transform().translation
        for name in names:
            robot = load_robot(name)
            if len(robot.joints) != len(state["joint_position"]):
                continue
            drawing = Drawing.of_urdf(robot.urdf, robot.joints, robot.flange)
            found = drawing.poses(state["joint_position"])[drawing.flange].translation
            if (
                self.place.robot is not None
                or max(abs(a - b) for a, b in zip(found, flange, strict=True)) < SAME_PLACE_M
            ):
                self.told = {"name": robot.name, "joints": list(robot.joints)}
                return drawing
        place = host_and_port(*self.place.status)
        raise StationFault(f"the robot at {place} is none of {', '.join(names)}: name it by --robot")

    def _look_on(self) -> None:
        assert self._looks is not None
        while True:
            self._wanted.wait()
            if self._over:
                return
            self._look.clear()
            try:
                self._look_at(self._looks)
                self.fault = ""
            except (Unanswered, Refusal, ValueError) as fault:
                self.fault = f"backdoor: {fault}"
            self._look.wait(LOOKS_S)

    def _is_ours(self, line: Mapping[str, Any]) -> bool:
        """Whether it tells of what was done on this page, which is shown as that: pushes are not."""
        client = str(line["session"]).partition(" ")[0]
        return line["mark"] == "#" and any(client in lines.names for lines in self.ours)

    def _taken(self) -> list[tuple[str, str]]:
        """What has been done on the page since the last look."""
        taken = []
        while self._acted:
            taken.append(self._acted.popleft())
        return taken

    def _look_at(self, bench: Bench) -> None:
        cell = json.loads(bench.do("get cell"))
        if cell != self.cell:
            self.cell = cell
        self.clock = bench.do("get clock")
        self.states = json.loads(bench.do("get states"))
        acted = self._taken()
        said = json.loads(bench.do(f"get dialogue : {self._said_next}"))
        if said["next"] < self._said_next:  # another simulator is there now
            said = json.loads(bench.do("get dialogue : 0"))
        self._said_next = said["next"]
        self.said.extend(line for line in said["lines"] if not self._is_ours(line))
        if acted:  # behind what was said before, which it may be about
            time_s = json.loads(bench.do("get state"))["time_s"]
            self.said.extend(
                {"time_s": time_s, "session": PAGE, "mark": "#", "text": line, "reason": reason}
                for line, reason in acted
            )
        if not self.status.wait(0.0):
            self._asked = json.loads(bench.do("get state"))

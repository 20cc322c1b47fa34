"""A robot as the page reaches it: by its backdoor, and a client connection."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import msgspec

from iiwa_sim.backdoor.client import BackdoorClient
from iiwa_sim.client import Iiwa
from iiwa_sim.controller.errors import Refused
from iiwa_sim.controller.state import Snapshot
from iiwa_sim.dialogue import DialogueLine, RecentLines
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.server.listening import why

LOOKS_S = 0.5
"""Period of questions for cell, clock, moves and dialogue."""
TIMEOUT_S, REPLY_S, AGAIN_S = 3.0, 5.0, 0.5
MOST_SAID, NOTE_S = 200, 8.0


class Place(msgspec.Struct, frozen=True, kw_only=True):
    """Addresses of a robot."""

    name: str = ""
    """Name of the robot, if it is one of several."""
    backdoor: tuple[str, int]
    token: str = ""
    """Token of the backdoor."""
    driver: tuple[str, int] | None = None
    """Port of the iiwa's text protocol."""
    in_cell: str = ""
    """Name of the robot in its cell, if there are several."""
    base: tuple[float, ...] = (0.0,) * 6
    """Pose of its base there: mm, rad."""


def tell(client: Any, text: str) -> None:
    """Show a client a text for some seconds."""
    client.add_notification("Robot", text, color="red", auto_close_seconds=NOTE_S)


class Station:
    """A robot that a thread follows up to `stop`, while a browser has the page open."""

    def __init__(self, place: Place, period_s: float) -> None:
        """Raises OSError if nobody answers."""
        self.place, self.name = place, place.name
        self.backdoor = backdoor = BackdoorClient(
            *place.backdoor, place.token, TIMEOUT_S, robot=place.in_cell
        )
        self.robot = msgspec.convert(backdoor.robot(), RobotDescription)
        self.state = msgspec.convert(backdoor.state(), Snapshot)
        """The newest state."""
        self.cell, self.clock, self.moves = backdoor.cell(), "", 0
        self.said: deque[DialogueLine] = deque(maxlen=MOST_SAID)
        """The newest lines of the dialogue, the newest one first."""
        self.fault = ""
        """The reason for which the robot cannot be reached, or empty."""
        self.after_states: list[Callable[[], None]] = []
        """Called in the thread after each state."""
        self._client: Iiwa | None = None
        self._client_lock = threading.Lock()
        self._period_s, self._said_next = period_s, 0
        self._looks_s = 0.0  # when the next look is due
        self._wanted, self._over = threading.Event(), False
        self._thread = threading.Thread(target=self._follow, name="iiwa-sim-page", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread, and the client connection; the robot stops a move of it."""
        self._over = True
        self._wanted.set()
        self._thread.join()
        if self._client is not None:
            self._client.close()

    def want(self, wanted: bool) -> None:
        """Follow the robot, or no longer."""
        (self._wanted.set if wanted else self._wanted.clear)()

    def act(self, method: str, *values: Any) -> None:
        """Call a method of the backdoor. Raises Refused and OSError."""
        self._looks_s = 0.0
        getattr(self.backdoor, method)(*values)

    def command(self, name: str, *values: float | str) -> str:
        """Send a command as a client and return its reply. Raises CommandError and OSError."""
        assert self.place.driver is not None
        with self._client_lock:
            if self._client is None:
                self._client = Iiwa(*self.place.driver, REPLY_S)
            try:
                return self._client.command(name, *values)
            except OSError:
                self._client = None  # it has closed itself
                raise

    def _follow(self) -> None:
        while self._wanted.wait() and not self._over:
            began_s, fault = time.monotonic(), ""
            try:
                if began_s >= self._looks_s:
                    self._looks_s = began_s + LOOKS_S
                    self._look()
                self.state = msgspec.convert(self.backdoor.state(), Snapshot)
                for each in self.after_states:
                    each()
            except (OSError, Refused) as found:
                fault = why(found)
            self.fault = fault
            time.sleep(max(began_s + (AGAIN_S if fault else self._period_s) - time.monotonic(), 0.0))

    def _look(self) -> None:
        backdoor = self.backdoor
        self.cell, self.clock = backdoor.cell(), backdoor.get_clock()
        self.moves = backdoor.moves()
        said = msgspec.convert(backdoor.dialogue(self._said_next), RecentLines)
        self._said_next = said.next
        self.said.extendleft(said.lines)

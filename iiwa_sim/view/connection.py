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
MOST_LINES, NOTE_S = 200, 8.0


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


def notify(client: Any, text: str) -> None:
    """Show a client a text for some seconds."""
    client.add_notification("Robot", text, color="red", auto_close_seconds=NOTE_S)


class Station:
    """A robot that a thread follows up to `stop`, while `wanted` is set."""

    def __init__(self, place: Place, period_s: float) -> None:
        """Raises OSError if no backdoor answers."""
        self.place = place
        self.backdoor = BackdoorClient(*place.backdoor, place.token, TIMEOUT_S, robot=place.in_cell)
        self.robot = msgspec.convert(self.backdoor.robot(), RobotDescription)
        self.state = msgspec.convert(self.backdoor.state(), Snapshot)
        """The newest state."""
        self.cell, self.clock, self.moves = self.backdoor.cell(), "", 0
        self.dialogue: deque[DialogueLine] = deque(maxlen=MOST_LINES)
        """The newest lines of the dialogue, the newest one first."""
        self.fault = ""
        """The reason for which the robot cannot be reached, or empty."""
        self.after_state: Callable[[], None] = lambda: None
        """Called in the thread after each state."""
        self.wanted = threading.Event()
        self._client: Iiwa | None = None
        self._lock = threading.Lock()
        self._is_over = False
        self._thread = threading.Thread(target=self._follow, args=(period_s,), daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread, and the client connection; the robot stops a move of it."""
        self._is_over = True
        self.wanted.set()
        self._thread.join()
        if self._client is not None:
            self._client.close()

    def command(self, name: str, *values: float | str) -> str:
        """Send a command as a client and return its reply. Raises CommandError and OSError."""
        if self.place.driver is None:
            raise ConnectionError("the robot does not speak the text protocol")
        with self._lock:
            try:
                self._client = self._client or Iiwa(*self.place.driver, REPLY_S)
                return self._client.command(name, *values)
            except OSError:
                self._client = None  # it has closed itself
                raise

    def _follow(self, period_s: float) -> None:
        backdoor, looks_s, next_line = self.backdoor, 0.0, 0
        while self.wanted.wait() and not self._is_over:
            began_s, fault = time.monotonic(), ""
            try:
                if began_s >= looks_s:
                    looks_s = began_s + LOOKS_S
                    self.cell = backdoor.cell()
                    self.clock, self.moves = backdoor.get_clock(), backdoor.moves()
                    recent = msgspec.convert(backdoor.dialogue(next_line), RecentLines)
                    next_line = recent.next
                    self.dialogue.extendleft(recent.lines)
                self.state = msgspec.convert(backdoor.state(), Snapshot)
                self.after_state()
            except (OSError, Refused) as found:
                fault = why(found)
            self.fault = fault
            time.sleep(max(began_s + (AGAIN_S if fault else period_s) - time.monotonic(), 0.0))

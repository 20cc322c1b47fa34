"""A robot as the page reaches it: by its backdoor or status port, and a client connection."""

from __future__ import annotations

import logging
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

import msgspec

from iiwa_sim.backdoor.client import BackdoorClient
from iiwa_sim.client import Iiwa
from iiwa_sim.controller.errors import Refused
from iiwa_sim.controller.state import Snapshot
from iiwa_sim.dialogue import RecentLine, RecentLines
from iiwa_sim.robot.description import DEFAULT_ROBOT, RobotDescription, load_robot
from iiwa_sim.server.listening import host_and_port, why
from iiwa_sim.wording import Unusable

STATE_S, LOOKS_S = 1.0 / 30.0, 0.5
"""Periods of questions for the state, and for cell, clock, moves and dialogue."""
TIMEOUT_S, REPLY_S, AGAIN_S = 2.0, 5.0, 0.5
MOST_SAID = 200
FAULTS = (OSError, Refused, ValueError, KeyError, TypeError, msgspec.MsgspecError)
"""Errors of somebody who answers otherwise than a robot, or not at all."""

logger = logging.getLogger(__name__)


class StationFault(Unusable):
    """A robot that cannot be shown. The message is one line."""


class Place(msgspec.Struct, frozen=True, kw_only=True):
    """Addresses of a robot."""

    name: str = ""
    """Name of the robot, if it is one of several."""
    status: tuple[str, int]
    backdoor: tuple[str, int] | None = None
    token: str = ""
    """Token of the backdoor."""
    driver: tuple[str, int] | None = None
    """Port of the iiwa's text protocol."""
    robot: str | None = None
    """Name or folder of the robot, for a place without a backdoor."""
    in_cell: str = ""
    """Name of the robot in its cell, if there are several."""
    base: tuple[float, ...] = (0.0,) * 6
    """Pose of its base there: mm, rad."""


class Driver:
    """A client connection that opens at the first command, for several threads."""

    def __init__(self, address: tuple[str, int]) -> None:
        self._address = address
        self._lock = threading.Lock()
        self._client: Iiwa | None = None

    def command(self, name: str, *values: float | str) -> str:
        """Send a command and return its reply. Raises CommandError and OSError."""
        with self._lock:
            if self._client is None:
                self._client = Iiwa(*self._address, REPLY_S)
            try:
                return self._client.command(name, *values)
            except OSError:
                self._client = None  # it has closed itself
                raise

    def close(self) -> None:
        """Close the connection; the robot stops a move of it."""
        with self._lock:
            if self._client is not None:
                self._client.close()


class Station:
    """A robot that a thread follows from `start` to `stop`, while a browser has the page open."""

    def __init__(self, place: Place, period_s: float = STATE_S) -> None:
        """Raises StationFault if nobody answers, and RobotFault for an unknown robot."""
        self.place, self.name = place, place.name
        self.bench = self._asked = None
        if place.backdoor is not None:
            self.bench = BackdoorClient(*place.backdoor, place.token, robot=place.in_cell)
            self._asked = BackdoorClient(*place.backdoor, place.token, TIMEOUT_S, robot=place.in_cell)
        self.driver = None if place.driver is None else Driver(place.driver)
        self._where = f"the {'status port' if self.bench is None else 'backdoor at'} "
        self._where += host_and_port(*(place.backdoor or place.status))
        try:
            self.robot = (
                load_robot(place.robot or DEFAULT_ROBOT)
                if self.bench is None
                else msgspec.convert(self.bench.robot(), RobotDescription)
            )
            self.state = self._ask()
            """The newest state."""
        except FAULTS as fault:
            raise StationFault(f"{self._where}: {why(fault)}") from None
        self.cell: Mapping[str, Any] = {}
        self.clock = ""
        self.moves: Mapping[str, Any] = {"count": 0, "moves": []}
        self.said: deque[RecentLine] = deque(maxlen=MOST_SAID)
        """The newest lines of the dialogue, the newest one first."""
        self.fault = ""
        """The reason for which the robot cannot be reached, or empty."""
        self.after_states: list[Callable[[], None]] = []
        """Called in the thread after each state."""
        self._period_s = period_s
        self._said_next = 0
        self._looks_s = 0.0  # when the next look is due
        self._wanted, self._over = threading.Event(), False
        self._thread = threading.Thread(target=self._follow, name="iiwa-sim-page", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread, and the connection of the driver."""
        self._over = True
        self._wanted.set()
        self._thread.join()
        if self.driver is not None:
            self.driver.close()

    def want(self, wanted: bool) -> None:
        """Follow the robot, or no longer."""
        (self._wanted.set if wanted else self._wanted.clear)()

    def act(self, method: str, *values: Any) -> Any:
        """Call a method of the backdoor. Raises Refused and OSError."""
        self._looks_s = 0.0
        return getattr(self.bench, method)(*values)

    def stop_moves(self) -> None:
        """Stop the robot by its status port. Raises OSError."""
        self._line(b"stop\n")

    def _line(self, request: bytes) -> bytes:
        with socket.create_connection(self.place.status, TIMEOUT_S) as connection:
            connection.sendall(request)
            return connection.makefile("rb").readline()

    def _ask(self) -> Snapshot:
        if self._asked is None:
            state = msgspec.json.decode(self._line(b"\n"), type=Snapshot)
        else:
            state = msgspec.convert(self._asked.state(), Snapshot)
        if len(state.joint_position) != len(self.robot.joints):
            raise ValueError(f"it has {len(state.joint_position)} joints, expected {len(self.robot.joints)}")
        return state

    def _follow(self) -> None:
        while self._wanted.wait() and not self._over:
            began_s, fault = time.monotonic(), ""
            try:
                if self._asked is not None and began_s >= self._looks_s:
                    self._looks_s = began_s + LOOKS_S
                    self._look_at(self._asked)
                self.state = self._ask()
                for each in self.after_states:
                    each()
            except FAULTS as found:
                fault = why(found)
            if fault != self.fault and not self._over:
                self.fault = fault
                level = logging.WARNING if fault else logging.INFO
                logger.log(level, "%s: %s", self._where, fault or "connected")
            time.sleep(max(began_s + (AGAIN_S if fault else self._period_s) - time.monotonic(), 0.0))

    def _look_at(self, bench: BackdoorClient) -> None:
        self.cell, self.clock = bench.cell(), bench.get_clock()
        self.moves = bench.moves()
        said = msgspec.convert(bench.dialogue(self._said_next), RecentLines)
        if said.next < self._said_next:  # another simulator is there now
            said = msgspec.convert(bench.dialogue(0), RecentLines)
        self._said_next = said.next
        self.said.extendleft(said.lines)

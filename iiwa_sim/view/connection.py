"""A robot as the page reaches it: by its status port, its backdoor, and a client connection."""

from __future__ import annotations

import contextlib
import json
import logging
import socket
import threading
from collections import deque
from collections.abc import Mapping
from typing import Any

import msgspec

from iiwa_sim.backdoor.client import BackdoorClient
from iiwa_sim.client import Iiwa
from iiwa_sim.robot.description import built_in_robots, load_robot
from iiwa_sim.server.listening import host_and_port, why
from iiwa_sim.view.scene import Arm, Robot, State
from iiwa_sim.wording import Unusable

LOOKS_S = 0.5
"""Period of questions for data that status lines do not have: cell, clock, states, moves, dialogue."""
CONNECT_S, ANSWER_S, AGAIN_S = 2.0, 5.0, 0.5
LONGEST_LINE = 1_000_000
MOST_SAID = 200
SAME_PLACE_M = 1e-3
PAGE = "page"
"""Session of dialogue lines for actions on the page."""

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
                self._client = Iiwa(*self._address, ANSWER_S)
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
    """A robot that threads follow from `start` to `stop`."""

    def __init__(self, place: Place) -> None:
        """Raises StationFault if nobody answers, or if the robot is unknown."""
        self.place = place
        self.name = place.name
        self.bench = None if place.backdoor is None else BackdoorClient(*place.backdoor, place.token)
        self.driver = None if place.driver is None else Driver(place.driver)
        self.state: State
        """The newest state."""
        self.robot = self._describe()
        self.cell: Mapping[str, Any] = {}
        self.clock = ""
        self.states: list[str] = []
        self.moves: Mapping[str, Any] = {"count": 0, "moves": []}
        self.said: deque[dict[str, Any]] = deque(maxlen=MOST_SAID)
        """Lines of the dialogue that nobody has taken out yet."""
        self._faults: dict[str, str] = {}
        self._said_next = 0
        self._line = b""
        self._stream: socket.socket | None = None
        self._came, self._wanted, self._look = threading.Event(), threading.Event(), threading.Event()
        self._over = threading.Event()
        jobs = [self._follow] if self.bench is None else [self._follow, self._look_on]
        self._threads = [threading.Thread(target=job, name="iiwa-sim-page", daemon=True) for job in jobs]

    def start(self) -> None:
        """Start the threads."""
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """End threads and connections."""
        self._over.set()
        self.want(False)
        self._wanted.set()
        for thread in self._threads:
            thread.join()
        if self.driver is not None:
            self.driver.close()

    def want(self, wanted: bool) -> None:
        """Follow the robot, or not: it ticks without pause for those who follow it."""
        if wanted == self._wanted.is_set():
            return
        if wanted:
            self._wanted.set()
        else:
            self._wanted.clear()
            self._look.set()
            if (stream := self._stream) is not None:
                with contextlib.suppress(OSError):
                    stream.shutdown(socket.SHUT_RDWR)

    @property
    def fault(self) -> str:
        """Reasons for which the robot cannot be reached, or empty."""
        return ", ".join(f"{port}: {fault}" for port, fault in self._faults.items() if fault)

    def act(self, method: str, *values: Any) -> Any:
        """Call a method of the backdoor. Raises Refused and OSError."""
        assert self.bench is not None
        try:
            return getattr(self.bench, method)(*values)
        finally:
            self._look.set()

    def stop_moves(self) -> None:
        """Stop the robot by its status port. Raises OSError."""
        _first_line(self.place.status, b"stop\n")

    def newest(self) -> bool:
        """Read the newest state into `state`, and return True if there is one."""
        line, self._line = self._line, b""
        if not line:
            return False
        try:
            state = msgspec.json.decode(line)
            if len(state["joint_position"]) != len(self.robot.joints):
                raise ValueError("another robot than that of the backdoor")
        except (msgspec.DecodeError, KeyError, TypeError, ValueError) as fault:
            self._tell("status port", str(fault) if "another" in str(fault) else "no status port")
            return False
        self.state = state
        return True

    def _describe(self) -> Robot:
        place, where = self.place, host_and_port(*self.place.status)
        try:
            if self.bench is not None:
                self.state = self.bench.state()
                return msgspec.convert(self.bench.robot(), Robot)
            self.state = json.loads(_first_line(place.status, b"\n"))
            joints, flange = self.state["joint_position"], self.state["flange_frame"]
        except (OSError, ValueError, KeyError, TypeError, msgspec.ValidationError) as fault:
            port = "the status port " + where
            if place.backdoor is not None:
                port = "the backdoor at " + host_and_port(*place.backdoor)
            raise StationFault(f"{port}: {why(fault) if isinstance(fault, OSError) else 'not one'}") from None
        names = built_in_robots() if place.robot is None else [place.robot]
        for name in names:
            robot = msgspec.convert(load_robot(name), Robot, from_attributes=True)
            if len(robot.joints) != len(joints):
                continue
            arm = Arm(robot)
            off = [
                1e3 * m - mm for m, mm in zip(arm.poses(joints)[arm.flange].translation, flange, strict=False)
            ]
            if place.robot is not None or max(map(abs, off)) < 1e3 * SAME_PLACE_M:
                return robot
        raise StationFault(f"the robot at {where} is none of {', '.join(names)}: name it by --robot")

    def _follow(self) -> None:
        port = f"status port {host_and_port(*self.place.status)}"
        while self._wanted.wait() and not self._over.is_set():
            try:
                with socket.create_connection(self.place.status, CONNECT_S) as self._stream:
                    self._stream.settimeout(None)
                    lines = self._stream.makefile("rb")
                    while self._wanted.is_set() and (line := lines.readline(LONGEST_LINE)).endswith(b"\n"):
                        self._line = line
                        self._tell(port, "")
                        self._came.set()
                    if self._wanted.is_set():
                        raise OSError("the robot has closed it")
            except OSError as fault:
                if not self._over.wait(AGAIN_S):  # not when all ends
                    self._tell(port, why(fault))

    def _look_on(self) -> None:
        assert self.bench is not None
        while self._wanted.wait() and not self._over.is_set():
            self._look.clear()
            try:
                self._look_at(self.bench)
                self._tell("backdoor", "")
            except (OSError, ValueError) as fault:
                self._tell("backdoor", str(fault))
            self._look.wait(LOOKS_S)

    def _look_at(self, bench: BackdoorClient) -> None:
        self.cell = bench.cell()
        self.clock = bench.get_clock()
        self.states = bench.states()
        self.moves = bench.moves()
        said = bench.dialogue(self._said_next)
        if said["next"] < self._said_next:  # another simulator is there now
            said = bench.dialogue(0)
        self._said_next = said["next"]
        self.said.extend(said["lines"])
        if not self._came.is_set():  # a robot without ticks sends no lines
            self._line = json.dumps(bench.state()).encode()
        self._came.clear()

    def _tell(self, port: str, fault: str) -> None:
        if fault != self._faults.get(port, ""):
            self._faults[port] = fault
            logger.log(logging.WARNING if fault else logging.INFO, "%s: %s", port, fault or "connected")


def _first_line(address: tuple[str, int], request: bytes) -> bytes:
    with socket.create_connection(address, CONNECT_S) as connection:
        connection.settimeout(ANSWER_S)
        connection.sendall(request)
        return connection.makefile("rb").readline(LONGEST_LINE)

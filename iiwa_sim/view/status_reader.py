"""Follows a status port, and keeps the newest state that came."""

from __future__ import annotations

import logging
import socket
import threading
from typing import Any

import msgspec

from iiwa_sim.server.listening import host_and_port, why
from iiwa_sim.view.line_client import CONNECT_S, Address

AGAIN_S = 0.5
"""Time until it is tried again to connect."""
LOOKS_S = 0.25
"""Time between two looks whether it is still wanted, where nothing comes."""
MOST_BYTES = 1_000_000
"""Longest line; a longer one is taken for one that does not end."""
RECEIVE_BYTES = 16_384
"""What the system holds for us at least: what waits there is old."""

logger = logging.getLogger(__name__)


class StatusReader:
    """Reads in a thread of its own, from `start` to `stop`, while it is `wanted`.

    Who is not connected costs the robot nothing: one at rest need not tick for a page that nobody has open.
    """

    def __init__(self, address: Address) -> None:
        self.address = address
        self.fault = ""
        """Why there is no connection; empty while there is one, or none is wanted."""
        self._line = b""
        self._wanted = threading.Event()
        self._over = threading.Event()
        self._came = threading.Event()
        self._thread = threading.Thread(target=self._run, name="iiwa-sim-status", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        """Read no more."""
        self._over.set()
        self._wanted.set()
        self._thread.join()

    def want(self, wanted: bool) -> None:
        """Whether somebody is there to whom it would be shown."""
        if wanted != self._wanted.is_set() and not self._over.is_set():
            (self._wanted.set if wanted else self._wanted.clear)()

    def newest(self) -> dict[str, Any] | None:
        """The newest state, or None where none has come since the last call."""
        line, self._line = self._line, b""
        if not line:
            return None
        try:
            state = msgspec.json.decode(line)
        except msgspec.DecodeError:
            state = None
        if not isinstance(state, dict) or "joint_position" not in state:
            self.fault = f"{host_and_port(*self.address)} is no status port"
            return None
        return state

    def wait(self, timeout_s: float) -> bool:
        """Whether a state has come, or comes in that time, since the last call."""
        came = self._came.wait(timeout_s)
        self._came.clear()
        return came

    def _run(self) -> None:
        while not self._over.is_set():
            self._wanted.wait()
            if self._over.is_set():
                return
            try:
                with socket.create_connection(self.address, CONNECT_S) as connection:
                    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BYTES)
                    self._tell("")
                    connection.settimeout(LOOKS_S)
                    self._read(connection)
            except OSError as fault:
                self._tell(why(fault))
                self._over.wait(AGAIN_S)

    def _read(self, connection: socket.socket) -> None:
        rest = b""
        while self._wanted.is_set() and not self._over.is_set():
            try:
                more = connection.recv(65_536)
            except TimeoutError:
                continue
            if not more:
                raise OSError("the robot has closed it")
            whole, end, rest = (rest + more).rpartition(b"\n")
            if end:
                self._line = whole.rpartition(b"\n")[2]
                self._came.set()
            elif len(rest) > MOST_BYTES:
                raise OSError("no status port: a line without end")

    def _tell(self, fault: str) -> None:
        if fault != self.fault:
            self.fault = fault
            place = host_and_port(*self.address)
            if fault:
                logger.warning("status port %s: %s", place, fault)
            else:
                logger.info("status port %s: connected", place)

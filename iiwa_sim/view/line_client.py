"""One connection of lines, asked from several threads: to the backdoor, or to the robot as a driver's."""

from __future__ import annotations

import contextlib
import socket
import threading

from iiwa_sim.server.listening import host_and_port, why
from iiwa_sim.wording import harmless, shortened

CONNECT_S = 2.0
ANSWER_S = 5.0
"""Time until an answer is given up; who asks for what takes time says how long."""
MOST_BYTES = 4_000_000
"""Longest answer."""

Address = tuple[str, int]


class Unanswered(Exception):
    """The other side is not there, or does not answer. The message is one line."""


class Refusal(Exception):
    """The server has answered `error`. The message is the rest of that line."""


class Lines:
    """Asks a line at a time. It connects when first asked, and again where the connection has gone."""

    def __init__(self, address: Address, token: str = "", *first_lines: str) -> None:
        """Said on every connection before all else: the `token`, if there is one, then `first_lines`. Each is
        answered `done`."""
        self.address = address
        self.names: set[str] = set()
        """What the other side calls its connections: HOST:PORT."""
        self._token = token
        self._first_lines = first_lines
        self._lock = threading.Lock()
        self._connection: socket.socket | None = None
        self._received = b""

    def ask(self, line: str, timeout_s: float = ANSWER_S) -> str:
        """The answer to a line, whatever it is. Raises Unanswered."""
        with self._lock:
            try:
                connection = self._connected()
                connection.settimeout(timeout_s)
                connection.sendall(f"{line}\r\n".encode("ascii", "replace"))
                return self._line(connection)
            except OSError as fault:
                self._close()
                raise Unanswered(f"{host_and_port(*self.address)}: {why(fault)}") from None

    def do(self, line: str, timeout_s: float = ANSWER_S) -> str:
        """The answer to a line of the backdoor. Raises Refusal where that is `error`, and Unanswered."""
        answer = self.ask(line, timeout_s)
        if answer.startswith("error"):
            raise Refusal(shortened(harmless(answer.removeprefix("error").strip()), 300))
        return answer

    def close(self) -> None:
        """Go; the next line connects again."""
        with self._lock:
            self._close()

    def _connected(self) -> socket.socket:
        if self._connection is not None and self._has_gone(self._connection):
            self._close()
        if self._connection is None:
            self._connection = socket.create_connection(self.address, CONNECT_S)
            self.names.add(host_and_port(*self._connection.getsockname()[:2]))
            self._received = b""
            if self._token and not self._takes(self._connection, self._token):
                raise OSError("it does not take this token")
            for line in self._first_lines:
                if not self._takes(self._connection, line):
                    raise OSError(f"it does not take '{line}'")
        return self._connection

    def _takes(self, connection: socket.socket, line: str) -> bool:
        connection.sendall(f"{line}\r\n".encode("ascii", "replace"))
        return self._line(connection) == "done"

    def _has_gone(self, connection: socket.socket) -> bool:
        """Whether the other side has closed it; what it has said unasked, as a late reply, is dropped."""
        self._received = b""
        connection.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            while True:
                try:
                    if not connection.recv(65_536):
                        return True
                except BlockingIOError:
                    raise
                except OSError:
                    return True
        return False

    def _line(self, connection: socket.socket) -> str:
        while b"\n" not in self._received:
            more = connection.recv(65_536)
            if not more:
                raise OSError("the connection was closed")
            self._received += more
            if len(self._received) > MOST_BYTES:
                raise OSError("an answer without end")
        line, _, self._received = self._received.partition(b"\n")
        return line.rstrip(b"\r").decode("ascii", "replace")

    def _close(self) -> None:
        if self._connection is not None:
            self._connection.close()
            self._connection = None

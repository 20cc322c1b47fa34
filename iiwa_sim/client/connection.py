"""TCP connection to a robot: bytes out, one reply at a time in, each with a time limit."""

import re
import socket
import time
from abc import ABC, abstractmethod
from collections.abc import Sequence
from math import isfinite
from typing import Self

Floats = Sequence[float]
LINE = re.compile(rb"[\r\n]*([^\r\n]+)[\r\n]+")
r"""A line with its end, which is `\n`, `\r`, `\r\n` or `\n\r`; empty ones do not count."""
__tracebackhide__ = True  # pytest shows the line of the test instead
MAX_REPLY_BYTES = 65536
POLL_PERIOD_S = 0.01


class Connection:
    """A connection to a robot. Not for use by several threads at once.

    Sending and reading raise `TimeoutError` after the time limit, and `ConnectionError` when the connection
    has ended; both are an `OSError`.
    """

    def __init__(self, host: str, port: int, timeout_s: float = 5.0) -> None:
        """Connect; `timeout_s` bounds that and the wait for each reply."""
        self.timeout_s = timeout_s
        self._address = (host, port)
        self._socket: socket.socket | None = None
        self.reconnect()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def reconnect(self) -> None:
        """Open a new connection in place of the present one, closed or not. Raises OSError."""
        self.close()
        self.unread = b""
        self._socket = socket.create_connection(self._address, self.timeout_s)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def close(self) -> None:
        """End the connection. A robot that still carries out a move of this client stops."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def send(self, data: bytes) -> None:
        """Send bytes unchanged."""
        connection = self._open()
        connection.settimeout(self.timeout_s)
        connection.sendall(data)

    def read(self, pattern: re.Pattern[bytes] = LINE, timeout_s: float | None = None) -> bytes:
        """Return the first group of the next match, a line by default; the bytes up to its end are gone."""
        connection, patience_s = self._open(), self.timeout_s if timeout_s is None else timeout_s
        deadline = time.monotonic() + patience_s
        while (found := pattern.search(self.unread)) is None:
            if len(self.unread) > MAX_REPLY_BYTES:
                raise ConnectionAbortedError(f"no end of a reply within {MAX_REPLY_BYTES} bytes")
            try:
                left_s = deadline - time.monotonic()
                if left_s <= 0.0:  # also if bytes keep coming
                    raise TimeoutError
                connection.settimeout(left_s)
                received = connection.recv(MAX_REPLY_BYTES)
            except TimeoutError:
                raise TimeoutError(f"no reply within {patience_s:g} s") from None
            if not received:
                raise ConnectionAbortedError("the connection ended")
            self.unread += received
        self.unread = self.unread[found.end() :]
        return found[1]

    def _open(self) -> socket.socket:
        if self._socket is None:
            raise ConnectionError("this connection is closed; reconnect() opens another")
        return self._socket


class Client(Connection, ABC):
    """A robot on the other end of a connection."""

    def wait_until_stopped(self, timeout_s: float) -> None:
        """Return when the robot is at rest. After `timeout_s` raise TimeoutError and keep the connection."""
        deadline = time.monotonic() + timeout_s
        while not self._is_stopped():
            if time.monotonic() > deadline:
                raise TimeoutError(f"the robot still moves after {timeout_s} s")
            time.sleep(POLL_PERIOD_S)

    @abstractmethod
    def _is_stopped(self) -> bool:
        """Ask the robot whether it is at rest."""

    def _exchange(self, name: str, data: bytes, pattern: re.Pattern[bytes] = LINE) -> bytes:
        """Send a command and read its reply; `name` stands for it in errors.

        Any failure closes the connection: a late reply would be taken for the next one.
        """
        try:
            self.send(data)
            return self.read(pattern)
        except BaseException as fault:
            self.close()
            if isinstance(fault, TimeoutError):
                raise TimeoutError(f"no answer to {name!r} within {self.timeout_s} s") from None
            raise


def exactly(count: int, values: Floats) -> list[float]:
    """Return the values as floats. Raises ValueError unless there are exactly `count`, all finite."""
    if len(values) != count or not all(map(isfinite, values)):
        raise ValueError(f"expected {count} finite numbers, got {len(values)}: {values}")
    return [float(value) for value in values]

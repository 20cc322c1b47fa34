"""TCP connection to a robot: bytes out, one reply at a time in, each with a time limit."""

import re
import socket
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from math import isfinite
from typing import Self

Floats = Sequence[float]
MAX_REPLY_BYTES = 65536
POLL_PERIOD_S = 0.01

_LINE_END = re.compile(rb"[\r\n]")
_PARTNER = {b"\r": b"\n", b"\n": b"\r"}


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
        self._received = self._partner = b""  # the partner would complete the line end of the last reply
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

    def receive(self, timeout_s: float | None = None) -> bytes:
        """Return the next piece of data; b"" at the end of the stream."""
        patience_s = self.timeout_s if timeout_s is None else timeout_s
        return self._receive(time.monotonic() + patience_s, patience_s)

    @property
    def unread(self) -> bytes:
        """Received bytes that no reply has taken yet."""
        if self._received:
            self._received = self._received.removeprefix(self._partner)
            self._partner = b""
        return self._received

    def read_line(self, timeout_s: float | None = None) -> bytes:
        r"""Return the next line without its end, which is `\n`, `\r`, `\r\n` or `\n\r`."""
        line, end = self._next(_LINE_END, timeout_s)
        self._partner = _PARTNER[end]
        return line

    def read_until(self, end: re.Pattern[bytes], timeout_s: float | None = None) -> bytes:
        """Return the bytes up to the first match of `end`, with it."""
        return b"".join(self._next(end, timeout_s))

    def _next(self, end: re.Pattern[bytes], timeout_s: float | None) -> tuple[bytes, bytes]:
        """Return what comes before the first match of `end`, and the match."""
        patience_s = self.timeout_s if timeout_s is None else timeout_s
        deadline = time.monotonic() + patience_s
        while (found := end.search(self.unread)) is None:
            if len(self._received) > MAX_REPLY_BYTES:
                raise ConnectionAbortedError(f"no end of a reply within {MAX_REPLY_BYTES} bytes")
            received = self._receive(deadline, patience_s)
            if not received:
                raise ConnectionAbortedError("the connection ended")
            self._received += received
        text, self._received = self._received[: found.start()], self._received[found.end() :]
        return text, found.group()

    def _receive(self, deadline: float, patience_s: float) -> bytes:
        connection = self._open()
        left_s = deadline - time.monotonic()
        try:
            if left_s <= 0.0:  # also if bytes keep coming
                raise TimeoutError
            connection.settimeout(left_s)
            return connection.recv(MAX_REPLY_BYTES)
        except TimeoutError:
            raise TimeoutError(f"no reply within {patience_s:g} s") from None

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

    def _exchange(self, name: str, data: bytes, read: Callable[[], bytes]) -> bytes:
        """Send a command and read its reply; `name` stands for it in errors.

        Any failure closes the connection: a late reply would be taken for the next one.
        """
        try:
            self.send(data)
            return read()
        except TimeoutError:
            self.close()
            raise TimeoutError(f"no answer to {name!r} within {self.timeout_s} s") from None
        except ConnectionAbortedError:
            self.close()
            raise ConnectionResetError(f"the connection ended before the answer to {name!r}") from None
        except BaseException:
            self.close()
            raise


def exactly(count: int, values: Floats) -> list[float]:
    """Return the values as floats. Raises ValueError unless there are exactly `count`, all finite."""
    if len(values) != count or not all(map(isfinite, values)):
        raise ValueError(f"expected {count} finite numbers, got {values}")
    return [float(value) for value in values]

"""TCP connection on which each command is answered before the next one is sent."""

import re
import socket
import time
from abc import ABC, abstractmethod
from collections.abc import Sequence
from math import isfinite
from typing import Self

Floats = Sequence[float]
MAX_REPLY_BYTES = 65536
POLL_PERIOD_S = 0.01


class Connection(ABC):
    """A connection to a robot. Not for use by several threads at once.

    Every command raises `CommandError` if the robot rejects it, `ReplyError` for a malformed reply, and
    `OSError` (`TimeoutError` among them) if the connection fails. The latter two close the connection: a late
    reply would be taken for the next one. A wrong number of values, and values that are not finite, raise
    `ValueError` before anything is sent.
    """

    _end: re.Pattern[bytes]
    """The end of a reply."""

    def __init__(self, host: str, port: int, timeout_s: float = 5.0) -> None:
        """Connect; `timeout_s` bounds that and the wait for each reply."""
        self._address = (host, port)
        self._timeout_s = timeout_s
        self._socket: socket.socket | None = None
        self.reconnect()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def reconnect(self) -> None:
        """Open a new connection in place of the present one, closed or not. Raises OSError."""
        self.close()
        self._socket = socket.create_connection(self._address, self._timeout_s)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def close(self) -> None:
        """End the connection. A robot that still carries out a move of this client stops."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

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

    def _exchange(self, name: str, data: bytes) -> bytes:
        """Send a command and return the bytes of its reply, with its end."""
        if self._socket is None:
            raise ConnectionError("this connection is closed; reconnect() opens another")
        deadline = time.monotonic() + self._timeout_s
        reply = b""
        try:
            self._socket.settimeout(self._timeout_s)
            self._socket.sendall(data)
            while not self._end.search(reply):
                left_s = deadline - time.monotonic()
                if left_s <= 0.0:  # also if bytes keep coming
                    raise TimeoutError
                self._socket.settimeout(left_s)
                received = self._socket.recv(MAX_REPLY_BYTES)
                reply += received
                if not received or len(reply) > MAX_REPLY_BYTES:
                    raise ConnectionResetError(f"the connection ended before the answer to {name!r}")
        except TimeoutError:
            self.close()
            raise TimeoutError(f"no answer to {name!r} within {self._timeout_s} s") from None
        except BaseException:
            self.close()
            raise
        return reply


def exactly(count: int, values: Floats) -> list[float]:
    """Return the values as floats. Raises ValueError unless there are exactly `count`, all finite."""
    if len(values) != count or not all(map(isfinite, values)):
        raise ValueError(f"expected {count} finite numbers, got {values}")
    return [float(value) for value in values]

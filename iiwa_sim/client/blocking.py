"""A connection to a server in any of the protocols, for blocking code."""

import socket
import time
from types import TracebackType
from typing import Generic, Self, TypeVar

from iiwa_sim.client.errors import CommandError
from iiwa_sim.client.exchange import CLOSED, Answer, Language, Request, Said

POLL_PERIOD_S = 0.01
RECEIVE_BYTES = 65536

T = TypeVar("T")


class Connection(Generic[Said, Answer]):
    """One connection. Not for use by several threads at once.

    Every command raises CommandError if the robot refuses it, ReplyError for a malformed reply, and OSError
    (TimeoutError among them) if the connection fails. The latter two close the connection: a late reply would
    be taken for the next one. On a closed connection every command raises ConnectionError, an OSError. A
    wrong number of values, and values that are not finite, raise ValueError before anything is sent.
    """

    _language: Language[Said, Answer]

    def __init__(self, host: str, port: int, timeout_s: float = 5.0) -> None:
        """Connects; `timeout_s` bounds that and the wait for each reply."""
        self._address = (host, port)
        self._timeout_s = timeout_s
        self._socket: socket.socket | None = None
        self.reconnect()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def reconnect(self) -> None:
        """Open a new connection in place of the present one, closed or not. Raises OSError."""
        self.close()
        self._conversation = self._language.conversation()
        self._socket = socket.create_connection(self._address, self._timeout_s)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def close(self) -> None:
        """End the connection. A robot that still carries out a move of this client stops."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def wait_until_stopped(self, timeout_s: float) -> None:
        """Return when the robot is at rest; after `timeout_s` raises TimeoutError and keeps the
        connection."""
        deadline = time.monotonic() + timeout_s
        while not self._do(self._language.at_rest):
            if time.monotonic() > deadline:
                raise TimeoutError(f"the robot still moves after {timeout_s} s")
            time.sleep(POLL_PERIOD_S)

    def _do(self, asked: Request[Said, Answer, T]) -> T:
        if self._socket is None:
            raise ConnectionError(CLOSED)
        try:
            return asked.result(self._ask(self._socket, asked.said))
        except CommandError:
            raise
        except BaseException:
            self.close()
            raise

    def _ask(self, connection: socket.socket, said: Said) -> Answer:
        deadline = time.monotonic() + self._timeout_s
        try:
            connection.settimeout(self._timeout_s)
            connection.sendall(self._conversation.say(said))
            while (answer := self._conversation.hear(connection.recv(RECEIVE_BYTES))) is None:
                left_s = deadline - time.monotonic()
                if left_s <= 0:  # also if bytes keep coming
                    raise TimeoutError
                connection.settimeout(left_s)
        except TimeoutError:
            raise TimeoutError(f"no answer to {said!r} within {self._timeout_s} s") from None
        return answer

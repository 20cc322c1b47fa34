"""A client's end of a connection, in bytes: what it sends is sent as it is, and every wait has an end."""

import contextlib
import socket
import struct
import time

from iiwa_sim.client.lines import ReplyLines
from iiwa_sim.serve.listening import host_and_port
from iiwa_sim.transcript.fault import TranscriptFault
from iiwa_sim.wording import harmless

RECEIVE_BYTES = 65536
TIMEOUT_S = 5.0


class NoReply(Exception):
    """None came; the message says for how long, or that the connection has ended."""


class Wire:
    """One connection."""

    def __init__(self, host: str, port: int, timeout_s: float = TIMEOUT_S) -> None:
        """Connects; `timeout_s` bounds that and the wait for each reply. Raises TranscriptFault."""
        self.timeout_s = timeout_s
        self._replies = ReplyLines()
        try:
            self._socket = socket.create_connection((host, port), timeout_s)
        except (OSError, ValueError) as fault:  # ValueError for characters no host name has
            why = getattr(fault, "strerror", None) or fault
            raise TranscriptFault(f"cannot connect to {host_and_port(host, port)}: {why}") from None
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, data: bytes) -> None:
        """As it is. Raises NoReply if the connection has ended."""
        try:
            self._socket.settimeout(self.timeout_s)
            self._socket.sendall(data)
        except OSError as fault:
            raise NoReply(_why(fault)) from None

    def sends_no_more(self) -> None:
        """Ends the stream this way only."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_WR)

    def receive(self) -> bytes:
        """What comes next in one piece; b"" at the end of the stream. Raises NoReply."""
        return self._receive(self.timeout_s, time.monotonic() + self.timeout_s)

    def reply(self, timeout_s: float | None = None) -> str:
        """The next line without its end, what is not printable ASCII escaped. Raises NoReply."""
        patience_s = self.timeout_s if timeout_s is None else timeout_s
        deadline = time.monotonic() + patience_s
        while (line := self._replies.take()) is None:
            data = self._receive(patience_s, deadline)
            if not data:
                raise NoReply("the connection ended")
            self._replies.feed(data)
        return repr(line)[2:-1]

    def ask(self, line: bytes) -> str:
        """A line, ended as most drivers do, and its reply. Raises NoReply."""
        self.send(line + b"\r\n")
        return self.reply()

    @property
    def unread(self) -> str:
        """What has come and is not taken yet, as far as it is known."""
        return repr(self._replies.unread)[2:-1]

    def close(self) -> None:
        """In good order."""
        self._socket.close()

    def vanish(self) -> None:
        """As the connection of a driver that crashed."""
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self._socket.close()

    def _receive(self, patience_s: float, deadline: float) -> bytes:
        try:
            self._socket.settimeout(max(deadline - time.monotonic(), 1e-6))
            return self._socket.recv(RECEIVE_BYTES)
        except TimeoutError:
            raise NoReply(f"no reply within {patience_s:g} s") from None
        except OSError as fault:
            raise NoReply(_why(fault)) from None


def _why(fault: OSError) -> str:
    return f"the connection failed: {harmless(str(fault.strerror or fault))}"

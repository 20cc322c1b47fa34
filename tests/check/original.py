"""Servers to be checked: one that acts like the original, and others with one deviation each."""

from __future__ import annotations

import contextlib
import re
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from socketserver import BaseRequestHandler, TCPServer, ThreadingMixIn
from typing import Any

from tests.line_client import DEADLINE_S

NUMBERS = {
    "get joint position": "0.0 0.5 -0.0 -1.25 0.0 1.0E-5 0.0",
    "get joint torque": "0.0 0.0 0.0 0.0 0.0 0.0 0.0",
    "get tool frame": "450.0 0.0 520.25 0.0 -1.5 0.0",
    "get flange frame": "450.0 0.0 560.25 0.0 -1.5 0.0",
    "get cartesian force": "0.0 0.0 0.0 0.0 0.0 0.0",
}
REPLIES = {"hello": "hello", "bye": "bye", "stop": "done", "get status": "stopped", **NUMBERS}


class OriginalServer(TCPServer):
    """Serves one client after the other, with a robot that stands still. It has no extensions."""

    request_queue_size = 100

    def __init__(self) -> None:
        self.received: list[str] = []
        """Every line of every client."""
        super().__init__(("127.0.0.1", 0), BaseRequestHandler)
        self.port: int = self.socket.getsockname()[1]

    def finish_request(self, request: Any, _client_address: Any) -> None:
        """Serve one client until it disconnects or sends bye."""
        rest = b""
        request.settimeout(DEADLINE_S)
        request.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        with contextlib.suppress(OSError):
            while data := request.recv(65536):
                *lines, rest = self.split(rest + data)
                if not all(self.answer(request, line) for line in lines):
                    return
            if rest:
                self.answer(request, rest)

    def split(self, data: bytes) -> list[bytes]:
        r"""Split data into lines and a rest. A `\n` behind a `\r` that ended a packet belongs to it."""
        if data.startswith(b"\n"):
            data = data[1:]
        return re.split(rb"\r\n|\n\r|\r|\n", data)

    def answer(self, connection: socket.socket, line: bytes) -> bool:
        """Answer a line; return True if the connection stays open."""
        text = line.decode()
        self.received.append(text)
        reply = self.reply(text)
        self.write(connection, reply)
        return reply != "bye"

    def reply(self, text: str) -> str:
        """Return the reply to a line."""
        name, *rest = text.split(":")
        known = REPLIES.get(name.strip().lower())
        return known if known is not None and len(rest) < 2 else "unknown command"

    def write(self, connection: socket.socket, reply: str) -> None:
        """A reply, in one write."""
        connection.sendall(reply.encode() + b"\r\n")


class ConcurrentServer(ThreadingMixIn, OriginalServer):
    """Serves all clients at once."""


class NewlineServer(ConcurrentServer):
    r"""Ends its replies with \n."""

    def write(self, connection: socket.socket, reply: str) -> None:
        connection.sendall(reply.encode() + b"\n")


class CaseServer(ConcurrentServer):
    """Takes small letters only."""

    def reply(self, text: str) -> str:
        return super().reply(text) if text == text.lower() else "unknown command"


class MovingServer(ConcurrentServer):
    """Its robot moves."""

    def reply(self, text: str) -> str:
        return super().reply(text).replace("stopped", "moving")


@contextmanager
def serving(kind: type[OriginalServer]) -> Iterator[OriginalServer]:
    """A server of a kind, until the context is left."""
    with kind() as server:
        thread = threading.Thread(target=server.serve_forever, args=[0.01])
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join(DEADLINE_S)

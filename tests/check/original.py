"""Servers to be checked: one that does as the original does, and others that deviate in one thing."""

from __future__ import annotations

import contextlib
import re
import socket
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from socketserver import BaseRequestHandler, TCPServer, ThreadingMixIn
from typing import Any

from tests.talking import DEADLINE_S

NUMBERS = {
    "get joint position": "0.0 0.5 -0.0 -1.25 0.0 1.0E-5 0.0",
    "get joint torque": "0.0 0.0 0.0 0.0 0.0 0.0 0.0",
    "get tool frame": "450.0 0.0 520.25 0.0 -1.5 0.0",
    "get flange frame": "450.0 0.0 560.25 0.0 -1.5 0.0",
    "get cartesian force": "0.0 0.0 0.0 0.0 0.0 0.0",
}
REPLIES = {"hello": "hello", "bye": "bye", "stop": "done", "get status": "stopped", **NUMBERS}


class Original(TCPServer):
    """Serves one client after the other, with a robot that stands still. It has no extensions."""

    request_queue_size = 100
    answers_a_rest = True
    """What stands behind the last line end when the stream ends."""

    def __init__(self) -> None:
        self.heard: list[str] = []
        """Every line of every client."""
        self.taken: Counter[int] = Counter()
        """Bytes that have been read and answered, or not answered for good, by the client's port."""
        super().__init__(("127.0.0.1", 0), BaseRequestHandler)
        self.port: int = self.socket.getsockname()[1]
        self._thread = threading.Thread(target=self.serve_forever, args=[0.01])
        self._thread.start()

    def close(self) -> None:
        """Listens no more."""
        self.shutdown()
        self._thread.join(DEADLINE_S)
        self.server_close()

    def finish_request(self, request: Any, client_address: Any) -> None:
        """One client, until it goes or has said bye."""
        rest = b""
        request.settimeout(DEADLINE_S)
        request.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        with contextlib.suppress(OSError):
            while data := request.recv(65536):
                *lines, rest = self.split(rest + data)
                if not all(self.answer(request, line) for line in lines):
                    return
                self.taken[client_address[1]] += len(data)
            if rest and self.answers_a_rest:
                self.answer(request, rest)

    def split(self, data: bytes) -> list[bytes]:
        r"""Lines, and a rest. A `\n` behind the `\r` that ended the packet before belongs to it."""
        if data.startswith(b"\n"):
            data = data[1:]
        return re.split(rb"\r\n|\n\r|\r|\n", data)

    def answer(self, connection: socket.socket, line: bytes) -> bool:
        """Whether the connection stays."""
        text = line.decode()
        self.heard.append(text)
        reply = self.reply(text)
        self.write(connection, reply)
        return reply != "bye"

    def reply(self, text: str) -> str:
        """What a line is answered."""
        name, *rest = text.split(":")
        known = REPLIES.get(name.strip().lower())
        return known if known is not None and len(rest) < 2 else "unknown command"

    def write(self, connection: socket.socket, reply: str) -> None:
        """A reply, in one write."""
        connection.sendall(reply.encode() + b"\r\n")


class Deviating(ThreadingMixIn, Original):
    """Serves all clients at once."""


class Bare(Deviating):
    r"""Ends its replies with \n."""

    def write(self, connection: socket.socket, reply: str) -> None:
        connection.sendall(reply.encode() + b"\n")


class Piecemeal(Deviating):
    """Writes the line end by itself."""

    def write(self, connection: socket.socket, reply: str) -> None:
        connection.sendall(reply.encode())
        threading.Event().wait(0.002)
        connection.sendall(b"\r\n")


class OnlyNewlines(Deviating):
    r"""Waits for \n."""

    def split(self, data: bytes) -> list[bytes]:
        return [line.strip(b"\r") for line in data.split(b"\n")]


class ForgetsTheRest(Deviating):
    """Drops what has no line end."""

    answers_a_rest = False


class SaysNothingToNothing(Deviating):
    """Skips empty lines, as line-oriented code often does."""

    def answer(self, connection: socket.socket, line: bytes) -> bool:
        return True if not line.strip() else super().answer(connection, line)


class MindsCase(Deviating):
    """Takes small letters only."""

    def reply(self, text: str) -> str:
        return super().reply(text) if text == text.lower() else "unknown command"


class ManyColons(Deviating):
    """Looks no further than the first colon."""

    def reply(self, text: str) -> str:
        return super().reply(text.partition(":")[0])


class NoIdleParameters(Deviating):
    """Wants nothing behind a command that takes nothing."""

    def reply(self, text: str) -> str:
        return "error" if text.count(":") == 1 and text != ":" else super().reply(text)


class Hasty(Deviating):
    """Reads one command per packet and forgets what came with it."""

    def split(self, data: bytes) -> list[bytes]:
        lines = super().split(data)
        return [lines[0], lines[-1]] if len(lines) > 1 else lines


class Exponents(Deviating):
    """Writes numbers as Python and C do."""

    def reply(self, text: str) -> str:
        return super().reply(text).replace("E-5", "e-05")


class Whole(Deviating):
    """Writes whole numbers without a point."""

    def reply(self, text: str) -> str:
        return super().reply(text).replace("450.0 0.0", "450 0")


class Stubborn(Deviating):
    """Lets a client that said bye talk on."""

    def answer(self, connection: socket.socket, line: bytes) -> bool:
        return super().answer(connection, line) or True


class StopsNothing(Deviating):
    """Refuses to stop a robot at rest."""

    def reply(self, text: str) -> str:
        return "error" if text == "stop" else super().reply(text)


class Mortal(Deviating):
    """Dies of a capital letter."""

    def answer(self, connection: socket.socket, line: bytes) -> bool:
        if line == b"HELLO":
            self.shutdown()
            self.socket.close()
        return line != b"HELLO" and super().answer(connection, line)


class Moving(Deviating):
    """Its robot moves."""

    def reply(self, text: str) -> str:
        return super().reply(text).replace("stopped", "moving")


@contextmanager
def serving(kind: type[Original]) -> Iterator[Original]:
    """A server of a kind, until the context is left."""
    server = kind()
    try:
        yield server
    finally:
        server.close()

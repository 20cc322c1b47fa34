"""Servers to be checked: one that does as the original does, and others that deviate in one thing."""

from __future__ import annotations

import contextlib
import re
import socket
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

from tests.talking import DEADLINE_S

NUMBERS = {
    "get joint position": "0.0 0.5 -0.0 -1.25 0.0 1.0E-5 0.0",
    "get joint torque": "0.0 0.0 0.0 0.0 0.0 0.0 0.0",
    "get tool frame": "450.0 0.0 520.25 0.0 -1.5 0.0",
    "get flange frame": "450.0 0.0 560.25 0.0 -1.5 0.0",
    "get cartesian force": "0.0 0.0 0.0 0.0 0.0 0.0",
}
REPLIES = {"hello": "hello", "bye": "bye", "stop": "done", "get status": "stopped", **NUMBERS}


class Original:
    """Serves one client after the other, with a robot that stands still. It has no extensions."""

    answers_a_rest = True
    """What stands behind the last line end when the stream ends."""

    def __init__(self) -> None:
        self.heard: list[str] = []
        """Every line of every client."""
        self.taken: Counter[int] = Counter()
        """Bytes that have been read and answered, or not answered for good, by the client's port."""
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self._ended = False
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def close(self) -> None:
        """Listens no more."""
        self._ended = True
        with socket.socket() as last:  # wakes it
            last.connect_ex(("127.0.0.1", self.port))
        self._thread.join(DEADLINE_S)
        assert not self._thread.is_alive()
        self._listener.close()

    def _serve(self) -> None:
        while not self._ended:
            connection, _ = self._listener.accept()
            self._serve_one(connection)

    def _serve_one(self, connection: socket.socket) -> None:
        with connection, contextlib.suppress(OSError):
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.serve(connection)

    def serve(self, connection: socket.socket) -> None:
        """One client, until it goes or has said bye."""
        rest = b""
        while data := connection.recv(65536):
            *lines, rest = self.split(rest + data)
            for line in lines:
                if not self.answer(connection, line):
                    return
            self.taken[connection.getpeername()[1]] += len(data)
        if rest and self.answers_a_rest:
            self.answer(connection, rest)

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


class Deviating(Original):
    """Serves all clients at once."""

    def __init__(self) -> None:
        self._clients: list[threading.Thread] = []
        super().__init__()

    def close(self) -> None:
        super().close()
        for client in self._clients:
            client.join(DEADLINE_S)
            assert not client.is_alive()

    def _serve(self) -> None:
        while not self._ended:
            connection, _ = self._listener.accept()
            self._clients.append(threading.Thread(target=self._serve_one, args=[connection]))
            self._clients[-1].start()


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

    def _serve(self) -> None:
        with contextlib.suppress(OSError):
            super()._serve()

    def answer(self, connection: socket.socket, line: bytes) -> bool:
        if line == b"HELLO":
            self._ended = True
            self._listener.shutdown(socket.SHUT_RDWR)  # nobody is accepted any more
            return False
        return super().answer(connection, line)


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

"""One connection to a server of the iiwa's line protocol: lines out, replies in and checked."""

import math
import socket
import tomllib
from importlib.resources import files
from types import TracebackType
from typing import Any, Self

_TABLE = tomllib.loads(files("iiwa_sim.protocol").joinpath("iiwa.toml").read_text())
_COMMANDS: dict[str, Any] = _TABLE["command"]

_MAX_REPLY_BYTES = 65536
_REASON = "its log has the reason"


class CommandError(Exception):
    """The robot answered `error`; the message quotes the command."""


class UnknownCommandError(CommandError):
    """The robot answered `unknown command`: the server is older than this client, or another one."""


class ReplyError(Exception):
    """The reply does not fit the command: client and server are out of step, or the protocol is another."""


class Connection:
    """One connection. Not for use by several threads at once.

    Every command raises CommandError where the robot answers `error`, ReplyError where the answer makes no
    sense, and OSError (TimeoutError among them) where the connection fails. The latter two close the
    connection: a late reply would be taken for the next one's. On a closed one every command raises
    ConnectionError, an OSError. Wrong counts and numbers that are not finite raise ValueError before anything
    is sent.
    """

    def __init__(self, host: str, port: int, timeout_s: float = 5.0) -> None:
        """Connects; `timeout_s` bounds that and the wait for each reply."""
        self._socket = socket.create_connection((host, port), timeout_s)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._replies = self._socket.makefile("rb")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Ends the connection. A robot that still carries out a move of this client stops."""
        self._replies.close()
        self._socket.close()

    def _command(self, name: str, *values: float) -> str:
        """Sends a command that answers a word of the table, and returns that word."""
        reply = self._text(name, *values)
        if reply not in _COMMANDS[name]["reply"]["words"]:
            raise self._nonsense(name, reply)
        return reply

    def _numbers(self, name: str, *values: float) -> list[float]:
        """Sends a command that answers numbers: as many as the table says, or any number of them."""
        text, expected = self._text(name, *values), _COMMANDS[name]["reply"]
        try:
            numbers = [float(word) for word in text.split()]
        except ValueError:
            raise self._nonsense(name, text) from None
        if "list" not in expected and len(numbers) != len(expected["values"].split()):
            raise self._nonsense(name, text)
        return numbers

    def _text(self, name: str, *values: float) -> str:
        """Sends a command with its parameters, and returns the reply as it is."""
        row = _COMMANDS[name]
        expected = len(row.get("parameters", "").split())
        if len(values) not in (expected, expected + len(row.get("optional", "").split())):
            raise ValueError(f"{name}: expected {expected} numbers, got {len(values)}")
        if not all(map(math.isfinite, values)):
            raise ValueError(f"{name}: expected finite numbers, got {values}")
        parameters = " ".join(repr(float(value)) for value in values)
        return self._ask(f"{name} : {parameters}" if values else name)

    def _nonsense(self, name: str, reply: str) -> ReplyError:
        """The fault to raise where a reply does not fit; the connection is closed."""
        self.close()
        return ReplyError(f"{name} answered {reply!r}")

    def _ask(self, line: str) -> str:
        """Sends a line and returns the line it is answered by."""
        if self._socket.fileno() < 0:
            raise ConnectionError("this connection is closed; a new Iiwa(host, port) opens another")
        try:
            self._socket.sendall(line.encode() + b"\r\n")
            reply = self._replies.readline(_MAX_REPLY_BYTES)
            if not reply.endswith(b"\n"):
                raise ConnectionResetError(f"the connection ended before the answer to {line!r}")
        except BaseException:
            self.close()
            raise
        text = reply.decode("ascii", "replace").strip()
        if text == "unknown command":
            raise UnknownCommandError(f"the server answered unknown command to {line!r}; {_REASON}")
        if text == "error":
            raise CommandError(f"the server answered error to {line!r}; {_REASON}")
        return text

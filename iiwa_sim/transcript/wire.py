"""A client's connection as a stream of bytes with time limits.

Replies are lines in the iiwa's protocol, XML messages in that of KRC4.
"""

import contextlib
import re
import socket
import struct
import time

from iiwa_sim.protocols.decimals import readable
from iiwa_sim.protocols.krc4_xml import REPLY, Broken, XmlStream
from iiwa_sim.server.listening import host_and_port
from iiwa_sim.transcript.fault import NoServer, TranscriptFault
from iiwa_sim.wording import harmless

RECEIVE_BYTES = MAX_REPLY_BYTES = 65536
TIMEOUT_S = 5.0
_END = re.compile(rb"[\r\n]")
_PARTNER = {b"\r": b"\n", b"\n": b"\r"}
_OPENING = f"<{REPLY}".encode()


class NoReply(Exception):
    """No reply came; the message tells for how long, or that the connection has ended."""


class Connection:
    """A connection that sends and receives bytes."""

    def __init__(self, host: str, port: int, timeout_s: float = TIMEOUT_S) -> None:
        """Connects; `timeout_s` bounds that and the wait for each reply. Raises NoServer."""
        self.timeout_s = timeout_s
        self.server = host_and_port(host, port)
        try:
            self._socket = socket.create_connection((host, port), timeout_s)
        except (OSError, ValueError) as fault:  # ValueError: characters that no host name has
            why = getattr(fault, "strerror", None) or fault
            raise NoServer(f"cannot connect to {self.server}: {why}") from None
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, data: bytes) -> None:
        """Send data. Raises NoReply if the connection has ended."""
        try:
            self._socket.settimeout(self.timeout_s)
            self._socket.sendall(data)
        except OSError as fault:
            raise NoReply(_why(fault)) from None

    def sends_no_more(self) -> None:
        """Close the sending side."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_WR)

    def receive(self) -> bytes:
        """The next piece of data; b"" at the end of the stream. Raises NoReply."""
        return self._receive(self.timeout_s, time.monotonic() + self.timeout_s)

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()

    def vanish(self) -> None:
        """Reset the connection, as that of a driver that crashed."""
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self._socket.close()

    def _receive(self, patience_s: float, deadline: float) -> bytes:
        left_s = deadline - time.monotonic()
        try:
            if left_s <= 0.0:  # also if bytes keep coming
                raise TimeoutError
            self._socket.settimeout(left_s)
            return self._socket.recv(RECEIVE_BYTES)
        except TimeoutError:
            raise NoReply(f"no reply within {patience_s:g} s") from None
        except OSError as fault:
            raise NoReply(_why(fault)) from None


class ReplyLines:
    r"""Splits received bytes into replies, which end with `\n`, `\r`, `\r\n` or `\n\r`."""

    def __init__(self) -> None:
        self._received = b""
        self._partner = b""  # would complete the line end of the last reply

    def feed(self, data: bytes) -> None:
        """Add received bytes."""
        self._received += data

    @property
    def unread(self) -> bytes:
        """Received bytes that have not been taken as a line."""
        if self._received:
            self._received = self._received.removeprefix(self._partner)
            self._partner = b""
        return self._received

    def take(self) -> bytes | None:
        """Return the next line, without its end; None until it is complete."""
        end = _END.search(self.unread)
        if end is None:
            return None
        line, self._received = self._received[: end.start()], self._received[end.end() :]
        self._partner = _PARTNER[end.group()]
        return line


class Wire(Connection):
    """A connection on which each reply is a line."""

    def __init__(self, host: str, port: int, timeout_s: float = TIMEOUT_S) -> None:
        """Arguments are those of `Connection`."""
        super().__init__(host, port, timeout_s)
        self._replies = ReplyLines()

    def reply(self, timeout_s: float | None = None) -> str:
        """The next line without its end, escaped to printable ASCII.

        Raises NoReply, and TranscriptFault for a server that speaks KRC4 messages.
        """
        patience_s = self.timeout_s if timeout_s is None else timeout_s
        deadline = time.monotonic() + patience_s
        while (line := self._replies.take()) is None:
            try:
                data = self._receive(patience_s, deadline)
            except NoReply:
                self._look_for_messages()
                raise
            if not data:
                self._look_for_messages()
                raise NoReply("the connection ended")
            self._replies.feed(data)
            if len(self._replies.unread) > MAX_REPLY_BYTES:
                raise NoReply(f"no line end within {MAX_REPLY_BYTES} bytes")
        return readable(line)

    def ask(self, line: bytes) -> str:
        """Send a line and return its reply. Raises NoReply."""
        self.send(line + b"\r\n")
        return self.reply()

    @property
    def unread(self) -> str:
        """Data that has been received but not read, as far as it is known."""
        return readable(self._replies.unread)

    def _look_for_messages(self) -> None:
        """Recognise a server of KRC4 messages, which answers a line with a message and no line end."""
        if self._replies.unread.startswith(_OPENING):
            raise TranscriptFault(f"{self.server} answers with KRC4 messages, expected the iiwa's protocol")


class MessageWire(Connection):
    """A connection on which each reply is a KRC4 message."""

    def __init__(self, host: str, port: int, timeout_s: float = TIMEOUT_S) -> None:
        """Arguments are those of `Connection`."""
        super().__init__(host, port, timeout_s)
        self._replies = XmlStream()
        self._heard = False

    def reply(self) -> str:
        """The next message verbatim, escaped to printable ASCII.

        Raises NoReply, and TranscriptFault for a server that answers with something else.
        """
        try:
            return self._next()
        except NoReply as fault:
            if not self._heard and not self._replies.unread:
                self._look_for_lines(fault)
            raise

    @property
    def unread(self) -> str:
        """Data that has been received but not read, as far as it is known."""
        return readable(self._replies.unread)

    def _next(self) -> str:
        deadline = time.monotonic() + self.timeout_s
        while (found := self._replies.next()) is None:
            data = self._receive(self.timeout_s, deadline)
            if not data:
                raise NoReply("the connection ended")
            self._replies.receive(data)
        wire = readable(self._replies.wire)
        if isinstance(found, Broken):
            if not self._heard:
                raise TranscriptFault(f"{self.server} answers '{wire}', expected KRC4 messages")
            raise NoReply(f"{found.reason}: '{wire}'")
        self._heard = True
        return wire

    def _look_for_lines(self, fault: NoReply) -> None:
        """Recognise a server of lines, which waits for a line end; between messages that is ignored."""
        with contextlib.suppress(NoReply):
            self.send(b"\r\n")
            self._next()
            raise fault  # a message, but a late one


def _why(fault: OSError) -> str:
    return f"the connection failed: {harmless(str(fault.strerror or fault))}"

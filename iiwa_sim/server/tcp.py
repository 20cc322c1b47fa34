"""A TCP server of sessions: bytes in, replies out, one session for each connection, in turns with the others.

Connections that speak HTTP or TLS are rejected. A web browser sends data to any port of this machine and its
network when a web page asks it to. The page chooses the body of an HTTP request, whose lines would be taken
for commands, and parts of a TLS greeting.
"""

import asyncio
import contextlib
import logging
import re
import socket
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from iiwa_sim.protocols.faults import End, Silence, Step, WireFaults
from iiwa_sim.protocols.session import Session
from iiwa_sim.server.budget import Budget
from iiwa_sim.server.listening import Acceptor, peer_of, reset_at_close, why

SEND_BYTES = 131_072
"""Size of the system's send buffer. When it and asyncio's buffer of 64 KiB are full, commands wait."""
UNREAD_S = 10.0
"""Time (s) for which a client may leave its replies unread once all buffers are full."""

_BROWSER = re.compile(rb"[A-Z]{3,7} [/*]|\x16\x03")  # HTTP, or TLS

logger = logging.getLogger(__name__)


class Admission:
    """Admission of clients in the order in which they connect, all at once or (`exclusive`) one by one."""

    def __init__(self, exclusive: bool = False) -> None:
        self._exclusive = exclusive
        self._clients: dict[Connection, bool] = {}  # in their order, True for those admitted

    def arrives(self, client: "Connection") -> None:
        """Add a client, whose `serve` is called at once or later."""
        self._clients[client] = False
        self._admit()

    def leaves(self, client: "Connection") -> None:
        """Forget a client that has gone, admitted or not."""
        del self._clients[client]
        self._admit()

    def _admit(self) -> None:
        for client in [client for client, is_admitted in self._clients.items() if not is_admitted]:
            if not (self._exclusive and any(self._clients.values())):
                self._clients[client] = True
                client.serve()


class Connection(asyncio.BufferedProtocol):
    """One client.

    It is not read while its lines wait for their turn, and while it leaves replies unread no line is
    answered: a client that floods fills only its own buffers. Nothing is read before the client is admitted.
    While wire faults are set for it, lines are answered one by one. While a fault delays a reply, no further
    line is answered.
    """

    def __init__(self, server: "TcpServer") -> None:
        self._server = server
        self._loop = asyncio.get_running_loop()
        self._buffer = bytearray(4096)  # bytes read at once: some ms of work
        self._is_known = False  # to be no browser, by the first bytes that came
        self._is_admitted = False
        self._sent_end = False
        self._unread: asyncio.TimerHandle | None = None  # runs while replies wait to be read
        self._sending: asyncio.Task[None] | None = None  # runs while a wire fault changes a reply

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self.transport, server = transport, self._server
        self._name = f"{peer_of(transport)}{server.suffix}"
        self._mark = {"fields": {"session": self._name}}
        self._session = server.open_session(self._name)
        tune(transport.get_extra_info("socket"), server.send_bytes)
        self._number = server.faults.arrives(self, self._name)
        logger.info("%s connected", self._name, extra=self._mark)
        server.on_answered(False)
        server.connections.add(self)
        transport.pause_reading()
        server.admission.arrives(self)

    def serve(self) -> None:
        """Notice that the client is admitted: read from it."""
        self._is_admitted = True
        self.transport.resume_reading()

    def get_buffer(self, _: int) -> bytearray:
        return self._buffer

    def buffer_updated(self, nbytes: int) -> None:
        data = bytes(self._buffer[:nbytes])
        if not self._is_known and _BROWSER.match(data):
            text = "%s closed: it sent an HTTP request or TLS, as a web page would have it"
            logger.warning(text, self._name, extra=self._mark)
            self.transport.abort()
            return
        self._is_known = True
        self._session.receive(data)
        self.go_on()

    def eof_received(self) -> bool:
        self._sent_end = True
        self._session.end()
        self.go_on()
        return True  # the transport stays open for unsent bytes

    def pause_writing(self) -> None:
        self._unread = self._loop.call_later(UNREAD_S, self._drop_unread)

    def resume_writing(self) -> None:
        if self._unread is not None:
            self._unread.cancel()
            self._unread = None
        self.go_on()

    def connection_lost(self, exc: Exception | None) -> None:
        for waiting in (self._unread, self._sending):
            if waiting is not None:
                waiting.cancel()
        self._server.faults.leaves(self._number)
        self._server.connections.discard(self)
        logger.info("%s disconnected%s", self._name, f": {why(exc)}" if exc else "", extra=self._mark)
        self._session.lost()
        self._server.admission.leaves(self)

    def go_on(self) -> None:
        """Answer waiting lines in turn."""
        if self._server.budget.ask(self._work):
            self.transport.pause_reading()

    def end(self, how: End) -> None:
        """End the connection."""
        if how is End.RST:
            reset_at_close(self.transport.get_extra_info("socket"))
            self.transport.abort()
        else:
            self.close()

    def offer(self, data: Callable[[], bytes]) -> None:
        """Send data now if the system has taken all that was sent before."""
        if not (self.transport.get_write_buffer_size() or self.transport.is_closing()):
            self.transport.write(data())

    def close(self) -> None:
        """Send the replies there are and close; commands without a reply get none."""
        self.transport.close()
        if self._unread is None and self.transport.get_write_buffer_size():
            self._unread = self._loop.call_later(UNREAD_S, self._drop_unread)
        if self._session.closing:
            self._server.on_good_bye()

    def _work(self, until_s: float) -> bool:
        """Answer waiting lines, up to `until_s`; return True if more can be done."""
        session, server = self._session, self._server
        try:
            if session.waiting:
                self._answer(until_s)
                server.on_answered(session.awaits)
        except Exception:
            logger.exception("%s dropped: internal error", self._name, extra=self._mark)
            self.transport.abort()
        if self.transport.is_closing():
            return False
        if session.waiting or self._is_held_back:
            self.transport.pause_reading()
            return not self._is_held_back
        if session.closing or (self._sent_end and not server.lasting):
            self.close()
        elif self._is_admitted and not self._sent_end:
            self.transport.resume_reading()
        return False

    def _answer(self, until_s: float) -> None:
        session, faults, replies, most = self._session, self._server.faults, list[bytes](), 1
        while session.waiting and not (self._is_held_back or self.transport.is_closing()):
            if faults.rules and (rule := faults.next_of(self._number)):
                steps = faults.steps(self._number, rule, session.answer(1))
                self._sending = self._loop.create_task(self._send(steps))
            else:
                replies.append(session.answer(most))
                most *= 2  # The clock is read seldom, but soon enough where lines take long.
            if time.monotonic() >= until_s:
                break
        if replies:
            self.transport.write(b"".join(replies))

    @property
    def _is_held_back(self) -> bool:
        """Return True while a changed reply, unread ones or silence hold back the next line."""
        faults = self._server.faults
        rule = faults.next_of(self._number) if faults.rules and self._session.waiting else None
        is_silent = rule is not None and isinstance(rule.fault, Silence)
        return is_silent or self._sending is not None or self._unread is not None

    async def _send(self, steps: list[Step]) -> None:
        for step in steps:
            if isinstance(step, bytes):
                self.transport.write(step)
            elif isinstance(step, End):
                self.end(step)
            else:
                await asyncio.sleep(step)
        self._sending = None
        self.go_on()

    def _drop_unread(self) -> None:
        logger.warning("%s dropped: left its replies unread for %g s", self._name, UNREAD_S, extra=self._mark)
        self.transport.abort()


@dataclass(eq=False, kw_only=True)
class TcpServer:
    """TCP server with one session for every connection to `host`:`port`; port 0 picks a free one.

    `admission`, `budget` and wire `faults` may be shared with other servers of the loop. A client that waits
    to be admitted is connected, but nothing is read from it.
    """

    open_session: Callable[[str], Session]
    """Opens the session of a client with this name."""
    host: str
    port: int
    admission: Admission = field(default_factory=Admission)
    budget: Budget = field(default_factory=Budget)
    on_answered: Callable[[bool], None] = lambda _: None
    """Called before a client is added, and after its commands, with what its session `awaits`."""
    on_good_bye: Callable[[], None] = lambda: None
    """Called after a client has said good-bye and been answered."""
    faults: WireFaults = field(default_factory=WireFaults)
    suffix: str = ""
    """Follows the address of a client in its name."""
    send_bytes: int = SEND_BYTES
    lasting: bool = False
    """True to keep connections whose client sends no more."""

    def __post_init__(self) -> None:
        self.connections: set[Connection] = set()
        self.acceptor = Acceptor(self.host, self.port, self._open)

    async def start(self) -> None:
        """Start listening. Raises ListenFault."""
        await self.acceptor.start()

    async def close(self) -> None:
        """Stop listening and close every connection. Replies that the system has not taken are lost."""
        self.acceptor.close()
        for connection in list(self.connections):
            connection.close()
            connection.transport.abort()
        if self.connections:
            await asyncio.sleep(0)  # in which their sessions end

    async def _open(self, connection: socket.socket, _peer: object) -> None:
        await asyncio.get_running_loop().connect_accepted_socket(lambda: Connection(self), connection)


def tune(connection: socket.socket, send_bytes: int) -> None:
    """Size the send buffer, and detect a vanished host in about 11 s."""
    with contextlib.suppress(OSError):  # already gone
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, send_bytes)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        if sys.platform == "linux":
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, 5)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPINTVL, 2)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPCNT, 3)

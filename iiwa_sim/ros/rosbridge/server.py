"""rosbridge on a WebSocket port: messages in, messages out. Needs the library websockets.

The library takes frames apart and makes them; bytes are read and written here, so that all a client causes,
its pings and the messages of its topics too, comes out of the one budget.
"""

import asyncio
import logging
import socket
import time
from collections import deque
from collections.abc import Callable
from typing import Protocol

from websockets.frames import Frame, Opcode
from websockets.http11 import Request
from websockets.protocol import State
from websockets.server import ServerProtocol

from iiwa_sim.serve.budget import Budget
from iiwa_sim.serve.listening import Acceptor, open_listener, peer_of, why
from iiwa_sim.serve.socket_options import find_out
from iiwa_sim.serve.web_access import WebAccess

LONGEST_FRAME_BYTES = 262_144
"""A longer message closes its connection: some hundred commands fit in, and are read in some milliseconds."""
RECEIVE_BYTES = 65_536
"""Bytes taken from a connection at once."""
BITE_BYTES = 128
"""Of these, taken apart before the clock is looked at: some twenty of the smallest frames."""
MOST_UNREAD_BYTES = 65_536
"""Of answers to pings that a client leaves unread, before nothing more is heard of it."""
SYSTEM_BYTES = 16_384
"""What the system is asked to hold each way: the less, the newer is what a slow client gets next."""
OPENING_S = 10.0
"""For a client to say what a WebSocket begins with."""
CLOSING_S = 1.0
"""For a client to answer that it is closed."""
POLICY_VIOLATION = 1008
FORBIDDEN = 403

logger = logging.getLogger(__name__)

_quiet = logging.getLogger(f"{__name__}.connections")
_quiet.setLevel(logging.CRITICAL)  # it has a traceback for everyone who knocks with something else


class Waiting(Protocol):
    """What waits to be sent to a client."""

    overflown: bool

    def next(self, now_s: float) -> tuple[str | bytes | None, float | None]:
        """What to send now, str as text and bytes as a binary frame, or how long until something is due, None
        if nothing is."""


class ClientSession(Protocol):
    """What one client says, without sockets."""

    closing: bool

    def receive(self, text: bytes) -> None:
        """A message."""

    def end(self) -> None:
        """The client has gone."""


class RosbridgeServer:
    """Serves every connection to `host`:`port` that has access, whatever path it asks for."""

    def __init__(
        self,
        open_session: Callable[[str, Callable[[], None]], tuple[ClientSession, Waiting]],
        host: str,
        port: int,
        on_heard: Callable[[], None],
        *,
        budget: Budget | None = None,
        access: WebAccess | None = None,
    ) -> None:
        """`open_session` takes the client's name and what is to be called when there is something to send.

        `on_heard` is called after messages. `budget` is shared with other servers of the loop.
        """
        self.open_session = open_session
        self.on_heard = on_heard
        self.budget = budget or Budget()
        self.access = access or WebAccess()
        self.buffer = memoryview(bytearray(RECEIVE_BYTES))  # of all clients: it is emptied at once
        self.connections: set[Connection] = set()
        self._asked = (host, port)
        self._acceptor: Acceptor | None = None

    async def start(self) -> None:
        """Listen. Raises ListenFault."""
        listener = await open_listener(*self._asked)
        for which in (socket.SO_RCVBUF, socket.SO_SNDBUF):  # of the connections, too
            listener.setsockopt(socket.SOL_SOCKET, which, SYSTEM_BYTES)
        self._acceptor = Acceptor(listener, lambda: Connection(self))

    @property
    def listening(self) -> bool:
        return self._acceptor is not None

    @property
    def address(self) -> tuple[str, int]:
        """Host and port listened on. Raises RuntimeError before `start` and after `close`."""
        if self._acceptor is None:
            raise RuntimeError("the server does not listen")
        return self._acceptor.address

    async def close(self) -> None:
        """Listen no more and close every connection; takes a little more than CLOSING_S at most."""
        if self._acceptor is None:
            return
        self._acceptor.close()
        self._acceptor = None
        for connection in list(self.connections):
            connection.close()
        if gone := [connection.gone for connection in self.connections]:
            await asyncio.wait(gone)


class Connection(asyncio.BufferedProtocol):
    """One client.

    What it sends is taken apart and heard as the budget has time for it; meanwhile little more is read. While
    it leaves unread what is sent to it, what waits for it stays in its outbox.
    """

    _transport: asyncio.Transport
    gone: asyncio.Future[None]
    """Done once the connection is."""

    def __init__(self, server: RosbridgeServer) -> None:
        self._server = server
        self._loop = asyncio.get_running_loop()
        self._share = server.budget.share(self._work)
        self._websocket = ServerProtocol(max_size=LONGEST_FRAME_BYTES, logger=_quiet)
        self._received = memoryview(b"")  # and not taken apart yet
        self._sent_end = False
        self._messages: deque[bytes] = deque()  # and not heard yet
        self._parts = bytearray()  # of a message that comes in several frames
        self._session: ClientSession | None = None  # until the WebSocket is open
        self._waiting: Waiting
        self._refused = False  # what it began with
        self._heard = False  # a message, and nobody has been told
        self._unread = False  # what has been sent last
        self._due: asyncio.TimerHandle | None = None  # when a message of a topic may be sent
        self._limit: asyncio.TimerHandle | None = None  # for what the client has to do now

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        transport.set_write_buffer_limits(0)
        self.gone = self._loop.create_future()
        self._name = f"{peer_of(transport)} (rosbridge)"
        self._mark = {"fields": {"session": self._name}}
        find_out(transport.get_extra_info("socket"))
        self._server.connections.add(self)
        self._grant(OPENING_S)
        if not self._server.listening:  # accepted while the server closed
            self._transport.abort()

    def get_buffer(self, _sizehint: int) -> memoryview:
        return self._server.buffer

    def buffer_updated(self, nbytes: int) -> None:
        self._received = memoryview(bytes(self._received) + self._server.buffer[:nbytes])
        if self._share.waits:
            self._transport.pause_reading()
        else:
            self._share.ask()

    def eof_received(self) -> bool:
        self._sent_end = True
        self._share.ask()
        return True  # closed when what came before has been heard

    def pause_writing(self) -> None:
        self._unread = True

    def resume_writing(self) -> None:
        self._unread = False
        self._share.ask()

    def connection_lost(self, exc: Exception | None) -> None:
        self._share.leave()
        for timer in (self._due, self._limit):
            if timer is not None:
                timer.cancel()
        self._server.connections.discard(self)
        self.gone.set_result(None)
        if self._session is not None:
            self._session.end()
            logger.info("%s disconnected%s", self._name, f": {why(exc)}" if exc else "", extra=self._mark)

    def close(self, code: int = 1001, reason: str = "") -> None:
        """Say so, and close when the client has said so, too, or after CLOSING_S."""
        if self._websocket.state is State.OPEN:
            self._websocket.send_close(code, reason)
            self._write()
            self._grant(CLOSING_S)
        elif self._websocket.state is State.CONNECTING:
            self._transport.abort()

    def _grant(self, seconds: float) -> None:
        if self._limit is not None:
            self._limit.cancel()
        self._limit = self._loop.call_later(seconds, self._transport.abort)

    def _work(self, until_s: float) -> bool:
        """Hear and say what there is until then; whether there is more."""
        cut_short = False
        try:
            while not (cut_short or self._transport.is_closing()) and self._does_something():
                cut_short = time.monotonic() >= until_s
            if self._heard:
                self._heard = False
                self._server.on_heard()
        except Exception:
            logger.exception("%s dropped: internal fault", self._name, extra=self._mark)
            self._transport.abort()
        return self._goes_on(cut_short)

    def _does_something(self) -> bool:
        """One step, if there is any to do."""
        if self._session is not None:
            if self._waiting.overflown:
                logger.warning(
                    "%s asks and does not read the answers: it is dropped", self._name, extra=self._mark
                )
                self._transport.abort()
                return False
            if self._session.closing:
                self._turn_out()
            if self._says():
                return True
            if self._messages:
                self._session.receive(self._messages.popleft())
                self._heard = True
                return True
        if self._received and self._takes_more:
            self._take_apart()
            return True
        return False

    @property
    def _takes_more(self) -> bool:
        """Not from one who pings and does not read the answers."""
        return self._transport.get_write_buffer_size() <= MOST_UNREAD_BYTES

    def _goes_on(self, cut_short: bool) -> bool:
        """Whether there may be more to do now; if not, see to it that it goes on or ends."""
        if self._transport.is_closing():
            return False
        if cut_short or self._messages or (self._received and self._takes_more):
            return True  # cut short, there may be more to say, too
        if self._sent_end:
            self._transport.close()
        elif self._received:
            self._transport.pause_reading()
        else:
            self._transport.resume_reading()
        return False

    def _says(self) -> bool:
        """Send the next message, if there is one and the client has taken those before; whether it is so."""
        if self._unread or self._websocket.state is not State.OPEN:
            return False
        message, wait_s = self._waiting.next(self._loop.time())
        if message is not None:
            self._send(message)
            return True
        if wait_s is not None and self._due is None:
            self._due = self._loop.call_later(wait_s, self._is_due)
        return False

    def _is_due(self) -> None:
        self._due = None
        self._share.ask()

    def _send(self, message: str | bytes) -> None:
        if isinstance(message, str):
            self._websocket.send_text(message.encode())
        else:
            self._websocket.send_binary(message)
        self._write()

    def _write(self) -> None:
        for data in self._websocket.data_to_send():
            if data:
                self._transport.write(data)
            else:  # the end, behind which the client may still send
                self._transport.write_eof()
                self._grant(CLOSING_S)

    def _turn_out(self) -> None:
        """Send why the client is closed, and close."""
        self._messages.clear()
        if self._websocket.state is State.OPEN:
            while (message := self._waiting.next(0.0)[0]) is not None:
                self._send(message)
            self.close(POLICY_VIOLATION)

    def _take_apart(self) -> None:
        length = BITE_BYTES
        if self._session is None:  # what follows the request is looked at once that is answered
            length = bytes(self._received[:BITE_BYTES]).find(b"\n") + 1 or BITE_BYTES
        bite, self._received = self._received[:length], self._received[length:]
        self._websocket.receive_data(bytes(bite))
        if (fault := self._websocket.handshake_exc) is not None and not self._refused:
            self._refuse(str(fault.__cause__ or fault))
        for event in self._websocket.events_received():
            if isinstance(event, Request):
                self._open(event)
            elif isinstance(event, Frame) and event.opcode in (Opcode.TEXT, Opcode.BINARY, Opcode.CONT):
                self._parts += event.data
                if event.fin:
                    self._messages.append(bytes(self._parts))
                    self._parts.clear()
        self._write()

    def _open(self, request: Request) -> None:
        headers = request.headers
        refusal = self._server.access.refusal(headers.get_all("Host"), headers.get_all("Origin"))
        if refusal is None:
            response = self._websocket.accept(request)
            if (fault := self._websocket.handshake_exc) is not None:
                self._refuse(str(fault))
        else:
            response = self._websocket.reject(FORBIDDEN, f"{refusal}\n")
            self._refuse(refusal)
        self._websocket.send_response(response)
        if self._websocket.state is State.OPEN:
            if self._limit is not None:
                self._limit.cancel()
            self._session, self._waiting = self._server.open_session(self._name, self._share.ask_later)
            logger.info("%s connected", self._name, extra=self._mark)

    def _refuse(self, reason: str) -> None:
        self._refused = True
        logger.warning("%s refused: %s", self._name, reason, extra=self._mark)

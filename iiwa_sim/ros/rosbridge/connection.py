"""One WebSocket connection of rosbridge: frames in, frames out. Needs the library websockets.

The library parses and makes frames. Bytes are read and written here, so that all work a client causes,
including pings and the messages of its topics, is charged to the shared budget.
"""

import asyncio
import logging
import time
from collections import deque
from typing import TYPE_CHECKING

from websockets.frames import Frame, Opcode
from websockets.http11 import Request
from websockets.protocol import State
from websockets.server import ServerProtocol

from iiwa_sim.server.connection import CLOSING_S, Connection
from iiwa_sim.server.socket_options import find_out

if TYPE_CHECKING:
    from iiwa_sim.ros.rosbridge.outbox import Outbox
    from iiwa_sim.ros.rosbridge.server import RosbridgeServer
    from iiwa_sim.ros.rosbridge.session import RosbridgeSession

LONGEST_FRAME_BYTES = 262_144
"""A longer message closes its connection. About a hundred commands fit in, and are parsed in some
milliseconds."""
BITE_BYTES = 128
"""Bytes parsed before the clock is checked: about twenty of the smallest frames."""
MOST_UNREAD_BYTES = 65_536
"""Bytes of answers to pings that a client may leave unread before nothing more is read from it."""
OPENING_S = 10.0
"""Seconds for a client to complete the opening handshake."""
POLICY_VIOLATION = 1008
FORBIDDEN = 403

logger = logging.getLogger(__name__)

_quiet = logging.getLogger(f"{__name__}.connections")
_quiet.setLevel(logging.CRITICAL)  # the library logs a traceback for every client that speaks something else


class RosbridgeConnection(Connection):
    """One client.

    Its messages are parsed and handled as the budget allows; meanwhile little more is read. While it leaves
    frames unread, further ones stay in its outbox.
    """

    _server: "RosbridgeServer"

    def __init__(self, server: "RosbridgeServer") -> None:
        super().__init__(server, " (rosbridge)")
        self._websocket = ServerProtocol(max_size=LONGEST_FRAME_BYTES, logger=_quiet)
        self._parsed = 0  # bytes of what was received
        self._messages: deque[bytes] = deque()  # not handled yet
        self._parts = bytearray()  # parts of a fragmented message
        self._session: RosbridgeSession | None = None  # until the handshake is complete
        self._waiting: Outbox
        self._refused = False  # the opening request
        self._heard = False  # a message came that on_heard has not been called for
        self._unread = False  # the last frame has been sent
        self._due: asyncio.TimerHandle | None = None  # until a message of a topic may be sent

    def _begin(self) -> None:
        self._transport.set_write_buffer_limits(0)
        find_out(self._transport.get_extra_info("socket"))
        self._grant(OPENING_S)

    def pause_writing(self) -> None:
        self._unread = True

    def resume_writing(self) -> None:
        super().resume_writing()
        self._unread = False
        self._share.ask()

    def connection_lost(self, exc: Exception | None) -> None:
        if self._due is not None:
            self._due.cancel()
        super().connection_lost(exc)
        if self._session is not None:
            self._session.end()

    def close(self, code: int = 1001, reason: str = "") -> None:
        """Start the closing handshake; closes when the client answers, or after CLOSING_S."""
        if self._websocket.state is State.OPEN:
            self._websocket.send_close(code, reason)
            self._write()
            self._grant(CLOSING_S)
        elif self._websocket.state is State.CONNECTING:
            self._transport.abort()

    def _work(self, until_s: float) -> bool:
        """Handle and send messages until `until_s`; returns whether more can be done."""
        cut_short = False
        try:
            while not (cut_short or self._transport.is_closing()) and self._does_something():
                cut_short = time.monotonic() >= until_s
            if self._heard:
                self._heard = False
                self._server.on_heard()
        except Exception as fault:  # noqa: BLE001  # told in the log
            self._drop(fault)
        return self._goes_on(cut_short)

    def _does_something(self) -> bool:
        """Make one step, if there is anything to do; returns whether there was."""
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
        """Whether more may be read: not from a client that pings and leaves the answers unread."""
        return self._transport.get_write_buffer_size() <= MOST_UNREAD_BYTES

    def _goes_on(self, cut_short: bool) -> bool:
        """Whether there may be more to do now; if not, arrange for the work to go on later or to end."""
        if self._transport.is_closing():
            return False
        if cut_short or self._messages or (self._received and self._takes_more):
            return True  # after a break there may be more to send as well
        if self._sent_end:
            self._transport.close()
        elif self._received:
            self._transport.pause_reading()
        else:
            self._transport.resume_reading()
        return False

    def _says(self) -> bool:
        """Send the next frame, if there is one and the client has taken those before; returns whether it
        was sent."""
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
            else:  # the end of the stream, after which the client may still send
                self._send_end()

    def _turn_out(self) -> None:
        """Send why the client is refused, and close."""
        self._messages.clear()
        if self._websocket.state is State.OPEN:
            while (message := self._waiting.next(0.0)[0]) is not None:
                self._send(message)
            self.close(POLICY_VIOLATION)

    def _take_apart(self) -> None:
        bite = self._received[self._parsed : self._parsed + BITE_BYTES]
        if self._session is None:  # data behind the request is parsed after the answer
            bite = bite[: bite.find(b"\n") + 1 or BITE_BYTES]
        self._parsed += len(bite)
        if self._parsed == len(self._received):
            self._received, self._parsed = b"", 0
        self._websocket.receive_data(bite)
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
            self._tell_connected()

    def _refuse(self, reason: str) -> None:
        self._refused = True
        logger.warning("%s refused: %s", self._name, reason, extra=self._mark)

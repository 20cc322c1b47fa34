"""What the connections of all servers share: they read, ask for time, and end."""

import asyncio
import logging
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any

from iiwa_sim.server.first_line import FromBrowserFault
from iiwa_sim.server.listening import peer_of, why

if TYPE_CHECKING:
    from iiwa_sim.server.server import Server

CLOSING_S = 1.0
"""Time (s) in which a client may close after the end of the stream. If the server closed first with data
unread, the system would reset the connection and the last answer could be lost."""

logger = logging.getLogger(__name__)


class Connection(asyncio.BufferedProtocol, ABC):
    """One client of a server.

    What it sends is kept in `_received` until `_work` is called, as the server's budget allows; while it
    waits for that, little more is read.
    """

    _server: "Server[Any]"
    _transport: asyncio.Transport
    gone: asyncio.Future[None]
    """Done when the connection is closed."""

    def __init__(self, server: "Server[Any]", what: str = "") -> None:
        """`what` follows the address of the client in the log."""
        self._server = server
        self._what = what
        self._loop = asyncio.get_running_loop()
        self._share = server.budget.share(self._work)
        self._received = b""
        self._sent_end = False
        self._owes_end = False  # the end of the stream is to be sent behind what the system has not taken yet
        self._is_told = False  # the log has it as connected
        self._limit: asyncio.TimerHandle | None = None  # until the client has to act

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        self.gone = self._loop.create_future()
        self._name = f"{peer_of(transport)}{self._what}"
        self._mark = {"fields": {"session": self._name}}
        self._begin()
        self._server.connections.add(self)
        if not self._server.listening:  # accepted while the server closed
            self.close()

    def get_buffer(self, _sizehint: int) -> memoryview:
        return self._server.buffer

    def buffer_updated(self, nbytes: int) -> None:
        self._received += self._server.buffer[:nbytes]
        if self._share.waits:
            self._transport.pause_reading()
        else:
            self._share.ask()

    def eof_received(self) -> bool:
        self._sent_end = True
        self._share.ask()
        return True  # the transport stays open for what is to be sent

    def resume_writing(self) -> None:
        if self._owes_end:
            self._loop.call_soon(self._send_end)  # not at once: asyncio is about to look what this leaves

    def connection_lost(self, exc: Exception | None) -> None:
        self._share.leave()
        if self._limit is not None:
            self._limit.cancel()
        self._server.connections.discard(self)
        self.gone.set_result(None)
        if self._is_told:
            logger.info("%s disconnected%s", self._name, f": {why(exc)}" if exc else "", extra=self._mark)

    @abstractmethod
    def close(self) -> None:
        """Close, at once or soon."""

    def abort(self) -> None:
        """Close at once, without sending what waits."""
        self._transport.abort()

    @abstractmethod
    def _begin(self) -> None:
        """Prepare for the client: it is connected."""

    @abstractmethod
    def _work(self, until_s: float) -> bool:
        """Do what waits, up to `until_s`; returns whether there is more. Lets no exception out."""

    def _send_end(self) -> None:
        """Send the end of the stream behind what was written; then the client has CLOSING_S to close.

        While the system has not taken all of that, this waits for `resume_writing`. asyncio would do so, too,
        but it lets out the system's error where the client has gone meanwhile.
        """
        self._owes_end = self._transport.get_write_buffer_size() > 0
        if not self._owes_end:
            self._grant(CLOSING_S)
            try:
                self._transport.write_eof()
            except OSError:
                self.abort()

    def _drop(self, fault: Exception) -> None:
        """End the connection, in whose work this has been raised."""
        if isinstance(fault, FromBrowserFault):
            told = "%s closed: it sent %s, as a web page would have it"
            logger.warning(told, self._name, fault, extra=self._mark)
        else:
            logger.error("%s dropped: internal error", self._name, exc_info=fault, extra=self._mark)
        self.abort()

    def _tell_connected(self) -> None:
        self._is_told = True
        logger.info("%s connected", self._name, extra=self._mark)

    def _grant(self, seconds: float) -> None:
        """The connection is aborted unless it is granted more time until then."""
        if self._limit is not None:
            self._limit.cancel()
        self._limit = self._loop.call_later(seconds, self._transport.abort)

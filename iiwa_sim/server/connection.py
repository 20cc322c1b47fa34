"""A server of sessions, and one client of it: bytes in, replies out, in turns with the others."""

import asyncio
import logging
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from iiwa_sim.protocols.session import Session
from iiwa_sim.server.budget import Budget
from iiwa_sim.server.http_rejection import FromBrowserFault, passed_on
from iiwa_sim.server.listening import Acceptor, open_listener, peer_of, why

logger = logging.getLogger(__name__)


class Connection(asyncio.BufferedProtocol, ABC):
    """One client. It is not read while it waits for its turn; HTTP and TLS are rejected."""

    _transport: asyncio.Transport
    _session: Session
    gone: asyncio.Future[None]
    """Done when the connection is closed."""

    def __init__(self, server: "Server[Any]", what: str = "") -> None:
        """`what` follows the address of the client in the log."""
        self._server = server
        self._what = what
        self._loop = asyncio.get_running_loop()
        self._share = server.budget.share(self._work)
        self._received = b""
        self._passed = False  # the first line is neither HTTP nor TLS
        self._sent_end = False
        self._told_end = False  # the session knows of the end

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        self.gone = self._loop.create_future()
        self._name = f"{peer_of(transport)}{self._what}"
        self._mark = {"fields": {"session": self._name}}
        self._session = self._server.open_session(self._name)
        self._begin()
        logger.info("%s connected", self._name, extra=self._mark)
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

    def connection_lost(self, exc: Exception | None) -> None:
        self._share.leave()
        self._server.connections.discard(self)
        self.gone.set_result(None)
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
    def _answer(self, until_s: float) -> bool:
        """Do what waits, up to `until_s`; return whether more can be done."""

    def _work(self, until_s: float) -> bool:
        if self._transport.is_closing():
            return False
        try:
            self._hand_on()
            return self._answer(until_s)
        except FromBrowserFault as fault:
            text = "%s closed: it sent %s, as a web page would have it"
            logger.warning(text, self._name, fault, extra=self._mark)
        except Exception:
            logger.exception("%s dropped: internal error", self._name, extra=self._mark)
        self.abort()
        return False

    def _hand_on(self) -> None:
        """Pass the received bytes on to the session. Raises FromBrowserFault."""
        if self._received:
            self._passed = self._passed or passed_on(self._received, self._sent_end)
            if self._passed:
                self._session.receive(self._received)
                self._received = b""
        if self._sent_end and not self._told_end:
            self._told_end = True
            self._session.end()


C = TypeVar("C", bound=Connection)


class Server(Generic[C]):
    """Listens on `host`:`port`; port 0 picks a free one."""

    def __init__(
        self,
        open_connection: Callable[[], C],
        open_session: Callable[[str], Session],
        host: str,
        port: int,
        budget: Budget | None,
        receive_bytes: int,
    ) -> None:
        """`open_session` gets the name of a client; `budget` may be shared with other servers of the loop.

        `receive_bytes` are read from a client at once: making lines of them takes some ms at most.
        """
        self.open_session = open_session
        self.budget = budget or Budget()
        self.buffer = memoryview(bytearray(receive_bytes))  # of all connections: read and emptied at once
        self.connections: set[C] = set()
        self._open_connection = open_connection
        self._asked = (host, port)
        self._acceptor: Acceptor | None = None

    async def start(self) -> None:
        """Start listening. Raises ListenFault."""
        self._acceptor = Acceptor(await open_listener(*self._asked), self._open_connection)

    @property
    def listening(self) -> bool:
        return self._acceptor is not None

    @property
    def acceptor(self) -> Acceptor:
        """The listening port. Raises RuntimeError before `start` and after `close`."""
        if self._acceptor is None:
            raise RuntimeError("the server does not listen")
        return self._acceptor

    @property
    def address(self) -> tuple[str, int]:
        """Host and port listened on."""
        return self.acceptor.address

    async def close(self) -> None:
        """Stop listening, close every connection, and wait until all have gone."""
        if self._acceptor is None:
            return
        self._acceptor.close()
        self._acceptor = None
        gone = [connection.gone for connection in self.connections]
        for connection in list(self.connections):
            connection.close()
        if gone:
            await asyncio.wait(gone)

"""What the servers of a port share: they listen from `start` to `close`, and know their connections."""

import asyncio
import socket
from collections.abc import Callable, Sequence
from typing import Generic, Protocol, TypeVar

from iiwa_sim.server.budget import Budget
from iiwa_sim.server.listening import Acceptor, open_listener

RECEIVE_BYTES = 65_536
"""Bytes read from a connection at once. A buffer of our own makes an answer 30 us faster than asyncio's,
which allocates 256 KiB for every read."""


class OpenConnection(Protocol):
    """A connection as its server sees it. It adds itself to the server's connections, and removes itself."""

    gone: asyncio.Future[None]
    """Done once the connection is."""

    def close(self) -> None:
        """Close, at once or soon."""


class Served(Protocol):
    """Something that is there from `start` to `close`; to close what has not started does nothing."""

    async def start(self) -> None:
        """Start serving."""

    async def close(self) -> None:
        """Stop serving."""


async def start_all(served: Sequence[Served]) -> None:
    """Start these in their order. Raises what one of them raises, and then none is left open."""
    try:
        for each in served:
            await each.start()
    except BaseException:
        await close_all(served)
        raise


async def close_all(served: Sequence[Served]) -> None:
    """Close these, the last one first."""
    for each in reversed(served):
        await each.close()


C = TypeVar("C", bound=OpenConnection)


class Server(Generic[C]):
    """Listens on `host`:`port`; port 0 picks a free one."""

    def __init__(
        self,
        open_connection: Callable[[], asyncio.BaseProtocol],
        host: str,
        port: int,
        budget: Budget | None,
        *,
        receive_bytes: int = RECEIVE_BYTES,
        system_bytes: int | None = None,
    ) -> None:
        """`budget` may be shared with other servers of the loop. `receive_bytes` are read at once;
        `system_bytes` are those that the system is asked to hold each way for a connection, None for what it
        usually does."""
        self.budget = budget or Budget()
        self.buffer = memoryview(bytearray(receive_bytes))  # of all connections: read and emptied at once
        self.connections: set[C] = set()
        self._open_connection = open_connection
        self._asked = (host, port)
        self._system_bytes = system_bytes
        self._acceptor: Acceptor | None = None

    async def start(self) -> None:
        """Start listening. Raises ListenFault."""
        listener = await open_listener(*self._asked)
        if self._system_bytes is not None:
            for which in (socket.SO_RCVBUF, socket.SO_SNDBUF):  # for the connections as well
                listener.setsockopt(socket.SOL_SOCKET, which, self._system_bytes)
        self._acceptor = Acceptor(listener, self._open_connection)

    @property
    def listening(self) -> bool:
        return self._acceptor is not None

    @property
    def address(self) -> tuple[str, int]:
        """Host and port listened on. Raises RuntimeError before `start` and after `close`."""
        return self._port.address

    def refuse(self) -> None:
        """Refuse new connections until `accept`; connected clients are served. Raises ListenFault."""
        self._port.refuse()

    def accept(self) -> None:
        """Accept connections again."""
        self._port.accept()

    def drop_arriving(self, *, reset: bool) -> None:
        """Close or reset the connections that wait to be accepted."""
        self._port.drop_arriving(reset=reset)

    @property
    def _port(self) -> Acceptor:
        if self._acceptor is None:
            raise RuntimeError("the server does not listen")
        return self._acceptor

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

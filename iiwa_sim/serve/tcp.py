"""A TCP server for dialects that answer lines: one session for each connection."""

import asyncio
from collections.abc import Callable

from iiwa_sim.dialect.session import Session
from iiwa_sim.dialect.wire.wire_faults import WireFaults
from iiwa_sim.serve.admission import Admission
from iiwa_sim.serve.budget import Budget
from iiwa_sim.serve.line_connection import LineConnection
from iiwa_sim.serve.port import Port

RECEIVE_BYTES = 65_536
"""Bytes read from a connection at once. A buffer of our own makes an answer 30 us faster than asyncio's,
which allocates 256 KiB for every read."""

UNREAD_S = 10.0
"""Time (s) for which a client may leave its replies unread once all buffers are full."""

CLOSING_S = 0.3
"""Time (s) that a closing server gives its clients to take their last replies."""


class TcpServer:
    """Serves one session, from `open_session(client name)`, for every connection to `host`:`port`.

    `port` 0 picks a free one; `address` tells which. A host name stands for its first address, IPv4 before
    IPv6. A client that does not read its replies for `unread_s` is dropped. A client that waits to be
    admitted is connected, but nothing is read from it. `on_answered` is called after commands have been
    carried out, `on_good_bye` after a client has said good-bye and been answered. `faults` are the wire
    faults of its replies.
    """

    def __init__(
        self,
        open_session: Callable[[str], Session],
        host: str,
        port: int,
        *,
        unread_s: float = UNREAD_S,
        admission: Admission | None = None,
        budget: Budget | None = None,
        on_answered: Callable[[], None] | None = None,
        on_good_bye: Callable[[], None] | None = None,
        faults: WireFaults | None = None,
        dialect: str = "",
    ) -> None:
        """`admission` admits clients; without it all are served at once. `budget` may be shared with other
        servers of the loop.

        `dialect` names the dialect of this port, where `faults` are shared with ports of other dialects.
        """
        self.open_session = open_session
        self.unread_s = unread_s
        self.admission = admission or Admission()
        self.budget = budget or Budget()
        self.buffer = memoryview(bytearray(RECEIVE_BYTES))  # shared: read and emptied at once
        self.on_answered = on_answered
        self.on_good_bye = on_good_bye
        self.faults = faults or WireFaults()
        self.dialect = dialect
        self.connections: set[LineConnection] = set()
        self.listening = False
        self._port = Port(lambda: LineConnection(self), host, port)

    async def start(self) -> None:
        """Start listening. Raises ListenFault."""
        await self._port.open()
        self.listening = True

    @property
    def address(self) -> tuple[str, int]:
        """Host and port listened on."""
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

    async def close(self) -> None:
        """Stop listening and close every connection; takes little more than CLOSING_S at most."""
        if not self.listening:
            return
        self.listening = False
        self._port.close()
        self.admission.close()
        open_connections = list(self.connections)
        for connection in open_connections:
            connection.close()
        for grace_s in (CLOSING_S, None):
            if gone := [connection.gone for connection in self.connections]:
                await asyncio.wait(gone, timeout=grace_s)
            for connection in list(self.connections):
                connection.abort()

"""A TCP server for protocols that answer lines: one session for each connection."""

import asyncio
from collections.abc import Callable

from iiwa_sim.protocols.faults import WireFaults
from iiwa_sim.protocols.session import Session
from iiwa_sim.server.admission import Admission
from iiwa_sim.server.budget import Budget
from iiwa_sim.server.line_connection import LineConnection
from iiwa_sim.server.server import Server

READ_BYTES = 4096
"""Bytes read from a client at once: making lines of them takes time, some ms where all of them are telnet's
commands, in which nobody else is served and no tick is made."""
UNREAD_S = 10.0
"""Time (s) for which a client may leave its replies unread once all buffers are full."""

CLOSING_S = 0.3
"""Time (s) that a closing server gives its clients to take their last replies."""


class TcpServer(Server[LineConnection]):
    """Serves one session, from `open_session(client name)`, for every connection to `host`:`port`.

    `port` 0 picks a free one; `address` tells which. A host name stands for its first address, IPv4 before
    IPv6. A client that does not read its replies for `unread_s` is dropped. A client that waits to be
    admitted is connected, but nothing is read from it. `on_answered` is called after commands have been
    carried out, with what the session `awaits`, `on_good_bye` after a client has said good-bye and been
    answered. `faults` are the wire faults of its replies.
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
        on_answered: Callable[[bool], None] | None = None,
        on_good_bye: Callable[[], None] | None = None,
        faults: WireFaults | None = None,
        protocol: str = "",
    ) -> None:
        """`admission` admits clients; without it all are served at once. `budget` may be shared with other
        servers of the loop.

        `protocol` names the protocol of this port, where `faults` are shared with ports of other protocols.
        """
        super().__init__(lambda: LineConnection(self), host, port, budget, receive_bytes=READ_BYTES)
        self.open_session = open_session
        self.unread_s = unread_s
        self.admission = admission or Admission()
        self.on_answered = on_answered
        self.on_good_bye = on_good_bye
        self.faults = faults or WireFaults()
        self.protocol = protocol

    async def close(self) -> None:
        """Stop listening and close every connection; takes little more than CLOSING_S at most."""
        self.admission.close()
        late = asyncio.get_running_loop().call_later(CLOSING_S, self._abort_all)
        await super().close()
        late.cancel()

    def _abort_all(self) -> None:
        for connection in list(self.connections):
            connection.abort()

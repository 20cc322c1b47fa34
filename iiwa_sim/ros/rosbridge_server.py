"""The WebSocket server of rosbridge, by the library websockets."""

import asyncio
import contextlib
import http
import logging
import socket
from collections.abc import Callable
from functools import partial

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from iiwa_sim.ros.outbox import Outbox, Turns
from iiwa_sim.ros.rosbridge_session import RosbridgeSession
from iiwa_sim.server.listening import open_listener, peer_of
from iiwa_sim.server.web_access import WebAccess

LONGEST_FRAME_BYTES = 262_144
"""A longer message closes its connection. Several hundred commands fit in."""
READ_BYTES = 64
"""Bytes read at once (ten pings): the library handles all frames in them without a break."""
SYSTEM_BYTES = 16_384
"""Size of the system's buffers in each direction: small, so that a slow client gets recent messages."""
CLOSING_S = 1.0
"""Time (s) for a client to answer the closing handshake."""

logger = logging.getLogger(__name__)
of_library = logging.getLogger(f"{__name__}.connections")
of_library.setLevel(logging.CRITICAL)  # the answer of a handshake that fails has the reason


class RosbridgeServer:
    """WebSocket server for every admitted connection to an address, at any path."""

    def __init__(
        self,
        open_session: Callable[[str, Outbox], RosbridgeSession],
        address: tuple[str, int],
        turns: Turns,
        access: WebAccess,
    ) -> None:
        self._open_session = open_session
        self._turns = turns
        self._access = access
        self._server: Server | None = None
        self.address = address
        """Host and port listened on, from `start` on."""

    async def start(self) -> None:
        """Start listening. Raises ListenFault."""
        listener = await open_listener(*self.address)
        self.address = listener.getsockname()[:2]
        for which in (socket.SO_RCVBUF, socket.SO_SNDBUF):  # for the connections as well
            listener.setsockopt(socket.SOL_SOCKET, which, SYSTEM_BYTES)
        self._server = await serve(
            self._serve,
            sock=listener,
            process_request=self._admit,
            compression=None,
            ping_interval=None,
            close_timeout=CLOSING_S,
            max_size=LONGEST_FRAME_BYTES,
            write_limit=0,
            logger=of_library,
        )

    async def close(self) -> None:
        """Stop listening, close every connection, and wait until all have gone."""
        if self._server is not None:
            self._server.close()
            await self._server.wait_closed()

    def _admit(self, connection: ServerConnection, request: Request) -> Response | None:
        """Refuse a client without access."""
        connection.transport.max_size = READ_BYTES  # type: ignore[attr-defined]  # of asyncio's sockets
        headers = request.headers
        refusal = self._access.refusal(headers.get_all("Host"), headers.get_all("Origin"))
        if refusal is None:
            return None
        name = _name_of(connection)
        logger.warning("%s refused: %s", name, refusal, extra={"fields": {"session": name}})
        return connection.respond(http.HTTPStatus.FORBIDDEN, f"{refusal}\n")

    async def _serve(self, connection: ServerConnection) -> None:
        """Serve a client until it goes."""
        name, outbox = _name_of(connection), Outbox()
        mark = {"fields": {"session": name}}
        session = self._open_session(name, outbox)
        sending = asyncio.create_task(outbox.deliver(connection.send))
        logger.info("%s connected", name, extra=mark)
        try:
            while True:
                text = await connection.recv(decode=False)
                await self._turns.take(partial(session.receive, text))
                while outbox.replies:  # a client that does not read them is not read from
                    await connection.send(outbox.replies.popleft())
        except ConnectionClosed:
            pass
        finally:
            session.end()
            sending.cancel()
            with contextlib.suppress(asyncio.CancelledError, ConnectionClosed):
                await sending
            logger.info("%s disconnected", name, extra=mark)


def _name_of(connection: ServerConnection) -> str:
    return f"{peer_of(connection.transport)} (rosbridge)"

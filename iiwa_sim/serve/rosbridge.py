"""rosbridge on a WebSocket port: frames in, frames out. Needs the library websockets."""

import asyncio
import contextlib
import logging
import socket
from collections.abc import Callable
from time import thread_time
from typing import Protocol

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from iiwa_sim.serve.allowance import Allowance
from iiwa_sim.serve.listening import host_and_port, open_listener

LONGEST_FRAME_BYTES = 262_144
"""A longer message closes its connection: some hundred commands fit in, and are read in some milliseconds."""
FRAMES_AHEAD = 16
"""Taken from a client before it is made to wait."""
SYSTEM_BYTES = 16_384
"""What the system is asked to hold each way: the less, the newer is what a slow client gets next, and the
fewer small frames are there at once, which are all taken apart before anything else happens."""
CLOSING_S = 1.0
"""For a client to answer that it is closed."""
POLICY_VIOLATION = 1008

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
    """Serves every connection to `host`:`port`, whatever path it asks for."""

    def __init__(
        self,
        open_session: Callable[[str, Callable[[], None]], tuple[ClientSession, Waiting]],
        host: str,
        port: int,
        on_heard: Callable[[], None],
    ) -> None:
        """`open_session` takes the client's name and what is to be called when there is something to send.

        `on_heard` is called after every message.
        """
        self._open_session = open_session
        self._on_heard = on_heard
        self._asked = (host, port)
        self._server: Server | None = None

    async def start(self) -> None:
        """Listen. Raises ListenFault."""
        listener = await open_listener(*self._asked)
        for which in (socket.SO_RCVBUF, socket.SO_SNDBUF):  # of the connections, too
            listener.setsockopt(socket.SOL_SOCKET, which, SYSTEM_BYTES)
        self._server = await serve(
            self._serve,
            sock=listener,
            max_size=LONGEST_FRAME_BYTES,
            max_queue=FRAMES_AHEAD,
            write_limit=0,
            close_timeout=CLOSING_S,
            compression=None,  # it would cost more time than it saves on a local network
            logger=_quiet,
        )

    @property
    def address(self) -> tuple[str, int]:
        """Host and port listened on. Raises RuntimeError before `start` and after `close`."""
        if self._server is None:
            raise RuntimeError("the server does not listen")
        host, port = next(iter(self._server.sockets)).getsockname()[:2]
        return host, port

    async def close(self) -> None:
        """Listen no more and close every connection."""
        if self._server is not None:
            self._server.close()
            await self._server.wait_closed()
            self._server = None

    async def _serve(self, connection: ServerConnection) -> None:
        name = f"{host_and_port(*connection.remote_address[:2])} (rosbridge)"
        mark = {"fields": {"session": name}}
        logger.info("%s connected", name, extra=mark)
        loop = asyncio.get_running_loop()
        allowance = Allowance()
        there_is_more = asyncio.Event()
        session, waiting = self._open_session(name, there_is_more.set)
        sending = asyncio.create_task(_send(connection, waiting, there_is_more))
        try:
            while not (session.closing or waiting.overflown):
                message = await connection.recv(decode=False)
                begun_s = thread_time()
                session.receive(message)
                self._on_heard()
                await _rest(connection, allowance.rest_s(thread_time() - begun_s, loop.time()))
        except ConnectionClosed:
            pass
        finally:
            session.end()
            sending.cancel()
            await asyncio.wait([sending])
        if waiting.overflown:
            logger.warning("%s asks and does not read the answers: it is dropped", name, extra=mark)
            connection.transport.abort()
        elif session.closing:
            await _send_last(connection, waiting)
        logger.info("%s disconnected", name, extra=mark)


async def _rest(connection: ServerConnection, rest_s: float) -> None:
    """Listen to others for so long, or until the connection is closed."""
    # Also where it is 0: frames that are there already would be taken one after the other.
    await asyncio.sleep(0)
    if rest_s > 0.0:
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(rest_s):
                await connection.wait_closed()


async def _send(connection: ServerConnection, waiting: Waiting, there_is_more: asyncio.Event) -> None:
    """Send what waits, as fast as the client takes it, until it is gone."""
    loop = asyncio.get_running_loop()
    try:
        while True:
            there_is_more.clear()
            message, wait_s = waiting.next(loop.time())
            if message is not None:
                await connection.send(message)
                continue
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(wait_s):
                    await there_is_more.wait()
    except ConnectionClosed:
        return


async def _send_last(connection: ServerConnection, waiting: Waiting) -> None:
    """Send why the client is closed, if it takes that, and close."""
    with contextlib.suppress(ConnectionClosed, TimeoutError):
        async with asyncio.timeout(CLOSING_S):
            while (message := waiting.next(0.0)[0]) is not None:
                await connection.send(message)
    await connection.close(POLICY_VIOLATION)

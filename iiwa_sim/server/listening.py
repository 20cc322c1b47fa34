"""Listening sockets: opening them, accepting connections, and messages for errors."""

import asyncio
import contextlib
import errno
import logging
import os
import socket
import struct
from collections.abc import Callable
from functools import partial
from typing import Any

from iiwa_sim.protocols.ports import MAX_PORT
from iiwa_sim.wording import Unusable, harmless, shortened

BACKLOG = 512
"""Length of the queue of connections that are not accepted yet."""
LONGEST_HOST = 100
"""Characters of a host name that a message shows."""
AGAIN_S = 0.25
"""Time (s) after which accepting is tried again when the system has no descriptor left."""
_USED_UP = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)

_RESET_AT_CLOSE = struct.pack("ii", 1, 0)  # struct linger: no time for what is not sent yet

logger = logging.getLogger(__name__)


class ListenFault(Unusable):
    """An address cannot be listened on. The message is one line."""


class Acceptor:
    """Accepts connections at a listening socket until `close`.

    Between `refuse` and `accept` the system answers connection attempts with RST. The port stays reserved: a
    socket is bound to it that does not listen.
    """

    def __init__(self, listening: socket.socket, open_protocol: Callable[[], asyncio.BaseProtocol]) -> None:
        self._loop = asyncio.get_running_loop()
        self._listening = listening
        self._open_protocol = open_protocol
        self._opening: dict[asyncio.Task[None], socket.socket] = {}
        self._accepting: asyncio.Task[None] | None = None
        self._begin()

    @property
    def address(self) -> tuple[str, int]:
        """Host and port listened on, or refused at."""
        host, port = self._listening.getsockname()[:2]
        return host, port

    def close(self) -> None:
        """Stop listening; accepted connections go on."""
        if self._accepting is not None:
            self._accepting.cancel()
            self._accepting = None
            self._loop.remove_reader(self._listening)
        self._listening.close()

    def refuse(self) -> None:
        """Refuse new connections until `accept`."""
        if self._accepting is not None:
            family, address = self._listening.family, self._listening.getsockname()
            self.close()
            self._listening = socket.socket(family)
            self._listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._listening.bind(address)

    def accept(self) -> None:
        """Accept connections again, where they are refused."""
        if self._accepting is None:
            self._listening.listen(BACKLOG)
            self._begin()

    def drop_arriving(self, *, reset: bool) -> None:
        """Close or reset the connections that wait to be accepted."""
        for opening, connection in self._opening.items():
            opening.cancel()
            opening.add_done_callback(partial(_close, connection, reset))
        with contextlib.suppress(OSError):  # no connection waits, or no descriptor is left
            while True:
                _close(self._listening.accept()[0], reset)

    def _begin(self) -> None:
        self._listening.setblocking(False)
        self._accepting = self._loop.create_task(accept(self._listening, self._serve))

    def _serve(self, connection: socket.socket, _peer: object) -> None:
        opening = self._loop.create_task(self._open(connection))
        self._opening[opening] = connection
        opening.add_done_callback(self._opening.pop)

    async def _open(self, connection: socket.socket) -> None:
        try:
            await self._loop.connect_accepted_socket(self._open_protocol, connection)
        except OSError:  # the client has gone already
            connection.close()


async def accept(listening: socket.socket, serve: Callable[[socket.socket, Any], None]) -> None:
    """Call `serve` with each connection and its peer, until cancelled.

    It accepts one connection in each turn of the event loop, so that a flood of connections delays nobody.
    When the system has no descriptor left, that is logged once a second and accepting is tried again later.
    `loop.sock_accept` would lose a connection that comes just before the task is cancelled.
    """
    loop, quiet_until_s = asyncio.get_running_loop(), 0.0
    while True:
        comes: asyncio.Future[None] = loop.create_future()
        loop.add_reader(listening, lambda comes=comes: comes.done() or comes.set_result(None))  # type: ignore[misc]
        await comes  # whoever cancels this removes the reader
        loop.remove_reader(listening)
        try:
            connection, peer = listening.accept()
            connection.setblocking(False)
            serve(connection, peer)
        except OSError as fault:  # others mean that the client has gone already
            if fault.errno in _USED_UP:
                if loop.time() >= quiet_until_s:
                    quiet_until_s = loop.time() + 1.0
                    logger.warning("nobody can connect for the time being: %s", why(fault))
                await asyncio.sleep(AGAIN_S)
        await asyncio.sleep(0)


def _close(connection: socket.socket, reset: bool, _opening: object = None) -> None:
    if reset:
        reset_at_close(connection)
    connection.close()


def reset_at_close(connection: socket.socket) -> None:
    """Make the next close a reset that discards unsent data."""
    with contextlib.suppress(OSError):  # already gone
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET_AT_CLOSE)


async def open_listener(host: str, port: int) -> socket.socket:
    """A socket that listens on `host`:`port`. Raises ListenFault.

    Port 0 picks a free one. A host name stands for its first address, IPv4 before IPv6.
    """
    if not 0 <= port <= MAX_PORT:
        raise ListenFault(f"cannot listen on port {port}: expected 0 to {MAX_PORT}")
    if not host:
        raise ListenFault("cannot listen on host '': expected an address or a host name, 0.0.0.0 for all")
    try:
        found = await asyncio.get_running_loop().getaddrinfo(
            host, None, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )
        # One address only: with two, port 0 would stand for two ports.
        family, _, _, _, (address, *_) = min(found, key=lambda info: info[0] != socket.AF_INET)
        return socket.create_server((address, port), family=family, backlog=BACKLOG)
    except (OSError, ValueError) as fault:  # ValueError: characters that no host name has
        shown = host_and_port(shortened(harmless(host), LONGEST_HOST), port)
        raise ListenFault(f"cannot listen on {shown}: {why(fault)}") from fault


def peer_of(transport: asyncio.BaseTransport) -> str:
    """HOST:PORT of the client."""
    peer = transport.get_extra_info("peername")
    return host_and_port(*peer[:2]) if peer else "a client already gone"


def host_and_port(host: str, port: int) -> str:
    """HOST:PORT, with an IPv6 host in brackets."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def why(fault: Exception) -> str:
    """The system's text for an error, without the address."""
    if isinstance(fault, OSError) and fault.errno is not None:
        # Python adds the address to what bind(2) says; name resolution has numbers of its own, below 0
        return os.strerror(fault.errno) if fault.errno > 0 else str(fault.strerror)
    return str(fault)

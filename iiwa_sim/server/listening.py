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


Serve = Callable[[socket.socket, Any], None]
"""Serves a connection from a peer's address."""


class Acceptor:
    """Accepts connections at a listening socket until `close`, one in each turn of the event loop.

    Between `refuse` and `accept` the system answers connection attempts with RST. The port stays reserved: a
    socket is bound to it that does not listen. When the system has no descriptor left, that is logged once a
    second and accepting is tried again later.
    """

    def __init__(self, listening: socket.socket, serve: Serve) -> None:
        self._loop = asyncio.get_running_loop()
        self._listening = listening
        self._serve = serve
        self._accepts = False
        self._again: asyncio.TimerHandle | None = None
        self._quiet_until_s = 0.0
        self.accept()

    @property
    def address(self) -> tuple[str, int]:
        """Host and port listened on, or refused at."""
        host, port = self._listening.getsockname()[:2]
        return host, port

    def close(self) -> None:
        """Stop listening; accepted connections go on."""
        self._accepts = False
        if self._again is not None:
            self._again.cancel()
        self._loop.remove_reader(self._listening)
        self._listening.close()

    def refuse(self) -> None:
        """Refuse new connections until `accept`."""
        if self._accepts:
            family, address = self._listening.family, self._listening.getsockname()
            self.close()
            self._listening = socket.socket(family)
            self._listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._listening.bind(address)

    def accept(self) -> None:
        """Accept connections, where they are refused."""
        if not self._accepts:
            self._accepts = True
            self._listening.setblocking(False)
            self._listening.listen(BACKLOG)
            self._loop.add_reader(self._listening, self._arrives)

    def drop_waiting(self, *, reset: bool) -> None:
        """Close or reset the connections that wait to be accepted."""
        with contextlib.suppress(OSError):  # no connection waits, or no descriptor is left
            while True:
                with self._listening.accept()[0] as connection:
                    if reset:
                        reset_at_close(connection)

    def _arrives(self) -> None:
        try:
            connection, peer = self._listening.accept()
        except OSError as fault:  # others mean that the client has gone already
            if fault.errno in _USED_UP:
                if self._loop.time() >= self._quiet_until_s:
                    self._quiet_until_s = self._loop.time() + 1.0
                    logger.warning("nobody can connect for the time being: %s", why(fault))
                self._loop.remove_reader(self._listening)
                add = partial(self._loop.add_reader, self._listening, self._arrives)
                self._again = self._loop.call_later(AGAIN_S, add)
            return
        connection.setblocking(False)
        self._serve(connection, peer)


def as_protocol(open_protocol: Callable[[], asyncio.BaseProtocol]) -> Serve:
    """Return what serves each connection by a protocol of asyncio."""
    loop, opening = asyncio.get_running_loop(), set[asyncio.Task[None]]()

    async def opened(connection: socket.socket, protocol: asyncio.BaseProtocol) -> None:
        try:
            await loop.connect_accepted_socket(lambda: protocol, connection)
        except OSError:  # the client has gone already
            connection.close()

    def serve(connection: socket.socket, _peer: object) -> None:
        task = loop.create_task(opened(connection, open_protocol()))
        opening.add(task)
        task.add_done_callback(opening.discard)

    return serve


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
        in_use = isinstance(fault, OSError) and fault.errno == errno.EADDRINUSE
        hint = "; port 0, such as --port 0, is any free one" if in_use else ""
        raise ListenFault(f"cannot listen on {shown}: {why(fault)}{hint}") from fault


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

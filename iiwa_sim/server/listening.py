"""Listening sockets: opening them, accepting connections, and messages for errors."""

import asyncio
import contextlib
import errno
import logging
import os
import socket
import struct
from collections.abc import Awaitable, Callable
from typing import Any

from iiwa_sim.wording import Unusable, harmless, shortened

BACKLOG = 512
"""Length of the queue of connections that are not accepted yet."""
AGAIN_S = 1.0
"""Time (s) after which accepting is tried again when the system has no descriptor left."""
_RESET_AT_CLOSE = struct.pack("ii", 1, 0)  # struct linger: no time for unsent bytes

logger = logging.getLogger(__name__)


class ListenFault(Unusable):
    """An address cannot be listened on. The message is one line."""


class Acceptor:
    """Listener on `host`:`port` from `start` to `close` that accepts connections one by one.

    Between `refuse` and `accept` the system answers connection attempts with RST. The port stays reserved: a
    socket is bound to it that does not listen.
    """

    def __init__(
        self, host: str, port: int, serve: Callable[[socket.socket, Any], Awaitable[object]]
    ) -> None:
        """`serve` gets each connection with the address of its peer. It may raise OSError."""
        self._asked = host, port
        self._serve = serve
        self.listening: socket.socket | None = None
        """The socket, between `start` and `close`."""
        self._accepting: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Start listening. Raises ListenFault."""
        self.listening = await open_listener(*self._asked)
        self.accept()

    @property
    def address(self) -> tuple[str, int]:
        """Host and port listened on, or refused at. Raises RuntimeError before `start` and after `close`."""
        if self.listening is None:
            raise RuntimeError("the server does not listen")
        host, port = self.listening.getsockname()[:2]
        return host, port

    def accept(self) -> None:
        """Accept connections, where they are refused."""
        if self.listening is not None and self._accepting is None:
            self.listening.setblocking(False)
            self.listening.listen(BACKLOG)
            self._accepting = asyncio.get_running_loop().create_task(self._accept_from(self.listening))

    def refuse(self) -> None:
        """Refuse new connections until `accept`."""
        if self.listening is not None and self._accepting is not None:
            family, address = self.listening.family, self.listening.getsockname()
            self.close()
            self.listening = socket.socket(family)
            self.listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self.listening.bind(address)

    def close(self) -> None:
        """Stop listening; accepted connections go on."""
        listening, accepting = self.listening, self._accepting
        self.listening = self._accepting = None
        if listening is not None and accepting is not None:
            loop = asyncio.get_running_loop()
            loop.remove_reader(listening)  # before its number is another's
            loop.call_soon(accepting.cancel)  # a connection that has just come is served before
        if listening is not None:
            listening.close()

    async def _accept_from(self, listening: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        while self.listening is listening:
            try:
                connection, peer = await loop.sock_accept(listening)
            except ConnectionError:  # the client has gone already
                continue
            except OSError as fault:
                logger.warning("no client can connect for the time being: %s", why(fault))
                await asyncio.sleep(AGAIN_S)
                continue
            try:
                await asyncio.shield(self._serve(connection, peer))
            except OSError:  # the client has gone already
                connection.close()


def reset_at_close(connection: socket.socket) -> None:
    """Make the next close a reset that discards unsent data."""
    with contextlib.suppress(OSError):  # already gone
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET_AT_CLOSE)


async def open_listener(host: str, port: int) -> socket.socket:
    """Return a socket that listens on `host`:`port`. Raises ListenFault.

    Port 0 picks a free one. A host name stands for its first address, IPv4 before IPv6.
    """
    try:
        found = await asyncio.get_running_loop().getaddrinfo(
            host, None, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )
        # One address only: with two, port 0 would stand for two ports.
        family, _, _, _, (address, *_) = min(found, key=lambda info: info[0] != socket.AF_INET)
        return socket.create_server((address, port), family=family, backlog=BACKLOG)
    except (OSError, ValueError, OverflowError) as fault:  # characters or a port that no address has
        shown = host_and_port(shortened(harmless(host), 100), port)
        in_use = getattr(fault, "errno", 0) == errno.EADDRINUSE
        hint = ", by a program or another option; port 0, such as --port 0, is any free one" if in_use else ""
        raise ListenFault(f"cannot listen on {shown}: {why(fault)}{hint}") from fault


def peer_of(transport: asyncio.BaseTransport) -> str:
    """HOST:PORT of the client."""
    peer = transport.get_extra_info("peername")
    return host_and_port(*peer[:2]) if peer else "a client already gone"


def host_and_port(host: str, port: int) -> str:
    """HOST:PORT, with an IPv6 host in brackets."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def why(fault: Exception) -> str:
    """Return the system's text for an error, without the address."""
    if isinstance(fault, OSError) and fault.errno is not None:
        # Python adds the address to what bind(2) says; name resolution has numbers of its own, below 0
        return os.strerror(fault.errno) if fault.errno > 0 else str(fault.strerror)
    return str(fault)
